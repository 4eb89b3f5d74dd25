// Converts world data to messages.
#pragma once

#include <string>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

v1::ContactEvent toProto(const scene::World& world, const scene::ContactEvent& event);
v1::Notice toProto(const scene::World& world, const scene::Notice& notice, std::uint64_t tick);
v1::AvatarState toProto(const scene::World& world, const scene::AvatarSnapshot& avatar);
v1::Policies toProto(const scene::WorldSettings& settings);
v1::Vec3 toProto(const scene::Vec3& v);
scene::Vec3 vectorFromProto(const v1::Vec3& message);
v1::Verdict toProto(collision::Verdict verdict);
v1::DecidedBy toProto(collision::Certificate certificate);
v1::Feature toProto(collision::Feature feature);

/// Writes the result of a pair query into a message about two entities.
template <class Message>
void setSeparation(const collision::SeparationResult& separation, Message& message) {
  message.set_verdict(toProto(separation.verdict));
  message.set_distance(separation.distance);
  message.set_error_bound(separation.errorBound);
  *message.mutable_point_a() = toProto(separation.pointA);
  *message.mutable_point_b() = toProto(separation.pointB);
  *message.mutable_normal() = toProto(separation.normal);
  message.set_decided_by(toProto(separation.certificate));
  message.set_feature_a(toProto(separation.featureA));
  message.set_feature_b(toProto(separation.featureB));
}

/// Writes the settings that live and recorded messages share.
template <class Message>
void setWorldSettings(const scene::WorldSettings& settings, Message& message) {
  message.set_epsilon(settings.contactOffset);
  message.set_step_height(settings.stepHeight);
  message.set_near_miss(settings.nearMissDistance);
  message.set_tick(settings.tickDuration);
  message.set_speed_limit(settings.maxSpeed);
  message.set_gravity(settings.gravity);
  message.set_patience(settings.stuckTimeout);
  message.set_sliding(settings.sliding == scene::Sliding::slide ? "slide" : "stop");
  message.set_jump_limit(settings.maxJumpHeight);
  message.set_joint_speed_limit(settings.maxJointSpeed);
  message.set_push_force(settings.maxPushForce);
}

/// The IFC GlobalId of an object or, of a part without one, of its whole; "" for all else.
const std::string& findGlobalId(const scene::Model& model, scene::EntityId entity);
/// Fills in what the model knows of an object. `entity` is an object's id.
void describeObject(const scene::Model& model, scene::EntityId entity, v1::Entity& into);
/// Fills in the details of DescribeEntities, also of avatars.
void describeDetails(const scene::Scene& scene, scene::EntityId entity, v1::Entity& into);

v1::Error makeError(v1::ErrorCode code, std::string message, std::string field = {});

/// Returns null if no avatar has this name.
const scene::AvatarSnapshot* findAvatar(const scene::Snapshot& snapshot, const std::string& name);
v1::Error makeUnknownAvatarError(const std::string& name, const std::string& field);

/// The encoded reply to a failed request.
Buffer makeErrorReply(std::uint64_t requestId, v1::Error error);

/// Converts a refusal of the world to an error. `reason` starts with the field's name; the error
/// gets the field's full path.
v1::Error makeRefusalError(const v1::Command& command, const std::string& reason);

}  // namespace enfilade::server
