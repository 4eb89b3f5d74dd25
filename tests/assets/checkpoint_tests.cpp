// Tests of checkpoints of large worlds: the bundled building, and the parts feeder.
#include "assets/building.hpp"
#include "assets/feeder.hpp"
#include "assets/landmarks.hpp"
#include "scene/import/bodies/sidecar.hpp"
#include "tests/scene/checkpoint_fixture.hpp"

namespace enfilade::assets {
namespace {

using namespace scene::testing;

TEST(CheckpointOfAssets, ARestoredWalkThroughTheBuildingIsBitEqual) {
  const auto building = std::make_shared<const scene::Scene>(makeBuilding());
  std::map<std::uint64_t, TickCommands> commands;
  for (int i = 0; i < 6; ++i) {
    const std::string name = "w" + std::to_string(i);
    const scene::Vec3 room = landmarks::kRooms.at(static_cast<std::size_t>(i));
    scene::Spawn spawn;
    spawn.position = room + scene::Vec3(0, 0.05, 0.5);
    commands[1].avatars.push_back({name, spawn, 1});
    scene::Walk walk{{landmarks::kDoors.at(static_cast<std::size_t>(i) + 2),
                      landmarks::kBeforeBench, landmarks::kInBench, landmarks::kStart},
                     1.4 + 0.2 * i};
    commands[1].avatars.push_back({name, walk, 2});
    commands[400].avatars.push_back({name, scene::Drive{{2, 0, 0.3 * i - 1}}, 3});
  }
  compareCopies(building, {}, commands, 700, {150, 333, 399}, 300);
}

TEST(CheckpointOfAssets, ARestoredPartsFeederIsBitEqual) {
  scene::Model model = makeFeeder({40, 1});
  applySidecar(model, makeFeederSidecar(), "feeder.walk.json");
  const auto feeder = std::make_shared<const scene::Scene>(std::move(model));
  compareCopies(feeder, {}, {}, 150, {5, 60}, 90);
}

}  // namespace
}  // namespace enfilade::assets
