// Bodies between the world and the protocol's messages.
#pragma once

#include <optional>
#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// The command, or what is missing in it, naming the field. Values are the world's to judge.
std::variant<scene::BodyCommand, v1::Error> commandFrom(const v1::BodyCommand& message);

/// Hands a command to the next tick. Why the world does not take it; nullopt when it does.
std::optional<v1::Error> submit(scene::World& world, const v1::BodyCommand& message);

/// Of Model::bodies[index].
v1::Body bodyMessageOf(const scene::Scene& scene, std::size_t index);
v1::BodyState messageOf(const scene::World& world, const scene::BodyView& view);

}  // namespace enfilade::server
