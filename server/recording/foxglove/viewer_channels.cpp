#include "server/recording/foxglove/viewer_channels.hpp"

#include <algorithm>

#include "render/camera_basis.hpp"
#include "server/messages/world_messages.hpp"
#include "server/recording/foxglove/primitives.hpp"

namespace enfilade::server {
namespace {

constexpr double kPlacedEvery = 0.1;  // seconds: viewers draw the way between

/// Beyond these a scene's looks would outweigh its walk.
constexpr std::size_t kMostTriangles = 100'000, kMostBoxes = 20'000;

constexpr double kMarkDiameter = 0.08;  // metres, of a contact
const Eigen::Vector3f kMarkColour{0.9f, 0.05f, 0.1f};

constexpr const char* kTransforms = "/tf";
constexpr const char* kLooks = "/scene";

foxglove::FrameTransform transformOf(double time, const std::string& parent,
                                     const std::string& child, const scene::Vec3& translation,
                                     const Eigen::Quaterniond& rotation) {
  foxglove::FrameTransform transform;
  *transform.mutable_timestamp() = timestampOf(time);
  transform.set_parent_frame_id(parent);
  transform.set_child_frame_id(child);
  *transform.mutable_translation() = vectorOf(translation);
  *transform.mutable_rotation() = quaternionOf(rotation);
  return transform;
}

/// Of a camera: x right, y down, z ahead.
Eigen::Quaterniond opticalAxes(const scene::AvatarView& avatar) {
  const render::View view = render::viewOf(render::firstPerson(avatar, 1, 1));
  scene::Vec3 down = -view.up;
  Eigen::Matrix3d axes;
  axes << view.right, down, view.forward;
  return Eigen::Quaterniond(axes).normalized();
}

std::string contactId(const v1::ContactEvent& event) {
  return "contact/" + event.a_name() + "/" + event.b_name();
}

foxglove::SceneEntity markOf(const v1::ContactEvent& event, double time) {
  foxglove::SceneEntity entity;
  *entity.mutable_timestamp() = timestampOf(time);
  entity.set_id(contactId(event));
  entity.set_frame_id("scene");
  foxglove::SpherePrimitive& mark = *entity.add_spheres();
  *mark.mutable_pose()->mutable_position() = vectorOf(vectorFrom(event.point_b()));
  *mark.mutable_pose()->mutable_orientation() = quaternionOf(Eigen::Quaterniond::Identity());
  *mark.mutable_size() = vectorOf(scene::Vec3::Constant(kMarkDiameter));
  *mark.mutable_color() = colourOf(kMarkColour);
  for (const auto& [key, value] : {std::pair("a", event.a_name()), std::pair("b", event.b_name()),
                                   std::pair("distance", std::to_string(event.distance()))}) {
    foxglove::KeyValuePair& pair = *entity.add_metadata();
    pair.set_key(key);
    pair.set_value(value);
  }
  return entity;
}

foxglove::SceneEntityDeletion deletionOf(double time, const std::string& id) {
  foxglove::SceneEntityDeletion deletion;
  *deletion.mutable_timestamp() = timestampOf(time);
  deletion.set_id(id);
  return deletion;
}

bool isOf(const v1::ContactEvent& event, v1::ContactEvent::Kind kind) {
  return event.kind() == kind;
}

}  // namespace

void ViewerChannels::begin(const scene::World& world) {
  const scene::Scene& scene = world.scene();
  foxglove::SceneUpdate looks;
  foxglove::SceneEntityDeletion& all = *looks.add_deletions();
  all.set_type(foxglove::SceneEntityDeletion::ALL);
  *all.mutable_timestamp() = timestampOf(file_.fileTime(0));
  *looks.add_entities() = stillEntity(scene, kMostTriangles, kMostBoxes);
  for (std::size_t body = 0; body < scene.model().bodies.size(); ++body)
    if (scene.model().bodies[body].kind != scene::BodyKind::trigger)
      *looks.add_entities() = bodyEntity(scene, body);
  for (foxglove::SceneEntity& entity : *looks.mutable_entities())
    *entity.mutable_timestamp() = all.timestamp();
  file_.write(kLooks, 0, looks);
  shown_.clear();
  nextTime_ = 0;
  placeEveryone(world, true);
}

/// `all`: what never moves, and what stands where the model has it, too.
void ViewerChannels::placeEveryone(const scene::World& world, bool all) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const double time = file_.fileTime(snapshot.time);
  foxglove::FrameTransforms places;
  const auto place = [&](const std::string& parent, const std::string& child, const scene::Vec3& at,
                         const Eigen::Quaterniond& turn) {
    *places.add_transforms() = transformOf(time, parent, child, at, turn);
  };
  if (all) place("map", "scene", scene::Vec3::Zero(), upright());
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    place("scene", "avatar/" + avatar.name, avatar.feet, Eigen::Quaterniond::Identity());
    place("avatar/" + avatar.name, "eyes/" + avatar.name, {0, avatar.eyeHeight, 0},
          opticalAxes(avatar));
  }
  for (const scene::BodyView& body : *snapshot.bodies)
    if (all || body.displaced || body.moving)
      place("scene", "body/" + world.scene().model().bodies[body.index].name, body.pose.translation,
            Eigen::Quaterniond(body.pose.rotation));
  if (!places.transforms().empty()) file_.write(kTransforms, snapshot.time, places);
}

