#include "render/raytrace/shading.hpp"

#include <cmath>

#include "render/camera/camera.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::render {
namespace glsl {
namespace {

#define SHADING_SOURCE(...) __VA_ARGS__
#include "render/shading.glsl.inc"
#undef SHADING_SOURCE

}  // namespace
}  // namespace glsl

namespace {

using glsl::vec3;

vec3 toGlsl(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Barycentric coordinates at a pixel, and their change per pixel on both axes.
struct Barycentrics {
  std::array<double, 3> weights, perPixelX, perPixelY;
};

Barycentrics computeBarycentrics(const BarycentricWeights& weights, double x, double y) {
  const std::array<double, 3> w = weights.at(x, y);
  const auto& c = weights.corner;
  const double sum = w[0] + w[1] + w[2];
  const double sumX = c[0].dx + c[1].dx + c[2].dx, sumY = c[0].dy + c[1].dy + c[2].dy;
  Barycentrics barycentrics;
  for (std::size_t i = 0; i < 3; ++i) {
    // Clamped: the exact ray may miss the triangle that Embree hit in floats.
    barycentrics.weights[i] = sum != 0 ? std::clamp(w[i] / sum, 0.0, 1.0) : 1.0 / 3;
    barycentrics.perPixelX[i] = sum != 0 ? (c[i].dx - barycentrics.weights[i] * sumX) / sum : 0;
    barycentrics.perPixelY[i] = sum != 0 ? (c[i].dy - barycentrics.weights[i] * sumY) / sum : 0;
  }
  return barycentrics;
}

template <class Value>
Value interpolate(const std::array<double, 3>& weights, const std::array<Value, 3>& corners) {
  return weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
}

Eigen::Vector4d decodeColour(const scene::VertexColour& colour) {
  Eigen::Vector4f linear;
  for (int c = 0; c < 3; ++c)
    linear[c] = scene::srgbByteToLinear(colour[static_cast<std::size_t>(c)]);
  linear[3] = static_cast<float>(colour[3]) / 255;
  return linear.cast<double>();
}

}  // namespace

Vec3 computeSunDirection() {
  const vec3& sun = glsl::kSunDirection;
  return Vec3(static_cast<double>(sun.x), static_cast<double>(sun.y), static_cast<double>(sun.z))
      .normalized();
}

ShadedTriangle::ShadedTriangle(const BatchTriangle& source, const PrimaryRays& rays)
    : batch(source.batch) {
  const EyeSpaceCorners corners = source.corners(rays.eye);
  depth = computePlaneDepth(corners, rays);
  weights = computeWeights(corners, rays);
  faceNormal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const scene::Mesh& mesh = *batch->mesh;
  hasVertexNormals = mesh.normals.size() == mesh.positions.size();
  const bool uv = mesh.uvs.size() == mesh.positions.size();
  // The rows of the cofactor matrix, as in the vertex shader.
  const Eigen::Matrix3d& m = batch->worldFromMesh->linear();
  const Vec3 x = m.row(0), y = m.row(1), z = m.row(2);
  const Vec3 rowX = y.cross(z), rowY = z.cross(x), rowZ = x.cross(y);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t corner = mesh.indices[3 * std::size_t{source.triangle} + i];
    if (hasVertexNormals) {
      const Vec3 n = mesh.normals[corner].cast<double>();
      vertexNormals[i] = {rowX.dot(n), rowY.dot(n), rowZ.dot(n)};
    }
    if (uv) uvs[i] = mesh.uvs[corner].cast<double>();
    if (!mesh.colours.empty()) colours[i] = decodeColour(mesh.colours[corner]);
  }
}

Texel Shading::computeAlbedo(const ShadedTriangle& triangle, double x, double y) const {
  const Eigen::Vector4f& base = triangle.batch->material->baseColour;
  Texel albedo{base[0], base[1], base[2], base[3]};
  const bool coloured = !triangle.batch->mesh->colours.empty();
  if (triangle.batch->texture < 0 && !coloured) return albedo;
  const Barycentrics barycentrics = computeBarycentrics(triangle.weights, x, y);
  if (coloured) {
    const Eigen::Vector4d tint = interpolate(barycentrics.weights, triangle.colours);
    for (std::size_t c = 0; c < 4; ++c)
      albedo[c] *= static_cast<float>(tint[static_cast<Eigen::Index>(c)]);
  }
  if (triangle.batch->texture < 0) return albedo;
  const MipTexture& texture = textures_[static_cast<std::size_t>(triangle.batch->texture)];
  const Eigen::Vector2d uv = interpolate(barycentrics.weights, triangle.uvs);
  const Eigen::Array2d size(texture.width(), texture.height());
  const double across =
      (interpolate(barycentrics.perPixelX, triangle.uvs).array() * size).matrix().norm();
  const double down =
      (interpolate(barycentrics.perPixelY, triangle.uvs).array() * size).matrix().norm();
  const double level = std::log2(std::max({across, down, 1e-30}));
  const Texel texel = texture.sample(static_cast<float>(uv.x()), static_cast<float>(uv.y()),
                                     static_cast<float>(level));
  for (std::size_t c = 0; c < 4; ++c) albedo[c] *= texel[c];
  return albedo;
}

