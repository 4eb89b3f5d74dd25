// Rays as messages ask for them, and what they met as messages.
#pragma once

#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/world/queries/ray_caster.hpp"
#include "server/base/server_limits.hpp"

namespace enfilade::server {

/// A RayQuery with all its names and defaults worked out.
struct AskedRays {
  std::vector<scene::Ray> rays;
  scene::RayFilter filter;
  bool onlyBlocked = false;
  bool packed = false;
  std::uint32_t columns = 0, rows = 0;  ///< of a scan; 0: rays one by one
};

/// Or what is wrong with it, naming the field.
std::variant<AskedRays, v1::Error> raysFrom(const v1::RayQuery& query,
                                            const scene::Snapshot& snapshot,
                                            const ServerLimits& limits);

/// Casts them, `caster` being where the snapshot is. `attachment` gets what a scan or a packed
/// query met.
v1::RayReply answerOf(const AskedRays& asked, const scene::RayCaster& caster,
                      const scene::Scene& scene, const scene::Snapshot& snapshot,
                      std::vector<std::uint8_t>& attachment);

}  // namespace enfilade::server
