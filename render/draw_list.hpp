// Draw lists of items and their GPU data, independent of OpenGL.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/camera/camera.hpp"
#include "render/frame.hpp"
#include "scene/model/draw_items.hpp"
#include "scene/world/data/body_placement.hpp"

namespace enfilade::render {

using scene::BodyPlacement;
using scene::DrawItem;

/// A material's alpha mode, in drawing order.
using AlphaMode = scene::Material::Alpha;

/// A mesh's range in the index and vertex buffers.
struct MeshRange {
  std::uint32_t firstIndex = 0, indexCount = 0;
  std::int32_t baseVertex = 0;
  Vec3 centre = Vec3::Zero();  ///< mesh frame; origin of the positions in the buffer
};

/// A material in the layout of the shaders.
struct MaterialData {
  float baseColour[4];
  float emissive[4];  ///< w: set per instance
  float surface[4];   ///< alpha cutoff, metallic, roughness, 1 when double-sided
};

/// Per-instance vertex attributes (see Attribute).
struct Instance {
  float relativeFromMesh[12];  ///< three rows; result in metres relative to the eye, world axes
  MaterialData material;
  std::uint32_t id;
};

/// Layout of GL's DrawElementsIndirectCommand.
struct DrawCommand {
  std::uint32_t count, instanceCount, firstIndex;
  std::int32_t baseVertex;
  std::uint32_t baseInstance;
};

/// Consecutive commands with the same program, texture and coplanar rank.
struct Batch {
  AlphaMode alphaMode = AlphaMode::opaque;
  bool coloured = false;  ///< with vertex colours
  std::int32_t texture = -1;
  std::uint8_t coplanarRank = 0;
  std::uint32_t firstCommand = 0, commandCount = 0;
};

/// Instances, commands and batches of one draw.
struct DrawList {
  std::vector<Instance> instances;
  std::vector<DrawCommand> commands;
  std::vector<Batch> batches;
  bool unbatched = false;  ///< one draw call per command: Culling::none
};

MaterialData makeMaterialData(const scene::Material& material);
/// The mesh's material; a default material if the mesh has none.
MaterialData makeMaterialData(const scene::Model& model, const scene::Mesh& mesh);

/// The data to draw a scene; `ranges` and `materials` have one entry per mesh.
struct Drawable {
  const scene::Model& model;
  std::span<const DrawItem> items;
  const std::vector<MeshRange>& ranges;
  const std::vector<MaterialData>& materials;
};

/// An item's current world box. `bodies`: one entry per body of the model.
scene::Aabb computeItemAabb(const DrawItem& item, const std::vector<BodyPlacement>& bodies);

/// The surfaces to draw first and the transparent surfaces to blend over them.
struct DrawLists {
  DrawList surfaces, transparent;
};

/// Draw lists of the given items (ascending): surfaces in their order, transparent items from back
/// to front. With TransparencyMode::opaque, transparent items are among the surfaces.
DrawLists buildDrawLists(const Drawable& drawable, const std::vector<BodyPlacement>& bodies,
                         const Camera& camera, const FrameOptions& options,
                         const std::vector<std::uint32_t>& items);

/// One instance; `worldFromMesh` transforms the original mesh, not the mesh relative to its centre.
Instance makeInstance(const Eigen::Affine3d& worldFromMesh, const Vec3& meshCentre, const Vec3& eye,
                      const MaterialData& material, scene::EntityId id);

}  // namespace enfilade::render
