#include "server/export/scene_glb.hpp"

#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "protocol/recording/recording.hpp"
#include "server/export/draw_groups.hpp"
#include "server/export/glb_file.hpp"
#include "server/export/glb_materials.hpp"
#include "server/export/primitive_data.hpp"

namespace enfilade::server {
namespace {

using scene::Vec3;

constexpr std::size_t kMaxEntities = std::size_t{1} << 24;  // floats hold all integers below
constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

GlbJson toArray(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

constexpr std::size_t kMaxMergedBytes = std::size_t{1} << 30;

std::uint32_t toEntityId(std::uint32_t object) {
  return object + 1;
}

class SceneWriter {
 public:
  SceneWriter(const scene::Scene& scene, const GlbContent& content)
      : scene_(scene),
        model_(scene.model()),
        content_(content),
        equalMaterials_(findEqualMaterials(model_)) {}

  SceneGlb write() {
    const DrawGroups groups = makeDrawGroups(model_);
    requireWritable(groups);
    for (const MeshBatch& batch : groups.batches) addBatch(batch);
    for (const InstanceGroup& group : groups.instanced) addInstances(group);
    if (content_.bodies)
      for (const std::uint32_t body : groups.bodies) addBody(body);
    if (!groups.instanced.empty()) {
      file_.root["extensionsUsed"] = {kInstancing};
      // A viewer that ignored the extension would draw one instance in the wrong place.
      file_.root["extensionsRequired"] = {kInstancing};
    }
    GlbJson scene{{"extras", makeSceneExtras()}};
    if (!topNodes_.empty()) scene["nodes"] = topNodes_;
    file_.root["scene"] = 0;
    file_.add("scenes", std::move(scene));
    result_.entities = model_.objects.size();
    result_.bytes = file_.finish();
    return std::move(result_);
  }

 private:
  void requireWritable(const DrawGroups& groups) const;
  void addBatch(const MeshBatch& batch);
  void addInstances(const InstanceGroup& group);
  void addBody(std::uint32_t body);
  std::size_t addBodyObject(std::uint32_t object, const Vec3& bodyOrigin);
  PrimitiveData makeData(std::uint32_t material, bool hasNormals, bool hasColours) const;
  PrimitiveData makeData(std::uint32_t material, const scene::Mesh& mesh) const;
  GlbJson addPrimitive(const PrimitiveData& data, std::uint32_t material);
  GlbJson sharePrimitive(std::uint32_t mesh);
  std::size_t shareMesh(const std::vector<std::uint32_t>& meshes);
  std::size_t addBakedMesh(const std::vector<std::uint32_t>& meshes,
                           const Eigen::Affine3d& transform);
  GlbJson makeEntity(std::uint32_t object) const;
  GlbJson makeSceneExtras() const;
  void count(const std::vector<std::uint32_t>& meshes, std::size_t instances);

  const scene::Scene& scene_;
  const scene::Model& model_;
  const GlbContent content_;
  const std::vector<std::uint32_t> equalMaterials_;
  GlbFile file_;
  GlbMaterials materials_{model_, file_, content_.textures};
  std::vector<std::size_t> topNodes_;
  std::map<std::uint32_t, GlbJson> primitives_;               ///< by index of the model's mesh
  std::map<std::vector<std::uint32_t>, std::size_t> meshes_;  ///< index in the file
  SceneGlb result_;
};

PrimitiveData SceneWriter::makeData(std::uint32_t material, bool hasNormals,
                                    bool hasColours) const {
  PrimitiveData data;
  data.hasColours = hasColours;
  data.hasNormals = hasNormals;
  data.hasUvs = materials_.isTextured(material);
  return data;
}

PrimitiveData SceneWriter::makeData(std::uint32_t material, const scene::Mesh& mesh) const {
  return makeData(material, mesh.normals.size() == mesh.positions.size(), !mesh.colours.empty());
}

GlbJson SceneWriter::addPrimitive(const PrimitiveData& data, std::uint32_t material) {
  GlbJson attributes{{"POSITION", file_.addPositions(data.positions)}};
  if (data.hasNormals)
    attributes["NORMAL"] = file_.addFloats(data.normals, "VEC3", GlbTarget::vertices);
  if (data.hasUvs)
    attributes["TEXCOORD_0"] = file_.addFloats(data.uvs, "VEC2", GlbTarget::vertices);
  if (data.hasColours) attributes["COLOR_0"] = file_.addColours(data.colours);
  if (!data.entities.empty())
    attributes["_ENTITY_ID"] = file_.addFloats(data.entities, "SCALAR", GlbTarget::vertices);
  return {{"attributes", std::move(attributes)},
          {"indices", file_.addIndices(data.indices, data.vertexCount())},
          {"material", materials_.add(material)}};
}

// ---- static objects -----------------------------------------------------------------------------

/// Merging repeats the vertices of a mesh for each of its uses: a small model may become a large
/// file. Refuses it before the memory is needed.
void SceneWriter::requireWritable(const DrawGroups& groups) const {
  constexpr std::size_t kVertexBytes = (3 + 3 + 2 + 1) * sizeof(float);
  constexpr std::size_t kColourBytes = 4 * sizeof(std::uint16_t);
  std::size_t bytes = 0;
  for (const MeshBatch& batch : groups.batches)
    for (const MeshUse& use : batch.uses) {
      const scene::Mesh& mesh = model_.meshes[use.mesh];
      bytes += mesh.positions.size() * kVertexBytes + mesh.colours.size() * kColourBytes +
               mesh.indices.size() * sizeof(std::uint32_t);
    }
  if (bytes > kMaxMergedBytes)
    throw std::runtime_error("the merged meshes need " + std::to_string(bytes >> 20) +
                             " MiB, more than the limit of " +
                             std::to_string(kMaxMergedBytes >> 20) + " MiB");
}

void SceneWriter::addBatch(const MeshBatch& batch) {
  PrimitiveData data = makeData(batch.material, batch.hasNormals, batch.hasColours);
  std::vector<std::uint32_t> entities;
  std::vector<std::size_t> triangles;
  for (const MeshUse& use : batch.uses) {
    const scene::Mesh& mesh = model_.meshes[use.mesh];
    appendTransformed(data, mesh, model_.objects[use.object].worldFromMesh);
    const std::uint32_t id = toEntityId(use.object);
    data.entities.resize(data.vertexCount(), static_cast<float>(id));
    if (entities.empty() || entities.back() != id) {
      entities.push_back(id);
      triangles.push_back(0);
    }
    triangles.back() += mesh.triangleCount();
    result_.triangles += mesh.triangleCount();
  }
  ++result_.drawGroups;
  GlbJson primitive = addPrimitive(data, batch.material);
  const std::size_t mesh = file_.add("meshes", {{"primitives", {std::move(primitive)}}});
  const std::string name =
      batch.material < model_.materials.size() ? model_.materials[batch.material].name : "";
  topNodes_.push_back(file_.add(
      "nodes", {{"name", name.empty() ? "merged" : name},
                {"mesh", mesh},
                {"extras", {{"entities", entities}, {"triangles", std::move(triangles)}}}}));
}

void SceneWriter::addInstances(const InstanceGroup& group) {
  std::vector<float> translations, rotations, scales, ids;
  std::vector<std::uint32_t> entities;
  for (std::size_t i = 0; i < group.objects.size(); ++i) {
    const TrsTransform& transform = group.transforms[i];
    for (int axis = 0; axis < 3; ++axis) {
      translations.push_back(static_cast<float>(transform.translation[axis]));
      scales.push_back(static_cast<float>(transform.scale[axis]));
    }
    for (const double part : transform.rotation.coeffs())  // x, y, z, w, as in glTF
      rotations.push_back(static_cast<float>(part));
    entities.push_back(toEntityId(group.objects[i]));
    ids.push_back(static_cast<float>(entities.back()));
  }
  const GlbJson attributes{{"TRANSLATION", file_.addFloats(translations, "VEC3", GlbTarget::other)},
                           {"ROTATION", file_.addFloats(rotations, "VEC4", GlbTarget::other)},
                           {"SCALE", file_.addFloats(scales, "VEC3", GlbTarget::other)},
                           {"_ENTITY_ID", file_.addFloats(ids, "SCALAR", GlbTarget::other)}};
  count(group.meshes, group.objects.size());
  topNodes_.push_back(
      file_.add("nodes", {{"name", model_.objects[group.objects.front()].path},
                          {"mesh", shareMesh(group.meshes)},
                          {"extensions", {{kInstancing, {{"attributes", attributes}}}}},
                          {"extras", {{"entities", std::move(entities)}}}}));
}

/// The model's mesh as a primitive that several meshes of the file may refer to.
GlbJson SceneWriter::sharePrimitive(std::uint32_t index) {
  const auto found = primitives_.find(index);
  if (found != primitives_.end()) return found->second;
  const scene::Mesh& mesh = model_.meshes[index];
  const std::uint32_t material = findMaterial(mesh, equalMaterials_);
  PrimitiveData data = makeData(material, mesh);
  appendMesh(data, mesh);
  return primitives_[index] = addPrimitive(data, material);
}

std::size_t SceneWriter::shareMesh(const std::vector<std::uint32_t>& meshes) {
  const auto found = meshes_.find(meshes);
  if (found != meshes_.end()) return found->second;
  GlbJson primitives = GlbJson::array();
  for (const std::uint32_t mesh : meshes) primitives.push_back(sharePrimitive(mesh));
  return meshes_[meshes] = file_.add("meshes", {{"primitives", std::move(primitives)}});
}

void SceneWriter::count(const std::vector<std::uint32_t>& meshes, std::size_t instances) {
  result_.drawGroups += meshes.size();
  for (const std::uint32_t mesh : meshes)
    result_.triangles += instances * model_.meshes[mesh].triangleCount();
}

// ---- bodies -------------------------------------------------------------------------------------

void SceneWriter::addBody(std::uint32_t index) {
  const scene::BodySpec& body = model_.bodies[index];
  const Vec3 origin = scene_.bodyShape(index)->origin;
  std::vector<std::size_t> children;
  for (const std::uint32_t object : body.objects) {
    if (model_.objects[object].usage != scene::Object::Usage::collisionOnly)
      children.push_back(addBodyObject(object, origin));
  }
  GlbJson node{{"name", body.name}, {"translation", toArray(origin)}};
  if (!children.empty()) node["children"] = std::move(children);
  node["extras"] = {{"body", body.name},
                    {"entity", toEntityId(body.objects.front())},
                    {"kind", toString(body.kind)}};
  topNodes_.push_back(file_.add("nodes", std::move(node)));
}

std::size_t SceneWriter::addBodyObject(std::uint32_t index, const Vec3& bodyOrigin) {
  const scene::Object& object = model_.objects[index];
  GlbJson node{{"name", object.path}, {"extras", {{"entity", toEntityId(index)}}}};
  std::vector<std::uint32_t> meshes;
  for (const std::uint32_t mesh : object.meshes)
    if (model_.meshes[mesh].triangleCount() > 0) meshes.push_back(mesh);
  if (meshes.empty()) return file_.add("nodes", std::move(node));
  count(meshes, 1);
  const Eigen::Affine3d bodyFromMesh = Eigen::Translation3d(-bodyOrigin) * object.worldFromMesh;
  if (const auto transform = decomposeTrs(bodyFromMesh)) {
    const auto& q = transform->rotation;
    node["translation"] = toArray(transform->translation);
    node["rotation"] = {q.x(), q.y(), q.z(), q.w()};
    node["scale"] = toArray(transform->scale);
    node["mesh"] = shareMesh(meshes);
  } else {
    node["mesh"] = addBakedMesh(meshes, bodyFromMesh);
  }
  return file_.add("nodes", std::move(node));
}

/// For transforms that a node cannot have.
std::size_t SceneWriter::addBakedMesh(const std::vector<std::uint32_t>& meshes,
                                      const Eigen::Affine3d& transform) {
  GlbJson primitives = GlbJson::array();
  for (const std::uint32_t index : meshes) {
    const scene::Mesh& mesh = model_.meshes[index];
    const std::uint32_t material = findMaterial(mesh, equalMaterials_);
    PrimitiveData data = makeData(material, mesh);
    appendTransformed(data, mesh, transform);
    primitives.push_back(addPrimitive(data, material));
  }
  return file_.add("meshes", {{"primitives", std::move(primitives)}});
}

// ---- extras -------------------------------------------------------------------------------------

GlbJson SceneWriter::makeEntity(std::uint32_t index) const {
  const scene::Object& object = model_.objects[index];
  GlbJson entity{{"id", toEntityId(index)}, {"path", object.path}};
  if (!object.globalId.empty()) entity["globalId"] = object.globalId;
  if (!object.ifcClass.empty()) entity["class"] = object.ifcClass;
  if (!object.operationType.empty()) entity["operation"] = object.operationType;
  if (object.storey) entity["storey"] = model_.storeys[*object.storey].name;
  if (object.partOf) entity["partOf"] = toEntityId(*object.partOf);
  if (const auto rank = scene_.coplanarRanks()[index].rank; rank > 0) entity["coplanarRank"] = rank;
  if (object.usage != scene::Object::Usage::both)
    entity["only"] = object.usage == scene::Object::Usage::visualOnly ? "drawn" : "solid";
  return entity;
}

GlbJson SceneWriter::makeSceneExtras() const {
  if (model_.objects.size() >= kMaxEntities)
    throw std::runtime_error("the scene has " + std::to_string(model_.objects.size()) +
                             " objects, and a GLB file holds ids below 16777216: split the model");
  GlbJson entities = GlbJson::array();
  for (std::uint32_t i = 0; i < model_.objects.size(); ++i) entities.push_back(makeEntity(i));
  for (const scene::BodySpec& body : model_.bodies)
    for (const std::uint32_t object : body.objects) entities[object]["body"] = body.name;
  GlbJson storeys = GlbJson::array(), spaces = GlbJson::array();
  for (const scene::Storey& storey : model_.storeys)
    storeys.push_back(
        {{"name", storey.name}, {"elevation", storey.elevation}, {"globalId", storey.globalId}});
  for (const scene::Space& space : model_.spaces)
    if (!space.box.empty())
      spaces.push_back({{"name", space.name},
                        {"longName", space.longName},
                        {"globalId", space.globalId},
                        {"min", toArray(space.box.min)},
                        {"max", toArray(space.box.max)}});
  return {{"sceneHash", protocol::toHex(scene_.hash())},
          {"offset", toArray(model_.offset)},
          {"storeys", storeys},
          {"spaces", spaces},
          {"entities", entities}};
}

}  // namespace

SceneGlb writeSceneGlb(const scene::Scene& scene, const GlbContent& content) {
  return SceneWriter(scene, content).write();
}

}  // namespace enfilade::server
