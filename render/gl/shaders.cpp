#include "render/gl/shaders.hpp"

namespace enfilade::render {
namespace {

constexpr const char* kVersion = "#version 450 core\n";

constexpr const char* kFrameBlock = R"(
layout(std140, binding = 0) uniform Frame {
  mat4 clipFromRelative;
  vec4 forward;
  vec4 middle;
  vec4 rightByX;
  vec4 upByY;
  vec4 range;
};
)";

constexpr const char* kSurfaceVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;  // w: 0 when the mesh has none
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 rowX;
layout(location = 4) in vec4 rowY;
layout(location = 5) in vec4 rowZ;
layout(location = 6) in vec4 baseColour;
layout(location = 7) in vec4 emissive;
layout(location = 8) in vec4 surface;
layout(location = 9) in uint id;

out vec3 point;
out vec3 softNormal;
out vec2 place;
flat out vec4 base;
flat out vec4 glow;
flat out vec4 finish;
flat out uint entity;

void main() {
  vec4 p = vec4(position, 1.0);
  point = vec3(dot(rowX, p), dot(rowY, p), dot(rowZ, p));
  // The rows of the cofactor matrix: right for unequal scales, and for mirrors up to a sign that
  // the fragment shader does not trust anyway.
  softNormal = normal.w == 0.0 ? vec3(0.0)
                               : vec3(dot(cross(rowY.xyz, rowZ.xyz), normal.xyz),
                                      dot(cross(rowZ.xyz, rowX.xyz), normal.xyz),
                                      dot(cross(rowX.xyz, rowY.xyz), normal.xyz));
  place = uv;
  base = baseColour;
  glow = emissive;
  finish = surface;
  entity = id;
  gl_Position = clipFromRelative * vec4(point, 1.0);
}
)";

// As text of GLSL what the ray renderer compiles as C++.
constexpr const char* kLight =
#define LIGHT_TEXT(...) #__VA_ARGS__
#include "render/light.inc"
#undef LIGHT_TEXT
    ;

constexpr const char* kSurfaceFragment = R"(
in vec3 point;
in vec3 softNormal;
in vec2 place;
flat in vec4 base;
flat in vec4 glow;
flat in vec4 finish;
flat in uint entity;

layout(location = 0) out vec4 colour;
#ifndef BLEND
layout(location = 1) out uint seen;
#endif
#ifdef NORMALS
layout(location = 2) out vec4 facing;
#endif
#ifdef TEXTURED
layout(binding = 0) uniform sampler2D baseColourTexture;
#endif

// Always towards the eye: real models are wound both ways, mirrored, or have no normals at all.
vec3 facingNormal(vec3 toEye) {
  vec3 flat_ = cross(dFdx(point), dFdy(point));
  if (dot(flat_, toEye) < 0.0) flat_ = -flat_;
  float soft = dot(softNormal, softNormal);
  if (soft > 0.0) return softNormal * (dot(softNormal, flat_) < 0.0 ? -1.0 : 1.0) / sqrt(soft);
  float size = dot(flat_, flat_);
  return size > 0.0 ? flat_ / sqrt(size) : toEye;
}

void main() {
  vec4 albedo = base;
#ifdef TEXTURED
  albedo *= texture(baseColourTexture, place);
#endif
#ifdef MASK
  if (albedo.a < finish.x) discard;
#endif
  bool plan = forward.w > 0.5;
  float distance = plan ? 0.0 : length(point);
  vec3 toEye = plan ? -forward.xyz : -point / max(distance, 1e-6);
  vec3 n = facingNormal(toEye);
  vec3 radiance = lit(albedo.rgb, n, toEye, distance, finish.y, finish.z) + kGlow * glow.rgb;
  // A plan cuts things open; their insides are darker, so that cut walls stand out.
  bool inside = gl_FrontFacing == (glow.w > 0.5);
  if (plan && inside && finish.w < 0.5) radiance *= kCutOpen;
  if (!plan) radiance = inAir(radiance, -toEye, distance);
#ifdef BLEND
  colour = vec4(exposed(radiance), glassAlpha(albedo.a, n, toEye));
#else
  colour = vec4(exposed(radiance), 1.0);
  seen = entity;
#endif
#ifdef NORMALS
  facing = vec4(n, 0.0);
#endif
}
)";

