#include "server/messages/world_messages.hpp"

#include <cmath>

#include "collision/assert.hpp"
#include "server/messages/event_place.hpp"
#include "server/messages/name_suggestions.hpp"

namespace enfilade::server {

namespace {

v1::ContactEvent::Kind toProto(scene::ContactEvent::Kind kind) {
  using Kind = scene::ContactEvent::Kind;
  switch (kind) {
    case Kind::begin:
      return v1::ContactEvent::KIND_BEGIN;
    case Kind::end:
      return v1::ContactEvent::KIND_END;
    case Kind::nearMiss:
      return v1::ContactEvent::KIND_NEAR;
    case Kind::blocked:
      return v1::ContactEvent::KIND_BLOCKED;
    case Kind::enter:
      return v1::ContactEvent::KIND_ENTER;
    case Kind::leave:
      return v1::ContactEvent::KIND_LEAVE;
    case Kind::leftWorld:
      return v1::ContactEvent::KIND_LEFT_WORLD;
  }
  return v1::ContactEvent::KIND_UNSPECIFIED;
}

v1::ContactEvent::Reason toProto(scene::ContactEvent::Reason reason) {
  using Reason = scene::ContactEvent::Reason;
  switch (reason) {
    case Reason::separated:
      return v1::ContactEvent::REASON_PARTED;
    case Reason::left:
      return v1::ContactEvent::REASON_LEFT;
    case Reason::shutdown:
      return v1::ContactEvent::REASON_SHUTDOWN;
  }
  return v1::ContactEvent::REASON_UNSPECIFIED;
}

v1::Notice::Kind toProto(scene::Notice::Kind kind) {
  using Kind = scene::Notice::Kind;
  switch (kind) {
    case Kind::spawned:
      return v1::Notice::KIND_SPAWNED;
    case Kind::refused:
      return v1::Notice::KIND_REFUSED;
    case Kind::arrived:
      return v1::Notice::KIND_ARRIVED;
    case Kind::blocked:
      return v1::Notice::KIND_BLOCKED;
    case Kind::done:
      return v1::Notice::KIND_DONE;
    case Kind::capture:
      return v1::Notice::KIND_CAPTURE;
    case Kind::left:
      return v1::Notice::KIND_LEFT;
    case Kind::dropped:
      return v1::Notice::KIND_DROPPED;
  }
  return v1::Notice::KIND_UNSPECIFIED;
}

}  // namespace

v1::Verdict toProto(collision::Verdict verdict) {
  switch (verdict) {
    case collision::Verdict::separated:
      return v1::VERDICT_SEPARATED;
    case collision::Verdict::touching:
      return v1::VERDICT_TOUCHING;
    case collision::Verdict::penetrating:
      return v1::VERDICT_PENETRATING;
  }
  return v1::VERDICT_UNSPECIFIED;
}

v1::DecidedBy toProto(collision::Certificate certificate) {
  return certificate == collision::Certificate::filter ? v1::DECIDED_BY_FILTER
                                                       : v1::DECIDED_BY_RATIONAL;
}

v1::Feature toProto(collision::Feature feature) {
  switch (feature) {
    case collision::Feature::vertex:
      return v1::FEATURE_VERTEX;
    case collision::Feature::edge:
      return v1::FEATURE_EDGE;
    case collision::Feature::face:
      return v1::FEATURE_FACE;
    case collision::Feature::none:
      break;
  }
  return v1::FEATURE_UNSPECIFIED;
}

v1::Error makeError(v1::ErrorCode code, std::string message, std::string field) {
  constexpr std::size_t kMaxMessageBytes = 1000;  // a client's name in it may be long
  if (message.size() > kMaxMessageBytes) {
    std::size_t end = kMaxMessageBytes;
    while (end > 0 && (static_cast<unsigned char>(message[end]) & 0xc0) == 0x80) --end;  // UTF-8
    message = message.substr(0, end) + " [...]";
  }
  v1::Error error;
  error.set_code(code);
  error.set_message(std::move(message));
  error.set_field(std::move(field));
  return error;
}

const scene::AvatarSnapshot* findAvatar(const scene::Snapshot& snapshot, const std::string& name) {
  for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
    if (avatar.name == name) return &avatar;
  }
  return nullptr;
}

v1::Error makeUnknownAvatarError(const std::string& name, const std::string& field) {
  return makeError(v1::ERROR_UNKNOWN_AVATAR,
                   "no avatar '" + name + "' is in the world: spawn it and run a tick first",
                   field);
}

Buffer makeErrorReply(std::uint64_t requestId, v1::Error error) {
  v1::ServerMessage reply;
  reply.set_reply_to(requestId);
  *reply.mutable_error() = std::move(error);
  return encodeShared(reply);
}

v1::Error makeRefusalError(const v1::Command& command, const std::string& reason) {
  ENFILADE_ASSERT(!reason.empty());
  const auto* order = v1::Command::descriptor()->FindFieldByNumber(command.order_case());
  std::string field = reason.substr(0, reason.find_first_of(" :'"));
  if (order && field != "avatar") field = order->name() + "." + field;
  return makeError(v1::ERROR_REFUSED_COMMAND, reason, field);
}

v1::Vec3 toProto(const scene::Vec3& v) {
  v1::Vec3 message;
  message.set_x(v.x());
  message.set_y(v.y());
  message.set_z(v.z());
  return message;
}

scene::Vec3 vectorFromProto(const v1::Vec3& message) {
  return {message.x(), message.y(), message.z()};
}

