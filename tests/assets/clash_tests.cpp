// The bundled house is right: nothing that is driven in it runs into anything else.
#include "assets/building.hpp"
#include "assets/sidecar_writer.hpp"
#include "scene/import/bodies/sidecar.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::assets {
namespace {

using namespace scene::testing;

TEST(BuildingClashes, DoorsAndLiftTouchNothingOnTheirWays) {
  std::vector<MovingPart> parts;
  scene::Model model = makeBuilding({}, &parts);
  const std::string sidecar = sidecarText(model, parts);
  applySidecar(model, sidecar, "building.walk.json");
  BodyTrial trial(std::move(model));
  std::size_t driven = 0;
  for (const bool high : {true, false}) {
    for (const scene::Body& body : trial.world.state().bodies) {
      const scene::BodySpec& spec = *body.spec;
      if (!scene::isKinematic(spec.kind)) continue;
      scene::BodyCommand command;
      command.body = spec.name;
      const bool isPath = spec.kind == scene::BodyKind::path;
      command.action =
          isPath ? (high ? scene::BodyCommand::Action::run : scene::BodyCommand::Action::stop)
                 : scene::BodyCommand::Action::to;
      command.to = high ? spec.high : spec.low;
      trial.tell(command);
      ++driven;
    }
    trial.untilIdle();
  }
  EXPECT_GT(driven, 50u);
  for (const scene::ContactEvent& event : trial.events) {
    const std::string a = nameOf(trial.world, event.a), b = nameOf(trial.world, event.b);
    const bool settles = a == "ground/study/armchair" && b == "building/ground/study/floor";
    EXPECT_TRUE(settles) << a << " meets " << b << " in tick " << event.tick;
  }
}

}  // namespace
}  // namespace enfilade::assets
