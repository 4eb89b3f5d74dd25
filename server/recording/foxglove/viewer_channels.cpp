#include "server/recording/foxglove/viewer_channels.hpp"

#include <algorithm>

#include "render/camera/camera.hpp"
#include "server/messages/world_messages.hpp"
#include "server/recording/foxglove/primitives.hpp"

namespace enfilade::server {
namespace {

constexpr double kTransformPeriod = 0.1;  // seconds; viewers interpolate between transforms

/// Above these limits the scene's geometry would dominate the recording's size.
constexpr std::size_t kMaxTriangles = 100'000, kMaxBoxes = 20'000;

constexpr double kMarkerDiameter = 0.08;  // metres, of a contact's sphere
const Eigen::Vector3f kMarkerColour{0.9f, 0.05f, 0.1f};

foxglove::FrameTransform makeTransform(double time, const std::string& parent,
                                       const std::string& child, const scene::Vec3& translation,
                                       const Eigen::Quaterniond& rotation) {
  foxglove::FrameTransform transform;
  *transform.mutable_timestamp() = toTimestamp(time);
  transform.set_parent_frame_id(parent);
  transform.set_child_frame_id(child);
  *transform.mutable_translation() = toVector(translation);
  *transform.mutable_rotation() = toQuaternion(rotation);
  return transform;
}

/// Orientation of an avatar's camera frame: x right, y down, z forward.
Eigen::Quaterniond computeOpticalRotation(const scene::AvatarSnapshot& avatar) {
  const render::CameraBasis basis =
      render::computeCameraBasis(render::makeFirstPersonCamera(avatar, 1, 1));
  scene::Vec3 down = -basis.up;
  Eigen::Matrix3d axes;
  axes << basis.right, down, basis.forward;
  return Eigen::Quaterniond(axes).normalized();
}

std::string makeContactId(const v1::ContactEvent& event) {
  return "contact/" + event.a_name() + "/" + event.b_name();
}

foxglove::SceneEntity makeContactMarker(const v1::ContactEvent& event, double time) {
  foxglove::SceneEntity entity;
  *entity.mutable_timestamp() = toTimestamp(time);
  entity.set_id(makeContactId(event));
  entity.set_frame_id("scene");
  foxglove::SpherePrimitive& marker = *entity.add_spheres();
  *marker.mutable_pose()->mutable_position() = toVector(vectorFromProto(event.point_b()));
  *marker.mutable_pose()->mutable_orientation() = toQuaternion(Eigen::Quaterniond::Identity());
  *marker.mutable_size() = toVector(scene::Vec3::Constant(kMarkerDiameter));
  *marker.mutable_color() = makeColour(kMarkerColour);
  for (const auto& [key, value] : {std::pair("a", event.a_name()), std::pair("b", event.b_name()),
                                   std::pair("distance", std::to_string(event.distance()))}) {
    foxglove::KeyValuePair& pair = *entity.add_metadata();
    pair.set_key(key);
    pair.set_value(value);
  }
  return entity;
}

foxglove::SceneEntityDeletion makeDeletion(double time, const std::string& id) {
  foxglove::SceneEntityDeletion deletion;
  *deletion.mutable_timestamp() = toTimestamp(time);
  deletion.set_id(id);
  return deletion;
}

bool hasKind(const v1::ContactEvent& event, v1::ContactEvent::Kind kind) {
  return event.kind() == kind;
}

}  // namespace

std::string makeImageTopic(const std::string& avatar) {
  return "/frames/" + avatar + "/image";
}

std::string makeCalibrationTopic(const std::string& avatar) {
  return "/frames/" + avatar + "/calibration";
}

void ViewerChannels::writeScene(const scene::World& world) {
  const scene::Scene& scene = world.scene();
  foxglove::SceneUpdate update;
  foxglove::SceneEntityDeletion& deleteAll = *update.add_deletions();
  deleteAll.set_type(foxglove::SceneEntityDeletion::ALL);
  *deleteAll.mutable_timestamp() = toTimestamp(sink_.stampTime(0));
  if (staticObjects_ == StaticObjects::asPrimitives)
    *update.add_entities() = makeStaticEntity(scene, kMaxTriangles, kMaxBoxes);
  for (std::size_t body = 0; body < scene.model().bodies.size(); ++body)
    if (!isTrigger(scene.model().bodies[body].kind))
      *update.add_entities() = makeBodyEntity(scene, body);
  for (foxglove::SceneEntity& entity : *update.mutable_entities())
    *entity.mutable_timestamp() = deleteAll.timestamp();
  sink_.write(kSceneTopic, 0, update);
  shownShapes_.clear();
  nextTransformTime_ = 0;
  writeTransforms(world, true);
}

void ViewerChannels::writePresent(const scene::World& world) {
  nextTransformTime_ = 0;
  writeTransforms(world, true);
  writeAvatars(world);
}

/// `includeStatic`: also writes the root transform and the bodies at their initial poses.
void ViewerChannels::writeTransforms(const scene::World& world, bool includeStatic) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const double time = sink_.stampTime(snapshot.time);
  foxglove::FrameTransforms transforms;
  const auto addTransform = [&](const std::string& parent, const std::string& child,
                                const scene::Vec3& at, const Eigen::Quaterniond& rotation) {
    *transforms.add_transforms() = makeTransform(time, parent, child, at, rotation);
  };
  if (includeStatic) addTransform("map", "scene", scene::Vec3::Zero(), convertYUpToZUp());
  for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
    addTransform("scene", "avatar/" + avatar.name, avatar.footPosition,
                 Eigen::Quaterniond::Identity());
    addTransform("avatar/" + avatar.name, "eyes/" + avatar.name, {0, avatar.eyeHeight, 0},
                 computeOpticalRotation(avatar));
  }
  for (const scene::BodySnapshot& body : *snapshot.bodies)
    if (includeStatic || body.displaced || body.moving)
      addTransform("scene", "body/" + world.scene().model().bodies[body.index].name,
                   body.pose.translation, Eigen::Quaterniond(body.pose.rotation));
  if (!transforms.transforms().empty()) sink_.write(kTransformTopic, snapshot.time, transforms);
}