namespace {

v1::ContactEvent::Phase toProto(scene::ContactEvent::Phase phase) {
  using Phase = scene::ContactEvent::Phase;
  switch (phase) {
    case Phase::begin:
      return v1::ContactEvent::PHASE_BEGIN;
    case Phase::min:
      return v1::ContactEvent::PHASE_MIN;
    case Phase::end:
      return v1::ContactEvent::PHASE_END;
    case Phase::none:
      break;
  }
  return v1::ContactEvent::PHASE_UNSPECIFIED;
}

}  // namespace

const std::string& findGlobalId(const scene::Model& model, scene::EntityId entity) {
  static const std::string none;
  if (entity == 0 || entity > model.objects.size()) return none;
  const scene::Object& object = model.objects[entity - 1];
  return object.globalId.empty() && object.partOf ? model.objects[*object.partOf].globalId
                                                  : object.globalId;
}

void describeObject(const scene::Model& model, scene::EntityId entity, v1::Entity& into) {
  const scene::Object& object = model.objects[entity - 1];
  into.set_kind(v1::Entity::KIND_OBJECT);
  into.set_global_id(object.globalId);
  into.set_operation(object.operationType);
  into.set_ifc_class(object.ifcClass);
  if (object.storey) into.set_storey(model.storeys[*object.storey].name);
  for (const scene::ObjectAttribute& attribute : object.attributes) {
    v1::Attribute& message = *into.add_attributes();
    message.set_name(attribute.name);
    message.mutable_values()->Add(attribute.values.begin(), attribute.values.end());
  }
}

void describeDetails(const scene::Scene& scene, scene::EntityId entity, v1::Entity& into) {
  const scene::Model& model = scene.model();
  const scene::ObjectClasses& classes = scene.objectClasses();
  into.set_class_id(classes.getClass(entity));
  into.set_class_name(classes.names[classes.getClass(entity)]);
  into.set_thing(classes.getThing(entity));
  if (entity > model.objects.size()) return;
  const scene::Object& object = model.objects[entity - 1];
  if (const scene::Aabb box = scene.objectBoxes()[entity - 1]; !box.empty()) {
    *into.mutable_box()->mutable_min() = toProto(box.min);
    *into.mutable_box()->mutable_max() = toProto(box.max);
  }
  if (!object.meshes.empty())
    into.set_material(model.materials[model.meshes[object.meshes.front()].material].name);
}

v1::ContactEvent toProto(const scene::World& world, const scene::ContactEvent& event) {
  v1::ContactEvent message;
  message.set_tick(event.tick);
  message.set_time(event.time);
  message.set_kind(toProto(event.kind));
  if (event.kind == scene::ContactEvent::Kind::end ||
      event.kind == scene::ContactEvent::Kind::leave)
    message.set_reason(toProto(event.reason));
  message.set_phase(toProto(event.phase));
  message.set_a(event.a);
  message.set_b(event.b);
  message.set_a_name(scene::findEntityName(world, event.a));
  message.set_b_name(scene::findEntityName(world, event.b));
  message.set_a_global_id(findGlobalId(world.scene().model(), event.a));
  message.set_b_global_id(findGlobalId(world.scene().model(), event.b));
  const EventPlace place = findEventPlace(world.scene().model(), event);
  message.set_storey(place.storey);
  message.set_room(place.room);
  message.set_room_name(place.roomName);
  setSeparation(event.separation, message);
  return message;
}

v1::Notice toProto(const scene::World& world, const scene::Notice& notice, std::uint64_t tick) {
  v1::Notice message;
  message.set_tick(tick);
  message.set_kind(toProto(notice.kind));
  message.set_avatar(notice.avatar);
  message.set_id(notice.id);
  message.set_tag(notice.tag);
  *message.mutable_position() = toProto(notice.position);
  message.set_obstacle(notice.obstacle);
  message.set_obstacle_name(scene::findEntityName(world, notice.obstacle));
  message.set_obstacle_global_id(findGlobalId(world.scene().model(), notice.obstacle));
  message.set_text(notice.text);
  return message;
}

namespace {

v1::MoveResult toProto(const scene::World& world, const scene::MoveResult& move) {
  v1::MoveResult message;
  *message.mutable_asked() = server::toProto(move.requestedDisplacement);
  *message.mutable_made() = server::toProto(move.actualDisplacement);
  if (move.blockedBy == 0) return message;
  message.set_stopped_by(move.blockedBy);
  message.set_stopped_by_name(scene::findEntityName(world, move.blockedBy));
  message.set_verdict(server::toProto(move.separation.verdict));
  message.set_distance(move.separation.distance);
  *message.mutable_normal() = server::toProto(move.separation.normal);
  message.set_decided_by(server::toProto(move.separation.certificate));
  return message;
}

}  // namespace

v1::AvatarState toProto(const scene::World& world, const scene::AvatarSnapshot& avatar) {
  v1::AvatarState message;
  message.set_id(avatar.id);
  message.set_name(avatar.name);
  *message.mutable_feet() = toProto(avatar.footPosition);
  *message.mutable_gaze() = toProto(avatar.viewDirection);
  message.set_eye_height(avatar.eyeHeight);
  message.set_grounded(avatar.grounded);
  *message.mutable_move() = toProto(world, avatar.move);
  message.set_flying(avatar.flying);
  message.set_stands_on(avatar.groundEntity);
  message.set_height(avatar.height);
  message.set_facing(avatar.facing);
  message.set_last_stopped_tick(avatar.lastStoppedTick);
  for (const scene::JointSnapshot& joint : avatar.joints) {
    v1::JointState& state = *message.add_joints();
    state.set_value(joint.value);
    state.set_stopped_by(joint.blockedBy);
  }
  return message;
}

v1::Policies toProto(const scene::WorldSettings& settings) {
  v1::Policies message;
  setWorldSettings(settings, message);
  message.set_walkable_slope(std::acos(settings.walkableNormalY));
  message.set_bodies("push_and_tell");
  return message;
}

}  // namespace enfilade::server
