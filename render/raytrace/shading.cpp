#include "render/raytrace/shading.hpp"

#include <cmath>

#include "render/camera_basis.hpp"

namespace enfilade::render {
namespace glsl {
namespace {

#define LIGHT_TEXT(...) __VA_ARGS__
#include "render/shading.glsl.inc"
#undef LIGHT_TEXT

}  // namespace
}  // namespace glsl

namespace {

using glsl::vec3;

vec3 floats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Barycentric coordinates, and how they change to the next pixel on both axes.
struct Shares {
  std::array<double, 3> here, byX, byY;
};

Shares sharesAt(const Weights& weights, int x, int y) {
  const std::array<double, 3> w = weights.at(x, y);
  const auto& c = weights.corner;
  const double sum = w[0] + w[1] + w[2];
  const double sumX = c[0].dx + c[1].dx + c[2].dx, sumY = c[0].dy + c[1].dy + c[2].dy;
  Shares shares;
  for (std::size_t i = 0; i < 3; ++i) {
    // Within the triangle, though the exact ray may pass beside what Embree's floats met.
    shares.here[i] = sum != 0 ? std::clamp(w[i] / sum, 0.0, 1.0) : 1.0 / 3;
    shares.byX[i] = sum != 0 ? (c[i].dx - shares.here[i] * sumX) / sum : 0;
    shares.byY[i] = sum != 0 ? (c[i].dy - shares.here[i] * sumY) / sum : 0;
  }
  return shares;
}

template <class Value>
Value blended(const std::array<double, 3>& shares, const std::array<Value, 3>& corners) {
  return shares[0] * corners[0] + shares[1] * corners[1] + shares[2] * corners[2];
}

}  // namespace

Vec3 towardsSun() {
  const vec3& sun = glsl::kSunDirection;
  return Vec3(static_cast<double>(sun.x), static_cast<double>(sun.y), static_cast<double>(sun.z))
      .normalized();
}

ShadedTriangle::ShadedTriangle(const PieceTriangle& which, const PixelRays& rays)
    : piece(which.piece) {
  const SeenCorners corners = which.corners(rays.eye);
  depth = depthOf(corners, rays);
  weights = weightsOf(corners, rays);
  flatNormal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const scene::Mesh& mesh = *piece->mesh;
  soft = mesh.normals.size() == mesh.positions.size();
  const bool uv = mesh.uvs.size() == mesh.positions.size();
  // The rows of the cofactor matrix, as in the vertex shader.
  const Eigen::Matrix3d& m = piece->worldFromMesh->linear();
  const Vec3 x = m.row(0), y = m.row(1), z = m.row(2);
  const Vec3 rowX = y.cross(z), rowY = z.cross(x), rowZ = x.cross(y);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t corner = mesh.indices[3 * std::size_t{which.triangle} + i];
    if (soft) {
      const Vec3 n = mesh.normals[corner].cast<double>();
      softNormals[i] = {rowX.dot(n), rowY.dot(n), rowZ.dot(n)};
    }
    if (uv) uvs[i] = mesh.uvs[corner].cast<double>();
  }
}

Texel Shading::albedo(const ShadedTriangle& triangle, int x, int y) const {
  const float* base = triangle.piece->material->baseColour;
  Texel albedo{base[0], base[1], base[2], base[3]};
  if (triangle.piece->texture < 0) return albedo;
  const MipTexture& texture = textures_[static_cast<std::size_t>(triangle.piece->texture)];
  const Shares shares = sharesAt(triangle.weights, x, y);
  const Eigen::Vector2d uv = blended(shares.here, triangle.uvs);
  const Eigen::Array2d size(texture.width(), texture.height());
  const double across = (blended(shares.byX, triangle.uvs).array() * size).matrix().norm();
  const double down = (blended(shares.byY, triangle.uvs).array() * size).matrix().norm();
  const double level = std::log2(std::max({across, down, 1e-30}));
  const Texel texel =
      texture.at(static_cast<float>(uv.x()), static_cast<float>(uv.y()), static_cast<float>(level));
  for (std::size_t c = 0; c < 4; ++c) albedo[c] *= texel[c];
  return albedo;
}

float Shading::alphaAt(const PieceTriangle& triangle, float u, float v) const {
  const RayPiece& piece = *triangle.piece;
  const float alpha = piece.material->baseColour[3];
  const scene::Mesh& mesh = *piece.mesh;
  if (piece.texture < 0 || mesh.uvs.size() != mesh.positions.size()) return alpha;
  const auto corner = [&](std::size_t i) {
    return mesh.uvs[mesh.indices[3 * std::size_t{triangle.triangle} + i]];
  };
  const Eigen::Vector2f place = (1 - u - v) * corner(0) + u * corner(1) + v * corner(2);
  const MipTexture& texture = textures_[static_cast<std::size_t>(piece.texture)];
  return alpha * texture.at(place.x(), place.y(), 0)[3];
}

Vec3 Shading::facing(const ShadedTriangle& triangle, const std::array<double, 3>& shares,
                     const Vec3& toEye) const {
  const Vec3 flat =
      triangle.flatNormal.dot(toEye) < 0 ? Vec3(-triangle.flatNormal) : triangle.flatNormal;
  if (triangle.soft) {
    const Vec3 soft = blended(shares, triangle.softNormals);
    const double length = soft.norm();
    if (length > 0) return (soft.dot(flat) < 0 ? -1 : 1) / length * soft;
  }
  const double length = flat.norm();
  return length > 0 ? Vec3(flat / length) : toEye;
}

Vec3 Shading::normal(const ShadedTriangle& triangle, int x, int y) const {
  const Vec3 toEye = -rays_.directionAt(x, y).normalized();
  return facing(triangle, sharesAt(triangle.weights, x, y).here, toEye);
}

SurfaceColour Shading::colour(const ShadedTriangle& triangle, int x, int y, double z,
                              float sunlit) const {
  const bool plan = rays_.parallel;
  const Vec3 way = rays_.directionAt(x, y);
  const double length = way.norm();
  const Vec3 toEye = -way / length;
  const float distance = plan ? 0.0f : static_cast<float>(z * length);
  const Vec3 n = facing(triangle, sharesAt(triangle.weights, x, y).here, toEye);
  const Texel albedo = this->albedo(triangle, x, y);
  const MaterialData& material = *triangle.piece->material;
  vec3 radiance =
      glsl::lit({albedo[0], albedo[1], albedo[2]}, floats(n), floats(toEye), distance,
                material.surface[1], material.surface[2], sunlit) +
      glsl::kGlow * vec3(material.emissive[0], material.emissive[1], material.emissive[2]);
  if (plan && material.surface[3] < 0.5f) {
    // A plan cuts things open; their insides are darker, so that cut walls stand out.
    const bool mirrored = triangle.piece->worldFromMesh->linear().determinant() < 0;
    const bool behind = triangle.flatNormal.dot(toEye) < 0;
    if (behind != mirrored) radiance = radiance * glsl::kCutOpen;
  }
  if (!plan) radiance = glsl::inAir(radiance, distance);
  return {glsl::exposed(radiance), glsl::glassAlpha(albedo[3], floats(n), floats(toEye))};
}

glsl::vec3 Shading::sky(int x, int y) const {
  if (rays_.parallel) return glsl::planPaper();
  return glsl::exposed(glsl::skyFor(floats(rays_.directionAt(x, y).normalized())));
}

}  // namespace enfilade::render
