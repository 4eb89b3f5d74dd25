// Writes materials and textures of a model into a GLB file, each at its first use.
#pragma once

#include <map>

#include "scene/model/model.hpp"
#include "server/export/glb_file.hpp"

namespace enfilade::server {

class GlbMaterials {
 public:
  /// Without `withTextures` materials have only their colours.
  GlbMaterials(const scene::Model& model, GlbFile& file, bool withTextures);

  /// Whether primitives of this material need texture coordinates. `material`: an index into
  /// Model::materials; from its end on, the default material.
  bool isTextured(std::uint32_t material) const;
  /// The material's index in the file.
  std::size_t add(std::uint32_t material);

 private:
  const scene::Material& find(std::uint32_t material) const;
  std::size_t addTexture(std::size_t texture);

  const scene::Model& model_;
  GlbFile& file_;
  const bool withTextures_;
  const std::vector<std::uint32_t> equalTextures_;
  std::map<std::uint32_t, std::size_t> materials_;  ///< index in the file by index in the model
  std::map<std::size_t, std::size_t> textures_;     ///< the same
};

}  // namespace enfilade::server
