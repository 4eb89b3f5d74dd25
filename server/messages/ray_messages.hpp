// Conversion of ray queries from messages, and of ray hits to messages.
#pragma once

#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/world/queries/ray_caster.hpp"
#include "server/base/server_limits.hpp"

namespace enfilade::server {

/// A RayQuery with all names and defaults resolved.
struct ResolvedRayQuery {
  std::vector<scene::Ray> rays;
  scene::RayFilter filter;
  bool onlyBlocked = false;
  bool packed = false;
  std::uint32_t columns = 0, rows = 0;  ///< of a scan; 0: individual rays
};

/// Returns the resolved query, or an error that names the field.
std::variant<ResolvedRayQuery, v1::Error> rayQueryFromProto(const v1::RayQuery& query,
                                                            const scene::Snapshot& snapshot,
                                                            const ServerLimits& limits);

/// Casts the rays; `caster` must match `snapshot`. The hits of a scan or of a packed query are
/// written to `attachment`.
v1::RayReply castRays(const ResolvedRayQuery& resolved, const scene::RayCaster& caster,
                      const scene::Scene& scene, const scene::Snapshot& snapshot,
                      std::vector<std::uint8_t>& attachment);

}  // namespace enfilade::server
