// The tick as a sequence of timed stages. Each stage is implemented in the file of its subject.
#pragma once

#include <memory>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Advances the world by WorldSettings::tickDuration.
TickReport runTick(WorldData& world);

/// The snapshot of the last tick.
std::shared_ptr<const Snapshot> makeSnapshot(const WorldData& world);

}  // namespace enfilade::scene
