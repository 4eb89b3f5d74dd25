// PathStep: where a walk steps up or down, as at a kerb, a threshold or each tread of a stair.
#pragma once

#include <vector>

#include "scene/navigation/mesh/agent.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

struct PathStep {
  Vec3 position = Vec3::Zero();  ///< on the floor before it, scene frame, metres
  double rise = 0;               ///< metres; negative: down
};

/// The steps of the floor below places of traceFeet(), at least 2 cm and at most
/// WorldSettings::stepHeight high. A step is steeper than what can be walked, and the feet rise or
/// sink with it: they pass over a narrow gap.
std::vector<PathStep> findSteps(const WorldData& world, const NavigationAgent& agent,
                                const std::vector<Vec3>& traced);

}  // namespace enfilade::scene