void ViewerChannels::writeAvatars(const scene::World& world) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const double time = sink_.stampTime(snapshot.time);
  foxglove::SceneUpdate update;
  auto before = std::exchange(shownShapes_, {});
  for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
    shownShapes_[avatar.name] = avatar.shape;
    const auto earlier = before.extract(avatar.name);
    if (!earlier.empty() && earlier.mapped() == avatar.shape) continue;
    *update.add_entities() = makeAvatarEntity(avatar);
    *update.mutable_entities()->rbegin()->mutable_timestamp() = toTimestamp(time);
  }
  for (const auto& [name, shape] : before)
    *update.add_deletions() = makeDeletion(time, "avatar/" + name);
  if (!update.entities().empty() || !update.deletions().empty())
    sink_.write(kSceneTopic, snapshot.time, update);
}

void ViewerChannels::writeContacts(const v1::TickEvents& events) {
  foxglove::SceneUpdate update;
  const double time = sink_.stampTime(events.time());
  for (const v1::ContactEvent& event : events.contacts()) {
    if (hasKind(event, v1::ContactEvent::KIND_BEGIN))
      *update.add_entities() = makeContactMarker(event, time);
    if (hasKind(event, v1::ContactEvent::KIND_END))
      *update.add_deletions() = makeDeletion(time, makeContactId(event));
  }
  if (!update.entities().empty() || !update.deletions().empty())
    sink_.write(kSceneTopic, events.time(), update);
}

void ViewerChannels::writeTick(const scene::World& world, const v1::TickEvents& events) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const bool hasCapture = std::any_of(
      events.notices().begin(), events.notices().end(),
      [](const v1::Notice& notice) { return notice.kind() == v1::Notice::KIND_CAPTURE; });
  writeContacts(events);
  if (snapshot.time + world.settings().tickDuration / 2 < nextTransformTime_ && !hasCapture) return;
  nextTransformTime_ = snapshot.time + kTransformPeriod;
  writeTransforms(world, false);
  writeAvatars(world);
}

void ViewerChannels::writeEvents(const v1::TickEvents& events) {
  writeContacts(events);
}

void ViewerChannels::writeImage(const std::string& avatar, const v1::Frame& description,
                                const EncodedImage& encodedImage) {
  const std::string frame = "eyes/" + avatar;
  foxglove::CompressedImage image;
  *image.mutable_timestamp() = toTimestamp(sink_.stampTime(description.time()));
  image.set_frame_id(frame);
  image.set_format(encodedImage.format);
  image.set_data(encodedImage.bytes.data(), encodedImage.bytes.size());
  sink_.write(makeImageTopic(avatar), description.time(), image);
  if (!description.has_intrinsics()) return;
  const v1::Intrinsics& intrinsics = description.intrinsics();
  foxglove::CameraCalibration calibration;
  *calibration.mutable_timestamp() = image.timestamp();
  calibration.set_frame_id(frame);
  calibration.set_width(description.width());
  calibration.set_height(description.height());
  for (const double k : {intrinsics.fx(), 0.0, intrinsics.cx(), 0.0, intrinsics.fy(),
                         intrinsics.cy(), 0.0, 0.0, 1.0})
    calibration.add_k(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) calibration.add_r(r);
  for (const double p : {intrinsics.fx(), 0.0, intrinsics.cx(), 0.0, 0.0, intrinsics.fy(),
                         intrinsics.cy(), 0.0, 0.0, 0.0, 1.0, 0.0})
    calibration.add_p(p);
  sink_.write(makeCalibrationTopic(avatar), description.time(), calibration);
}

}  // namespace enfilade::server
