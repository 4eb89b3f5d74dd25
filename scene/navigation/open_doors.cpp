#include "scene/navigation/open_doors.hpp"

#include <algorithm>
#include <utility>

#include "scene/world/world.hpp"

namespace enfilade::scene {

std::shared_ptr<const Snapshot> makeSnapshotWithOpenDoors(std::shared_ptr<const Scene> scene,
                                                          const WorldSettings& settings) {
  constexpr double kMaxSeconds = 30;  // a door that takes longer stays where it is
  World world(std::move(scene), settings);
  bool hasDoors = false;
  for (const BodySpec& body : world.scene().model().bodies) {
    if (body.kind != BodyKind::hinged && body.kind != BodyKind::sliding) continue;
    BodyCommand command;
    command.body = body.name;
    command.action = BodyCommand::Action::open;
    submitBodyCommand(world, std::move(command));
    hasDoors = true;
  }
  const int maxTicks = hasDoors ? static_cast<int>(kMaxSeconds / settings.tickDuration) : 0;
  for (int tick = 0; tick < maxTicks; ++tick) {
    tickWorld(world);
    const auto& bodies = *world.snapshot()->bodies;
    if (std::ranges::none_of(bodies, [&](const BodySnapshot& body) {
          const BodyKind kind = world.scene().model().bodies[body.index].kind;
          return body.moving && (kind == BodyKind::hinged || kind == BodyKind::sliding);
        }))
      break;
  }
  return world.snapshot();
}

}  // namespace enfilade::scene
