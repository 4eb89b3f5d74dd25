#include "server/recording/foxglove/primitives.hpp"

#include <cmath>
#include <map>

namespace enfilade::server {
namespace {

const Eigen::Vector3f kAvatarColour{0.85f, 0.4f, 0.1f};
constexpr double kNameHeight = 0.12;  // metres, of the letters above an avatar

foxglove::Point3 pointOf(const scene::Vec3& v) {
  foxglove::Point3 point;
  point.set_x(v.x());
  point.set_y(v.y());
  point.set_z(v.z());
  return point;
}

/// Linear as materials have it, sRGB as viewers want it.
float encoded(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

foxglove::Color colourOf(const scene::Material& material) {
  const Eigen::Vector4f& base = material.baseColour;
  const bool seenThrough = material.alpha == scene::Material::Alpha::blend;
  return server::colourOf(Eigen::Vector3f(encoded(base[0]), encoded(base[1]), encoded(base[2])),
                          seenThrough ? static_cast<double>(base[3]) : 1.0);
}

/// Adds a mesh of an object, less `origin`.
void addMesh(foxglove::TriangleListPrimitive& into, const scene::Object& object,
             const scene::Mesh& mesh, const scene::Vec3& origin) {
  const auto first = static_cast<std::uint32_t>(into.points_size());
  for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex)
    *into.add_points() = pointOf(scene::worldPosition(object, mesh, vertex) - origin);
  for (const std::uint32_t index : mesh.indices) into.add_indices(first + index);
}

/// The objects' triangles, those of one material in one list.
void addObjects(foxglove::SceneEntity& entity, const scene::Model& model,
                const std::vector<std::uint32_t>& objects, const scene::Vec3& origin) {
  std::map<std::uint32_t, foxglove::TriangleListPrimitive*> lists;
  for (const std::uint32_t index : objects) {
    const scene::Object& object = model.objects[index];
    for (const std::uint32_t number : object.meshes) {
      const scene::Mesh& mesh = model.meshes[number];
      auto& list = lists[mesh.material];
      if (!list) {
        list = entity.add_triangles();
        *list->mutable_color() = colourOf(model.materials[mesh.material]);
      }
      addMesh(*list, object, mesh, origin);
    }
  }
}

std::vector<std::uint32_t> stillObjects(const scene::Model& model) {
  std::vector<bool> moves(model.objects.size());
  for (const scene::BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) moves[object] = true;
  std::vector<std::uint32_t> still;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    if (!moves[i] && model.objects[i].use != scene::Object::Use::solid) still.push_back(i);
  return still;
}

std::size_t trianglesOf(const scene::Model& model, const std::vector<std::uint32_t>& objects) {
  std::size_t triangles = 0;
  for (const std::uint32_t object : objects)
    for (const std::uint32_t mesh : model.objects[object].meshes)
      triangles += model.meshes[mesh].indices.size() / 3;
  return triangles;
}

void addHull(foxglove::TriangleListPrimitive& into, const scene::AvatarPart& part) {
  const auto first = static_cast<std::uint32_t>(into.points_size());
  for (const scene::Vec3& vertex : part.hull->vertices)
    *into.add_points() = pointOf(part.rotation * vertex + part.offset);
  for (const auto& face : part.hull->faces)
    for (std::size_t corner = 2; corner < face.size(); ++corner)
      for (const std::uint32_t vertex : {face[0], face[corner - 1], face[corner]})
        into.add_indices(first + vertex);
}

}  // namespace

google::protobuf::Timestamp timestampOf(double seconds) {
  google::protobuf::Timestamp stamp;
  const auto nanoseconds = static_cast<std::int64_t>(std::llround(seconds * 1e9));
  stamp.set_seconds(nanoseconds / 1'000'000'000);
  stamp.set_nanos(static_cast<std::int32_t>(nanoseconds % 1'000'000'000));
  return stamp;
}

foxglove::Vector3 vectorOf(const scene::Vec3& v) {
  foxglove::Vector3 message;
  message.set_x(v.x());
  message.set_y(v.y());
  message.set_z(v.z());
  return message;
}

foxglove::Quaternion quaternionOf(const Eigen::Quaterniond& q) {
  foxglove::Quaternion message;
  message.set_x(q.x());
  message.set_y(q.y());
  message.set_z(q.z());
  message.set_w(q.w());
  return message;
}

foxglove::Color colourOf(const Eigen::Vector3f& rgb, double alpha) {
  foxglove::Color colour;
  colour.set_r(static_cast<double>(rgb.x()));
  colour.set_g(static_cast<double>(rgb.y()));
  colour.set_b(static_cast<double>(rgb.z()));
  colour.set_a(alpha);
  return colour;
}

Eigen::Quaterniond upright() {
  const double half = std::sqrt(0.5);
  return {half, half, 0, 0};  // a quarter turn about X
}

foxglove::CubePrimitive cubeOf(const scene::Box& box, const foxglove::Color& colour) {
  foxglove::CubePrimitive cube;
  *cube.mutable_pose()->mutable_position() = vectorOf((box.min + box.max) / 2);
  *cube.mutable_pose()->mutable_orientation() = quaternionOf(Eigen::Quaterniond::Identity());
  *cube.mutable_size() = vectorOf(box.max - box.min);
  *cube.mutable_color() = colour;
  return cube;
}

foxglove::SceneEntity stillEntity(const scene::Scene& scene, std::size_t mostTriangles,
                                  std::size_t mostBoxes) {
  const std::vector<std::uint32_t> still = stillObjects(scene.model());
  const foxglove::Color pale = colourOf(Eigen::Vector3f::Constant(0.7f), 0.25);
  foxglove::SceneEntity entity;
  entity.set_id("still");
  entity.set_frame_id("scene");
  if (trianglesOf(scene.model(), still) <= mostTriangles) {
    addObjects(entity, scene.model(), still, scene::Vec3::Zero());
  } else if (scene.stillBoxes().size() <= mostBoxes) {
    for (const scene::Box& box : scene.stillBoxes()) *entity.add_cubes() = cubeOf(box, pale);
  } else {
    *entity.add_cubes() = cubeOf(scene.bounds(), pale);
  }
  return entity;
}

foxglove::SceneEntity bodyEntity(const scene::Scene& scene, std::size_t body) {
  const scene::BodySpec& spec = scene.model().bodies[body];
  foxglove::SceneEntity entity;
  entity.set_id("body/" + spec.name);
  entity.set_frame_id("body/" + spec.name);
  entity.set_frame_locked(true);
  addObjects(entity, scene.model(), spec.objects, scene.shapeOfBody(body)->origin);
  return entity;
}

foxglove::SceneEntity avatarEntity(const scene::AvatarView& avatar) {
  foxglove::SceneEntity entity;
  entity.set_id("avatar/" + avatar.name);
  entity.set_frame_id("avatar/" + avatar.name);
  entity.set_frame_locked(true);
  foxglove::TriangleListPrimitive& body = *entity.add_triangles();
  *body.mutable_color() = colourOf(kAvatarColour);
  for (const scene::AvatarPart& part : avatar.shape->parts) addHull(body, part);
  foxglove::TextPrimitive& name = *entity.add_texts();
  *name.mutable_pose()->mutable_position() =
      vectorOf({0, avatar.shape->box.max.y() + kNameHeight, 0});
  *name.mutable_pose()->mutable_orientation() = quaternionOf(Eigen::Quaterniond::Identity());
  name.set_billboard(true);
  name.set_font_size(kNameHeight);
  *name.mutable_color() = colourOf(kAvatarColour);
  name.set_text(avatar.name);
  return entity;
}

}  // namespace enfilade::server
