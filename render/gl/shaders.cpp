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
};
)";

constexpr const char* kSurfaceVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;  // w: 0 without a normal
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 rowX;
layout(location = 4) in vec4 rowY;
layout(location = 5) in vec4 rowZ;
layout(location = 6) in vec4 baseColour;
layout(location = 7) in vec4 emissive;
layout(location = 8) in vec4 surface;
layout(location = 9) in uint id;
#ifdef COLOURED
layout(location = 10) in vec4 colour;  // sRGB with linear alpha
out vec4 tint;                         // linear
#endif

// Prepass and shading must compute equal depth. Drivers compile a program again after its first
// draws, with other contractions; `precise` forbids these, `invariant` does not.
invariant gl_Position;
out vec3 point;
out vec3 softNormal;
out vec2 texCoord;
flat out vec4 base;
flat out vec4 glow;
flat out vec4 finish;
flat out uint entity;

void main() {
  precise vec3 relative =
      vec3(rowX.x, rowY.x, rowZ.x) * position.x + vec3(rowX.y, rowY.y, rowZ.y) * position.y +
      vec3(rowX.z, rowY.z, rowZ.z) * position.z + vec3(rowX.w, rowY.w, rowZ.w);
  point = relative;
  // The rows of the cofactor matrix: correct for non-uniform scales, and for mirroring up to the
  // sign, which the fragment shader determines.
  softNormal = normal.w == 0.0 ? vec3(0.0)
                               : vec3(dot(cross(rowY.xyz, rowZ.xyz), normal.xyz),
                                      dot(cross(rowZ.xyz, rowX.xyz), normal.xyz),
                                      dot(cross(rowX.xyz, rowY.xyz), normal.xyz));
  texCoord = uv;
#ifdef COLOURED
  vec3 steep = pow((colour.rgb + 0.055) / 1.055, vec3(2.4));
  tint = vec4(mix(colour.rgb / 12.92, steep, greaterThan(colour.rgb, vec3(0.04045))), colour.a);
#endif
  base = baseColour;
  glow = emissive;
  finish = surface;
  entity = id;
  precise vec4 clip = clipFromRelative[0] * relative.x + clipFromRelative[1] * relative.y +
                      clipFromRelative[2] * relative.z + clipFromRelative[3];
  gl_Position = clip;
#ifdef ROUNDED
  // Vertices behind the eye are clipped first and keep their positions.
  vec2 grid = 256.0 * vec2(rightByX.w, upByY.w);
  float w = gl_Position.w;
  if (w > 0.0) gl_Position.xy = round(gl_Position.xy / w * grid) / grid * w;
#endif
}
)";

// The shading model as GLSL text; the ray renderer compiles the same file as C++.
constexpr const char* kShadingSource =
#define SHADING_SOURCE(...) #__VA_ARGS__
#include "render/shading.glsl.inc"
#undef SHADING_SOURCE
    ;

constexpr const char* kSurfaceFragment = R"(
in vec3 point;
in vec3 softNormal;
in vec2 texCoord;
#ifdef COLOURED
in vec4 tint;
#endif
flat in vec4 base;
flat in vec4 glow;
flat in vec4 finish;
flat in uint entity;

layout(location = 0) out vec4 colour;
#ifndef BLEND
layout(location = 1) out uint visibleId;
#endif
#ifdef NORMALS
layout(location = 2) out vec4 facing;
#endif
#ifdef PLANE_DEPTH
layout(location = 3) out float planeDepth;
#endif
#ifdef TEXTURED
layout(binding = 0) uniform sampler2D baseColourTexture;
#endif
#ifdef SHADOWS
layout(binding = 1) uniform sampler2D shadowMask;
#endif

// exposed() and sRGB encoding in one: a rational function of the square root, with an error of at
// most a quarter of a byte step. Framebuffer encoding takes software renderers three times as long,
// because they read, decode, select and encode the existing colour.
vec3 encoded(vec3 radiance) {
  vec3 t = sqrt(clamp(kExposure * radiance, 0.0, 9.0));  // larger values are white
  return t * (-0.101668 + t * (16.2093 + t * (251.839 + t * 13.5556))) /
         (1.0 + t * (2.352 + t * (240.678 + t * (-25.9677 + t * (127.038 + t * -15.3394)))));
}

// Always towards the eye: models have inconsistent winding, mirrored transforms or no normals.
vec3 facingNormal(vec3 toEye) {
  vec3 flat_ = cross(dFdx(point), dFdy(point));
  if (dot(flat_, toEye) < 0.0) flat_ = -flat_;
  vec3 n = softNormal * (dot(softNormal, flat_) < 0.0 ? -1.0 : 1.0);
  if (n == vec3(0.0)) n = flat_;
  float size = dot(n, n);
  return size > 0.0 ? n * inversesqrt(size) : toEye;
}

