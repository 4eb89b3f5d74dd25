// What a served world is made with, beside its scene.
#pragma once

#include <cstdint>
#include <optional>

#include "scene/lengths.hpp"
#include "server/recording_options.hpp"
#include "server/server_limits.hpp"

namespace enfilade::server {

struct WorldOptions {
  ServerLimits limits;
  scene::Lengths lengths;
  std::uint32_t auditEvery = 0;            ///< ticks; 0: none is audited
  std::optional<RecordingOptions> record;  ///< nullopt: nothing is written down
};

}  // namespace enfilade::server
