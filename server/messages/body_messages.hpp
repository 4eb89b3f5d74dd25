// Conversion of scenes, bodies and body commands between the world and the protocol.
#pragma once

#include <optional>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// Submits a command for the next tick. Returns the refusal; nullopt: accepted.
std::optional<v1::Error> submitBodyCommand(scene::World& world, const v1::BodyCommand& message);

/// Includes all bodies.
v1::Scene toProto(const scene::Scene& scene);
/// Converts Model::bodies[index].
v1::Body toProto(const scene::Scene& scene, std::size_t index);
v1::BodyState toProto(const scene::World& world, const scene::BodySnapshot& body);

}  // namespace enfilade::server