#ifdef PLANE_DEPTH
// GPUs round vertices to 1/256 pixel and interpolate between the rounded ones, the depth buffer
// included. `point` is then a point of the triangle's plane that projects next to the pixel's
// centre. The inverse depth (orthographic: the depth) is affine in the image, so its gradient leads
// from there to the centre.
float depthAtCentre() {
  const float kMaxRounding = 1.0 / 16.0;  // pixels; OpenGL's coarsest grid of vertices
  bool parallel = forward.w > 0.5;
  vec4 clip = clipFromRelative * vec4(point, 1.0);
  vec2 halfSize = vec2(rightByX.w, upByY.w);
  vec2 position = halfSize + halfSize * vec2(1.0, -1.0) * clip.xy / clip.w;
  vec2 offset = clamp(gl_FragCoord.xy - position, -kMaxRounding, kMaxRounding);
  float affine = parallel ? dot(forward.xyz, point) : 1.0 / clip.w;
  // Equal bits in all programs.
  precise float atCentre = affine + dFdx(affine) * offset.x + dFdy(affine) * offset.y;
  return parallel ? atCentre : 1.0 / atCentre;
}
#endif

void main() {
#ifdef PLANE_DEPTH
  planeDepth = depthAtCentre();  // before any discard, as below
#endif
#ifdef SHADED
#ifdef PLAN
  float distance = 0.0;
  vec3 toEye = -forward.xyz;
#else
  float square = max(dot(point, point), 1e-12);
  float inverse = inversesqrt(square);
  float distance = square * inverse;
  vec3 toEye = -inverse * point;
#endif
  vec3 n = facingNormal(toEye);  // before any discard: derivatives are undefined after it
#endif
  vec4 albedo = base;
#ifdef COLOURED
  albedo *= tint;
#endif
#ifdef TEXTURED
  albedo *= texture(baseColourTexture, texCoord);
#endif
#ifdef MASK
  if (albedo.a < finish.x) discard;
#endif
#ifndef BLEND
  visibleId = entity;
#endif
#ifdef SHADED
#ifdef SHADOWS
  float sunlit = texelFetch(shadowMask, ivec2(gl_FragCoord.xy), 0).r;
#else
  float sunlit = 1.0;
#endif
  vec3 radiance = lit(albedo.rgb, n, toEye, distance, finish.y, finish.z, sunlit) + kGlow * glow.rgb;
#ifdef PLAN
  // A plan cuts objects open; their interior is darker to emphasise cut walls.
  bool inside = gl_FrontFacing == (glow.w > 0.5);
  if (inside && finish.w < 0.5) radiance *= kCutOpen;
#else
  radiance = inAir(radiance, distance);
#endif
#ifdef BLEND
  colour = vec4(exposed(radiance), glassAlpha(albedo.a, n, toEye));
#else
  colour = vec4(encoded(radiance), 1.0);
#endif
#ifdef NORMALS
  facing = vec4(n, 0.0);
#endif
#endif
}
)";

constexpr const char* kSkyVertex = R"(
out vec3 direction;
flat out float plan;

void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  direction = middle.xyz + corner.x * rightByX.xyz + corner.y * upByY.xyz;
  plan = forward.w;
  gl_Position = vec4(corner, 0.0, 1.0);  // depth 0 is the farthest
}
)";

constexpr const char* kSkyFragment = R"(
in vec3 direction;
flat in float plan;
layout(location = 0) out vec4 colour;

void main() {
  vec3 linear = plan > 0.5 ? planPaper() : exposed(skyFor(normalize(direction)));
  // sRGB encoding; the sky is never dark enough for the linear segment.
  colour = vec4(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 1.0);
}
)";

}  // namespace

std::string makeSurfaceVertexSource(const SurfaceVariant& variant, bool roundsVertices) {
  return std::string(kVersion) + (variant.coloured ? "#define COLOURED\n" : "") +
         (roundsVertices ? "#define ROUNDED\n" : "") + kFrameBlock + kSurfaceVertex;
}

std::string makeSurfaceFragmentSource(const SurfaceVariant& variant) {
  std::string source = kVersion;
  if (variant.coloured) source += "#define COLOURED\n";
  if (variant.textured) source += "#define TEXTURED\n";
  if (variant.mask) source += "#define MASK\n";
  if (variant.blend) source += "#define BLEND\n";
  if (variant.normals) source += "#define NORMALS\n";
  if (variant.shaded) source += "#define SHADED\n";
  if (variant.shadows) source += "#define SHADOWS\n";
  if (variant.planeDepth) source += "#define PLANE_DEPTH\n";
  if (variant.plan) source += "#define PLAN\n";
  return source + kFrameBlock + kShadingSource + kSurfaceFragment;
}

std::string makeSkyVertexSource() {
  return std::string(kVersion) + kFrameBlock + kSkyVertex;
}

std::string makeSkyFragmentSource() {
  return std::string(kVersion) + kFrameBlock + kShadingSource + kSkyFragment;
}

}  // namespace enfilade::render
