// Whether the broad phase of a live world is right: the pairs that it holds in a tick beside brute
// force over the same boxes. Reads the world only: the same commands give the same bits with it.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// How many ticks may lie between two audits.
inline constexpr std::uint32_t kSparsestAudit = 1'000'000;

/// A pair that the broad phase should hold and does not, or the other way round.
struct AuditFinding {
  enum class Kind : std::uint8_t {
    missed,  ///< the boxes overlap, and the broad phase does not know: a contact may be lost
    extra    ///< they do not: work for nothing
  };
  Kind kind = Kind::missed;
  EntityId mover = 0;  ///< an avatar
  EntityId other = 0;  ///< a still object or an avatar; 0 when there is none (any more)
  Box moverBox;        ///< what the avatar can reach in the tick; scene frame, metres
  Box otherBox;        ///< empty when `other` is 0
};

struct TickAudit {
  std::uint32_t movers = 0;            ///< avatars whose pairs were compared
  std::uint64_t pairs = 0;             ///< that brute force found for them
  std::vector<AuditFinding> findings;  ///< in order of the avatars; none: the tick was right
  double seconds = 0;                  ///< that it took; in no stage of the tick
};

}  // namespace enfilade::scene
