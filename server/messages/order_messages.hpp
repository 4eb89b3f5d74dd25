// Conversion of command messages to commands of avatars.
#pragma once

#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// Returns the command, or an error that names a missing field. The world validates the values.
std::variant<scene::Command, v1::Error> commandFromProto(const v1::Command& message);

}  // namespace enfilade::server
