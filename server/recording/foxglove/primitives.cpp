#include "server/recording/foxglove/primitives.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "scene/model/srgb.hpp"

namespace enfilade::server {
namespace {

const Eigen::Vector3f kAvatarColour{0.85f, 0.4f, 0.1f};
constexpr double kNameHeight = 0.12;  // metres, font size of the name above an avatar

template <class Message>
Message toXyz(const scene::Vec3& v) {
  Message message;
  message.set_x(v.x());
  message.set_y(v.y());
  message.set_z(v.z());
  return message;
}

foxglove::Color toFoxgloveColour(const scene::Material& material) {
  const Eigen::Vector4f& base = material.baseColour;
  const auto encode = [](float linear) { return static_cast<float>(scene::linearToSrgb(linear)); };
  const bool isTransparent = material.alpha == scene::Material::Alpha::blend;
  return server::makeColour(Eigen::Vector3f(encode(base[0]), encode(base[1]), encode(base[2])),
                            isTransparent ? static_cast<double>(base[3]) : 1.0);
}

/// The colours of a mesh's vertices, times its material's.
void addVertexColours(foxglove::TriangleListPrimitive& into, const scene::Mesh& mesh,
                      scene::Material material) {
  const Eigen::Vector4f base = material.baseColour;
  for (const scene::VertexColour& colour : mesh.colours) {
    for (int c = 0; c < 3; ++c)
      material.baseColour[c] =
          base[c] * scene::srgbByteToLinear(colour[static_cast<std::size_t>(c)]);
    material.baseColour[3] = base[3] * static_cast<float>(colour[3]) / 255;
    *into.add_colors() = toFoxgloveColour(material);
  }
}

/// Appends an object's mesh, relative to `origin`.
void addMesh(foxglove::TriangleListPrimitive& into, const scene::Object& object,
             const scene::Mesh& mesh, const scene::Vec3& origin) {
  const auto first = static_cast<std::uint32_t>(into.points_size());
  for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex)
    *into.add_points() =
        toXyz<foxglove::Point3>(scene::computeWorldPosition(object, mesh, vertex) - origin);
  for (const std::uint32_t index : mesh.indices) into.add_indices(first + index);
}

/// Adds the objects' triangles, one list per material; meshes with vertex colours apart.
void addObjects(foxglove::SceneEntity& entity, const scene::Model& model,
                const std::vector<std::uint32_t>& objects, const scene::Vec3& origin) {
  std::map<std::pair<std::uint32_t, bool>, foxglove::TriangleListPrimitive*> lists;
  for (const std::uint32_t index : objects) {
    const scene::Object& object = model.objects[index];
    for (const std::uint32_t number : object.meshes) {
      const scene::Mesh& mesh = model.meshes[number];
      const scene::Material& material = model.materials[mesh.material];
      auto& list = lists[{mesh.material, !mesh.colours.empty()}];
      if (!list) {
        list = entity.add_triangles();
        *list->mutable_color() = toFoxgloveColour(material);
      }
      addVertexColours(*list, mesh, material);
      addMesh(*list, object, mesh, origin);
    }
  }
}

std::vector<std::uint32_t> findStaticObjects(const scene::Model& model) {
  std::vector<bool> isMoving(model.objects.size());
  for (const scene::BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) isMoving[object] = true;
  std::vector<std::uint32_t> staticObjects;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    if (!isMoving[i] && model.objects[i].usage != scene::Object::Usage::collisionOnly)
      staticObjects.push_back(i);
  return staticObjects;
}

std::size_t countTriangles(const scene::Model& model, const std::vector<std::uint32_t>& objects) {
  std::size_t triangles = 0;
  for (const std::uint32_t object : objects)
    for (const std::uint32_t mesh : model.objects[object].meshes)
      triangles += model.meshes[mesh].triangleCount();
  return triangles;
}

void addHull(foxglove::TriangleListPrimitive& into, const scene::AvatarPart& part) {
  const auto first = static_cast<std::uint32_t>(into.points_size());
  for (const scene::Vec3& vertex : part.hull->vertices)
    *into.add_points() = toXyz<foxglove::Point3>(part.rotation * vertex + part.offset);
  for (const auto& face : part.hull->faces)
    for (std::size_t corner = 2; corner < face.size(); ++corner)
      for (const std::uint32_t vertex : {face[0], face[corner - 1], face[corner]})
        into.add_indices(first + vertex);
}

}  // namespace

