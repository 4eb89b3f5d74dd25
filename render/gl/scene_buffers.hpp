// A model's meshes and textures in the device's memory, uploaded once.
#pragma once

#include <vector>

#include "render/draw_list.hpp"
#include "render/gl/gl_objects.hpp"

namespace enfilade::render {

struct ModelBuffers {
  GlBuffer vertices;
  GlBuffer indices;
  std::vector<MeshRange> ranges;        ///< one a mesh
  std::vector<MaterialData> materials;  ///< one a mesh
  std::vector<GlTexture> textures;      ///< one a texture of the model
};

/// Needs a current context. Throws RenderError when the device refuses.
ModelBuffers uploadModel(const scene::Model& model);

}  // namespace enfilade::render
