// The vertex layout of all meshes, static meshes and avatars: 24 bytes.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

namespace enfilade::render {

struct Vertex {
  float position[3];
  std::uint32_t normal;  ///< GL_INT_2_10_10_10_REV; the top two bits are 0 without a normal
  float uv[2];
};

inline std::uint32_t packNormal(const Eigen::Vector3f& normal) {
  const auto bits = [](float value) {
    const float scaled = std::clamp(value, -1.0f, 1.0f) * 511.0f;
    const auto rounded = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5f : 0.5f));
    return static_cast<std::uint32_t>(rounded) & 0x3FFu;
  };
  return bits(normal.x()) | (bits(normal.y()) << 10) | (bits(normal.z()) << 20) | (1u << 30);
}

}  // namespace enfilade::render
