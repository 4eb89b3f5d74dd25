// The world's plain data as messages, and messages as the world's commands.
#pragma once

#include <string>
#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

/// The order, or what is missing in it, naming the field. Values are the world's to judge
/// (order_messages.cpp).
std::variant<scene::Command, v1::Error> commandFrom(const v1::Command& message);

v1::ContactEvent messageOf(const scene::World& world, const scene::ContactEvent& event);
v1::Notice messageOf(const scene::World& world, const scene::Notice& notice, std::uint64_t tick);
v1::AvatarState messageOf(const scene::World& world, const scene::AvatarView& avatar);
v1::Scene messageOf(const scene::Scene& scene);
v1::Policies messageOf(const scene::Lengths& lengths);
v1::Vec3 messageOf(const scene::Vec3& v);
scene::Vec3 vectorFrom(const v1::Vec3& message);
v1::Verdict messageOf(collision::Verdict verdict);
v1::DecidedBy messageOf(collision::DecidedBy decidedBy);
v1::Feature messageOf(collision::Feature feature);

/// Into a message that tells of two entities.
template <class Message>
void putDecision(const collision::Decision& decision, Message& message) {
  message.set_verdict(messageOf(decision.verdict));
  message.set_distance(decision.distance);
  message.set_error_bound(decision.errorBound);
  *message.mutable_point_a() = messageOf(decision.pointA);
  *message.mutable_point_b() = messageOf(decision.pointB);
  *message.mutable_normal() = messageOf(decision.normal);
  message.set_decided_by(messageOf(decision.decidedBy));
  message.set_feature_a(messageOf(decision.featureA));
  message.set_feature_b(messageOf(decision.featureB));
}

v1::Error errorOf(v1::ErrorCode code, std::string message, std::string field = {});

/// Null when there is none.
const scene::AvatarView* avatarNamed(const scene::Snapshot& snapshot, const std::string& name);
v1::Error unknownAvatar(const std::string& name, const std::string& field);

/// The whole reply to a request that failed.
Buffer errorReply(std::uint64_t requestId, v1::Error error);

/// A refusal of the world as an error; it begins with the field, whose path is completed.
v1::Error refusalOf(const v1::Command& command, const std::string& why);

}  // namespace enfilade::server
