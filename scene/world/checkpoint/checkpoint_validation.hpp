// What must be true of a world that was read, so that nothing in it points beyond what there is: a
// checksum proves that bytes are as somebody wrote them, not who did.
#pragma once

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// All but the free bodies' solids, which are not made yet. Throws CheckpointError.
void checkRead(const WorldState& world);
/// Solids and pairs.
void checkRigids(const WorldState& world);

}  // namespace enfilade::scene