float Shading::sampleAlpha(const BatchTriangle& triangle, float u, float v) const {
  const TriangleBatch& batch = *triangle.batch;
  float alpha = batch.material->baseColour[3];
  const scene::Mesh& mesh = *batch.mesh;
  const std::uint32_t* corners = &mesh.indices[3 * std::size_t{triangle.triangle}];
  const std::array<float, 3> weights{1 - u - v, u, v};
  if (!mesh.colours.empty()) {
    float tint = 0;
    for (std::size_t i = 0; i < 3; ++i)
      tint += weights[i] * static_cast<float>(mesh.colours[corners[i]][3]) / 255;
    alpha *= tint;
  }
  if (batch.texture < 0 || mesh.uvs.size() != mesh.positions.size()) return alpha;
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();
  for (std::size_t i = 0; i < 3; ++i) uv += weights[i] * mesh.uvs[corners[i]];
  const MipTexture& texture = textures_[static_cast<std::size_t>(batch.texture)];
  return alpha * texture.sample(uv.x(), uv.y(), 0)[3];
}

Vec3 Shading::orientNormal(const ShadedTriangle& triangle, const std::array<double, 3>& weights,
                           const Vec3& toEye) const {
  const Vec3 flat =
      triangle.faceNormal.dot(toEye) < 0 ? Vec3(-triangle.faceNormal) : triangle.faceNormal;
  if (triangle.hasVertexNormals) {
    const Vec3 soft = interpolate(weights, triangle.vertexNormals);
    const double length = soft.norm();
    if (length > 0) return (soft.dot(flat) < 0 ? -1 : 1) / length * soft;
  }
  const double length = flat.norm();
  return length > 0 ? Vec3(flat / length) : toEye;
}

Vec3 Shading::computeNormal(const ShadedTriangle& triangle, double x, double y) const {
  const Vec3 toEye = -rays_.directionAt(x, y).normalized();
  return orientNormal(triangle, computeBarycentrics(triangle.weights, x, y).weights, toEye);
}

SurfaceColour Shading::shadeSurface(const ShadedTriangle& triangle, double x, double y, double z,
                                    float sunlit) const {
  const bool plan = rays_.parallel;
  const Vec3 direction = rays_.directionAt(x, y);
  const double length = direction.norm();
  const Vec3 toEye = -direction / length;
  const float distance = plan ? 0.0f : static_cast<float>(z * length);
  const Vec3 n = orientNormal(triangle, computeBarycentrics(triangle.weights, x, y).weights, toEye);
  const Texel albedo = this->computeAlbedo(triangle, x, y);
  const scene::Material& material = *triangle.batch->material;
  vec3 radiance =
      glsl::lit({albedo[0], albedo[1], albedo[2]}, toGlsl(n), toGlsl(toEye), distance,
                material.metallic, material.roughness, sunlit) +
      glsl::kGlow * vec3(material.emissive[0], material.emissive[1], material.emissive[2]);
  if (plan && !material.doubleSided) {
    // A plan cuts objects open; their interior is darker to emphasise cut walls.
    const bool mirrored = triangle.batch->worldFromMesh->linear().determinant() < 0;
    const bool behind = triangle.faceNormal.dot(toEye) < 0;
    if (behind != mirrored) radiance = radiance * glsl::kCutOpen;
  }
  if (!plan) radiance = glsl::inAir(radiance, distance);
  return {glsl::exposed(radiance), glsl::glassAlpha(albedo[3], toGlsl(n), toGlsl(toEye))};
}

glsl::vec3 Shading::shadeSky(double x, double y) const {
  if (rays_.parallel) return glsl::planPaper();
  return glsl::exposed(glsl::skyFor(toGlsl(rays_.directionAt(x, y).normalized())));
}

}  // namespace enfilade::render
