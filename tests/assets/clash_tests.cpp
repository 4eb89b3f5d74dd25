// Tests of the bundled building: no kinematic body hits another object.
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
  const std::string sidecar = makeSidecarText(model, parts);
  applySidecar(model, sidecar, "building.walk.json");
  BodyFixture run(std::move(model));
  std::size_t driven = 0;
  for (const bool high : {true, false}) {
    for (const scene::Body& body : run.world.data().bodies) {
      const scene::BodySpec& spec = *body.spec;
      if (!scene::isKinematic(spec.kind)) continue;
      scene::BodyCommand command;
      command.body = spec.name;
      const bool isPath = spec.kind == scene::BodyKind::path;
      command.action =
          isPath ? (high ? scene::BodyCommand::Action::run : scene::BodyCommand::Action::stop)
                 : scene::BodyCommand::Action::moveTo;
      command.target = high ? spec.high : spec.low;
      run.submit(command);
      ++driven;
    }
    run.runUntilIdle();
  }
  EXPECT_GT(driven, 50u);
  for (const scene::ContactEvent& event : run.events) {
    const std::string a = findEntityName(run.world, event.a),
                      b = findEntityName(run.world, event.b);
    const bool settles = a == "ground/study/armchair" && b == "building/ground/study/floor";
    EXPECT_TRUE(settles) << a << " meets " << b << " in tick " << event.tick;
  }
}

}  // namespace
}  // namespace enfilade::assets
