// Whom a driven body takes along in a tick, and who may be in its way: free bodies that rest on it,
// avatars that stand on it or on those, and avatars near them.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// A free body that rests on the body, or on such a one. It is taken to rise as its middle is
/// carried, straight up: what tilts, or is held, is left to the solver.
struct Load {
  std::uint32_t index;             ///< into WorldState::bodies
  Vec3 middle;                     ///< in the carrier's frame
  double height;                   ///< of the middle, when the tick began
  double risen;                    ///< metres, by other driven bodies in this tick
  double rise = 0;                 ///< metres, with the carrier so far
  double toRise = 0;               ///< metres, on the way at hand
  std::vector<Avatar*> near = {};  ///< whom it may meet

  /// Where it is already; the way at hand may end below.
  double from() const { return std::max(rise, risen); }
  bool isLifted() const { return rise + toRise > from(); }
};

struct Rider {
  Avatar* avatar;
  Vec3 contact;         ///< on the body, in its frame
  bool onLoad;          ///< stands on a load, not on the body itself
  bool lifted = false;  ///< all of the way at hand: no load comes nearer
};

/// Who goes with the driven body in this tick, or may be in its way.
struct Company {
  std::vector<Load> loads;  ///< near somebody
  std::vector<Avatar*> near;
  std::vector<Rider> riders;
};

/// Which free body stands on which body: the lower one first; ascending.
using Supports = std::vector<std::pair<EntityId, EntityId>>;

/// Of the last tick. None where there is nobody whom they could lift.
Supports supportsOf(const WorldState& world);

Company companyOf(WorldState& world, const Body& body, const Supports& supports);

}  // namespace enfilade::scene
