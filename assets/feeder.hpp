// The bundled parts feeder: small convex parts in a vibrating tray, on a stand that avatars can
// walk around. Our own work; the same seed gives the same model everywhere.
#pragma once

#include <string>

#include "scene/model/model.hpp"

namespace enfilade::assets {

struct FeederOptions {
  std::size_t parts = 1000;  ///< 1 to 20000
  std::uint64_t seed = 1;
};

/// Throws std::invalid_argument for a number of parts out of range.
scene::Model makeFeeder(const FeederOptions& options = {});

/// Sidecar with the tray as a path of 15 Hz, 2 mm up and 0.5 mm sideways, and the parts as dynamic
/// bodies.
std::string makeFeederSidecar();

}  // namespace enfilade::assets
