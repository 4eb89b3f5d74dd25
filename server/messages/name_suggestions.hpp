// The names that a client probably meant, for the ends of error messages.
#pragma once

#include <string>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// "; did you mean 'ann'?", or which names exist. Looks at the first thousand names, which takes
/// about 1 ms. "" if an avatar has this name by now.
std::string suggestAvatar(const scene::World& world, const std::string& name);
/// The same for bodies; "" if a body has this name.
std::string suggestBody(const scene::World& world, const std::string& name);
/// suggestBody() for the first unknown door or lift of a walk; "" if all are known.
std::string suggestBodies(const scene::World& world, const v1::Command& command);

}  // namespace enfilade::server
