// The order Go: a walk along a path that is found first.
#pragma once

#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// The query for the path, from where the avatar's queued orders end; or an error.
std::variant<v1::NavigationQuery, v1::Error> makePathQuery(const scene::World& world,
                                                           const v1::Command& command);

/// The Walk for the path of the reply; an error without one.
std::variant<v1::Command, v1::Error> makeGoOrder(
    const v1::Command& command, const std::variant<v1::NavigationReply, v1::Error>& found);

}  // namespace enfilade::server
