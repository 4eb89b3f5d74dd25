// What a served world is made with, beside its scene.
#pragma once

#include <cstdint>

#include "scene/lengths.hpp"
#include "server/server_limits.hpp"

namespace enfilade::server {

struct WorldOptions {
  ServerLimits limits;
  scene::Lengths lengths;
  std::uint32_t auditEvery = 0;  ///< ticks; 0: none is audited
};

}  // namespace enfilade::server