void ViewerChannels::showAvatars(const scene::World& world) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const double time = file_.fileTime(snapshot.time);
  foxglove::SceneUpdate looks;
  auto before = std::exchange(shown_, {});
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    shown_[avatar.name] = avatar.shape;
    const auto earlier = before.extract(avatar.name);
    if (!earlier.empty() && earlier.mapped() == avatar.shape) continue;
    *looks.add_entities() = avatarEntity(avatar);
    *looks.mutable_entities()->rbegin()->mutable_timestamp() = timestampOf(time);
  }
  for (const auto& [name, shape] : before)
    *looks.add_deletions() = deletionOf(time, "avatar/" + name);
  if (!looks.entities().empty() || !looks.deletions().empty())
    file_.write(kLooks, snapshot.time, looks);
}

void ViewerChannels::showContacts(const v1::TickEvents& events) {
  foxglove::SceneUpdate looks;
  const double time = file_.fileTime(events.time());
  for (const v1::ContactEvent& event : events.contacts()) {
    if (isOf(event, v1::ContactEvent::KIND_BEGIN)) *looks.add_entities() = markOf(event, time);
    if (isOf(event, v1::ContactEvent::KIND_END))
      *looks.add_deletions() = deletionOf(time, contactId(event));
  }
  if (!looks.entities().empty() || !looks.deletions().empty())
    file_.write(kLooks, events.time(), looks);
}

void ViewerChannels::ticked(const scene::World& world, const v1::TickEvents& events) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const bool pictured = std::any_of(
      events.notices().begin(), events.notices().end(),
      [](const v1::Notice& notice) { return notice.kind() == v1::Notice::KIND_CAPTURE; });
  showContacts(events);
  if (snapshot.time + world.lengths().tick / 2 < nextTime_ && !pictured) return;
  nextTime_ = snapshot.time + kPlacedEvery;
  placeEveryone(world, false);
  showAvatars(world);
}

void ViewerChannels::told(const v1::TickEvents& events) {
  showContacts(events);
}

void ViewerChannels::picture(const std::string& avatar, const v1::Frame& description,
                             const EncodedPicture& picture) {
  const std::string topic = "/frames/" + avatar, frame = "eyes/" + avatar;
  foxglove::CompressedImage image;
  *image.mutable_timestamp() = timestampOf(file_.fileTime(description.time()));
  image.set_frame_id(frame);
  image.set_format(picture.format);
  image.set_data(picture.bytes.data(), picture.bytes.size());
  file_.write(topic + "/image", description.time(), image);
  if (!description.has_intrinsics()) return;
  const v1::Intrinsics& lens = description.intrinsics();
  foxglove::CameraCalibration calibration;
  *calibration.mutable_timestamp() = image.timestamp();
  calibration.set_frame_id(frame);
  calibration.set_width(description.width());
  calibration.set_height(description.height());
  for (const double k : {lens.fx(), 0.0, lens.cx(), 0.0, lens.fy(), lens.cy(), 0.0, 0.0, 1.0})
    calibration.add_k(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) calibration.add_r(r);
  for (const double p :
       {lens.fx(), 0.0, lens.cx(), 0.0, 0.0, lens.fy(), lens.cy(), 0.0, 0.0, 0.0, 1.0, 0.0})
    calibration.add_p(p);
  file_.write(topic + "/calibration", description.time(), calibration);
}

}  // namespace enfilade::server