google::protobuf::Timestamp toTimestamp(double seconds) {
  google::protobuf::Timestamp stamp;
  const auto nanoseconds = static_cast<std::int64_t>(std::llround(seconds * 1e9));
  stamp.set_seconds(nanoseconds / 1'000'000'000);
  stamp.set_nanos(static_cast<std::int32_t>(nanoseconds % 1'000'000'000));
  return stamp;
}

foxglove::Vector3 toVector(const scene::Vec3& v) {
  return toXyz<foxglove::Vector3>(v);
}

foxglove::Quaternion toQuaternion(const Eigen::Quaterniond& q) {
  foxglove::Quaternion message;
  message.set_x(q.x());
  message.set_y(q.y());
  message.set_z(q.z());
  message.set_w(q.w());
  return message;
}

foxglove::Color makeColour(const Eigen::Vector3f& rgb, double alpha) {
  foxglove::Color colour;
  colour.set_r(static_cast<double>(rgb.x()));
  colour.set_g(static_cast<double>(rgb.y()));
  colour.set_b(static_cast<double>(rgb.z()));
  colour.set_a(alpha);
  return colour;
}

Eigen::Quaterniond convertYUpToZUp() {
  const double half = std::sqrt(0.5);
  return {half, half, 0, 0};  // 90 degrees about X
}

foxglove::CubePrimitive makeCube(const scene::Aabb& box, const foxglove::Color& colour) {
  foxglove::CubePrimitive cube;
  *cube.mutable_pose()->mutable_position() = toVector((box.min + box.max) / 2);
  *cube.mutable_pose()->mutable_orientation() = toQuaternion(Eigen::Quaterniond::Identity());
  *cube.mutable_size() = toVector(box.max - box.min);
  *cube.mutable_color() = colour;
  return cube;
}

foxglove::SceneEntity makeStaticEntity(const scene::Scene& scene, std::size_t maxTriangles,
                                       std::size_t maxBoxes) {
  const std::vector<std::uint32_t> staticObjects = findStaticObjects(scene.model());
  const foxglove::Color pale = makeColour(Eigen::Vector3f::Constant(0.7f), 0.25);
  foxglove::SceneEntity entity;
  entity.set_id("still");
  entity.set_frame_id("scene");
  if (countTriangles(scene.model(), staticObjects) <= maxTriangles) {
    addObjects(entity, scene.model(), staticObjects, scene::Vec3::Zero());
  } else if (scene.staticBoxes().size() <= maxBoxes) {
    for (const scene::Aabb& box : scene.staticBoxes()) *entity.add_cubes() = makeCube(box, pale);
  } else {
    *entity.add_cubes() = makeCube(scene.bounds(), pale);
  }
  return entity;
}

foxglove::SceneEntity makeModelEntity(std::span<const std::uint8_t> glb) {
  foxglove::SceneEntity entity;
  entity.set_id("still");
  entity.set_frame_id("map");  // viewers rotate glTF to Z up, the convention of this frame
  entity.set_frame_locked(true);
  foxglove::ModelPrimitive& model = *entity.add_models();
  *model.mutable_pose()->mutable_position() = toVector(scene::Vec3::Zero());
  *model.mutable_pose()->mutable_orientation() = toQuaternion(Eigen::Quaterniond::Identity());
  *model.mutable_scale() = toVector(scene::Vec3::Ones());
  model.set_media_type("model/gltf-binary");
  model.set_data(glb.data(), glb.size());
  return entity;
}

foxglove::SceneEntity makeBodyEntity(const scene::Scene& scene, std::size_t body) {
  const scene::BodySpec& spec = scene.model().bodies[body];
  foxglove::SceneEntity entity;
  entity.set_id("body/" + spec.name);
  entity.set_frame_id("body/" + spec.name);
  entity.set_frame_locked(true);
  addObjects(entity, scene.model(), spec.objects, scene.bodyShape(body)->origin);
  return entity;
}

foxglove::SceneEntity makeAvatarEntity(const scene::AvatarSnapshot& avatar) {
  foxglove::SceneEntity entity;
  entity.set_id("avatar/" + avatar.name);
  entity.set_frame_id("avatar/" + avatar.name);
  entity.set_frame_locked(true);
  foxglove::TriangleListPrimitive& body = *entity.add_triangles();
  *body.mutable_color() = makeColour(kAvatarColour);
  for (const scene::AvatarPart& part : avatar.shape->parts) addHull(body, part);
  foxglove::TextPrimitive& name = *entity.add_texts();
  *name.mutable_pose()->mutable_position() =
      toVector({0, avatar.shape->box.max.y() + kNameHeight, 0});
  *name.mutable_pose()->mutable_orientation() = toQuaternion(Eigen::Quaterniond::Identity());
  name.set_billboard(true);
  name.set_font_size(kNameHeight);
  *name.mutable_color() = makeColour(kAvatarColour);
  name.set_text(avatar.name);
  return entity;
}

}  // namespace enfilade::server
