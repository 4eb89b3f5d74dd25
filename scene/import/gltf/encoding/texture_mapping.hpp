// The texture coordinates that a glTF material uses. Private to the import.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace enfilade::scene {

/// The set of coordinates that a base colour texture takes, and its KHR_texture_transform.
struct TextureMapping {
  bool isTextured = false;  ///< whether the material has such a texture
  std::size_t set = 0;
  double offset[2] = {0, 0}, scale[2] = {1, 1}, rotation = 0;  // NOLINT: plain data

  bool isIdentity() const;
  /// Equal for equal mappings.
  std::string makeKey() const;
  /// Transforms pairs of coordinates.
  void apply(std::span<float> uvs) const;
};

/// The mapping of the material's base colour texture.
TextureMapping readTextureMapping(const nlohmann::json& gltf, std::size_t material);

}  // namespace enfilade::scene
