// A model's meshes and textures in device memory, uploaded once.
#pragma once

#include <vector>

#include "render/draw_list.hpp"
#include "render/gl/gl_objects.hpp"

namespace enfilade::render {

/// Device buffers of a model.
struct SceneBuffers {
  GlBuffer vertices;
  GlBuffer indices;
  GlBuffer colours;                     ///< of the first vertices: those of meshes with colours
  std::vector<MeshRange> ranges;        ///< one per mesh
  std::vector<MaterialData> materials;  ///< one per mesh
  std::vector<GlTexture> textures;      ///< one per texture of the model
};

/// Needs a current context. Throws RenderError on GL errors and for too large models.
SceneBuffers uploadModel(const scene::Model& model);

}  // namespace enfilade::render
