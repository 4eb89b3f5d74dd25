// Which parts of the model a picture needs, in which order, with what data. Knows no GL.
#pragma once

#include <cstdint>
#include <vector>

#include "render/camera_basis.hpp"
#include "render/frame.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::render {

enum class Pass : std::uint8_t { opaque, mask, blend };

/// Where a mesh lies in the index and vertex buffers.
struct MeshRange {
  std::uint32_t firstIndex = 0, indexCount = 0;
  std::int32_t baseVertex = 0;
  Vec3 centre = Vec3::Zero();  ///< mesh frame; the buffer's positions are relative to it
};

/// A material as the shaders want it.
struct MaterialData {
  float baseColour[4];
  float emissive[4];  ///< w: set for each instance
  float surface[4];   ///< alpha cutoff, metallic, roughness, 1 when double-sided
};

/// Of Part::body: of no body.
inline constexpr std::uint32_t kStill = 0xFFFF'FFFFu;

/// One mesh of one object.
struct Part {
  scene::Box box;  ///< world, as authored
  std::uint32_t object = 0, mesh = 0;
  std::int32_t texture = -1;
  Pass pass = Pass::opaque;
  std::uint32_t body = kStill;  ///< index into Model::bodies
};

/// Where a body is drawn: sceneFromAuthored takes a point of the model to where the body has it.
struct BodyPlacement {
  bool displaced = false;  ///< else it is drawn as the model has it
  Eigen::Affine3d sceneFromAuthored = Eigen::Affine3d::Identity();
};

/// What the vertex shader gets for each instance (see Attribute).
struct Instance {
  float relativeFromMesh[12];  ///< three rows; to metres relative to the eye, world axes
  MaterialData material;
  std::uint32_t id;
};

/// As GL's DrawElementsIndirectCommand.
struct DrawCommand {
  std::uint32_t count, instanceCount, firstIndex;
  std::int32_t baseVertex;
  std::uint32_t baseInstance;
};

/// Consecutive commands that share program and texture.
struct Batch {
  Pass pass = Pass::opaque;
  std::int32_t texture = -1;
  std::uint32_t firstCommand = 0, commandCount = 0;
};

struct DrawList {
  std::vector<Instance> instances;
  std::vector<DrawCommand> commands;
  std::vector<Batch> batches;
  bool singly = false;  ///< each command is a call of its own: Culling::singly
};

MaterialData materialData(const scene::Material& material);
/// Of the mesh's material; a plain one when it names none.
MaterialData materialData(const scene::Model& model, const scene::Mesh& mesh);

/// Of all bodies of the scene.
std::vector<BodyPlacement> placementsOf(const scene::Scene& scene, const scene::Snapshot& snapshot);

/// All parts of the model but those of triggers and of what is only solid, in the order in which
/// they are drawn: by pass, texture, object. The order never depends on the camera, so that ties of
/// depth fall the same way in every picture.
std::vector<Part> partsOf(const scene::Model& model);

/// What a scene is drawn from; `ranges` and `materials` have one entry a mesh.
struct Drawable {
  const scene::Model& model;
  const std::vector<Part>& parts;
  const std::vector<MeshRange>& ranges;
  const std::vector<MaterialData>& materials;
};

/// Where a part is in this picture. `bodies`: one entry a body of the model.
scene::Box placedBox(const Part& part, const std::vector<BodyPlacement>& bodies);

/// Indices of the parts that may lie in the picture, ascending.
std::vector<std::uint32_t> partsInPicture(const std::vector<Part>& parts,
                                          const std::vector<BodyPlacement>& bodies,
                                          const Camera& camera, scene::EntityId hidden);

/// What is drawn first, and glass that is drawn over it.
struct DrawLists {
  DrawList surfaces, glass;
};

/// Of the parts given (ascending): surfaces in their order, glass from back to front, or among the
/// surfaces where it is solid.
DrawLists drawLists(const Drawable& drawable, const std::vector<BodyPlacement>& bodies,
                    const Camera& camera, const FrameOptions& options,
                    const std::vector<std::uint32_t>& parts);

/// One instance; `worldFromMesh` is of the mesh as given, not of its centre.
Instance placed(const Eigen::Affine3d& worldFromMesh, const Vec3& meshCentre, const Vec3& eye,
                const MaterialData& material, scene::EntityId id);

}  // namespace enfilade::render