constexpr const char* kSkyVertex = R"(
out vec3 direction;

void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  direction = middle.xyz + corner.x * rightByX.xyz + corner.y * upByY.xyz;
  gl_Position = vec4(corner, 0.0, 1.0);  // depth 0 is the farthest
}
)";

constexpr const char* kSkyFragment = R"(
in vec3 direction;
layout(location = 0) out vec4 colour;

void main() {
  bool plan = forward.w > 0.5;
  colour = vec4(plan ? planPaper() : exposed(skyFor(normalize(direction))), 1.0);
}
)";

// Darkens hollows, from depth alone (after Luft, Colditz and Deussen 2006, but exact on planes:
// reversed depth is affine over the picture wherever a surface is flat, so the mean of two opposite
// neighbours differs from the middle only where surfaces meet). Multiplied into the colour.
constexpr const char* kHollowFragment = R"(
layout(binding = 0) uniform sampler2D depthPlane;
layout(location = 0) out vec4 factor;

const int kPairs = 4;
const vec2 kDirections[kPairs] =
    vec2[](vec2(1.0, 0.2), vec2(-0.2, 1.0), vec2(0.3, 0.3), vec2(-0.3, 0.3));

float metres(float d) {
  float near = range.x, far = range.y;
  return forward.w > 0.5 ? far - d * (far - near) : near * far / (near + d * (far - near));
}

void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 size = textureSize(depthPlane, 0);
  float d = texelFetch(depthPlane, here, 0).r;
  if (d <= 0.0) discard;
  float z = metres(d);
  float pixelsPerMetre = forward.w > 0.5 ? range.z : range.z / z;
  float radius = clamp(kHollowRadius * pixelsPerMetre, kHollowFewestPixels, kHollowMostPixels);
  vec2 room = vec2(min(here, size - 1 - here));  // both neighbours must lie in the picture
  float hollow = 0.0;
  for (int i = 0; i < kPairs; ++i) {
    vec2 wanted = kDirections[i] * radius;
    vec2 fit = room / max(abs(wanted), vec2(1e-3));
    ivec2 step_ = ivec2(round(wanted * min(1.0, min(fit.x, fit.y))));
    if (step_ == ivec2(0)) continue;
    ivec2 a = here + step_, b = here - step_;
    float mean = 0.5 * (texelFetch(depthPlane, a, 0).r + texelFetch(depthPlane, b, 0).r);
    float slope = (z - metres(mean)) * pixelsPerMetre / length(vec2(step_));
    hollow += hollowOf(slope);
  }
  factor = vec4(vec3(1.0 - kHollowStrength * hollow / float(kPairs)), 1.0);
}
)";

}  // namespace

std::string surfaceVertexSource() {
  return std::string(kVersion) + kFrameBlock + kSurfaceVertex;
}

std::string surfaceFragmentSource(const SurfaceVariant& variant) {
  std::string source = kVersion;
  if (variant.textured) source += "#define TEXTURED\n";
  if (variant.mask) source += "#define MASK\n";
  if (variant.blend) source += "#define BLEND\n";
  if (variant.normals) source += "#define NORMALS\n";
  return source + kFrameBlock + kLight + kSurfaceFragment;
}

std::string skyVertexSource() {
  return std::string(kVersion) + kFrameBlock + kSkyVertex;
}

std::string hollowFragmentSource() {
  return std::string(kVersion) + kFrameBlock + kLight + kHollowFragment;
}

std::string skyFragmentSource() {
  return std::string(kVersion) + kFrameBlock + kLight + kSkyFragment;
}

}  // namespace enfilade::render
