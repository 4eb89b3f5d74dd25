// Boxes of moving bodies: the parts of a body get boxes only while the body overlaps something.
#include <gtest/gtest.h>

#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

/// A shuttle of four bars that turns on a path, high above the floor; with or without a post near
/// it.
Model makeShuttleModel(bool withPost) {
  std::vector<NamedBox> boxes;
  for (int i = 0; i < 4; ++i)
    boxes.push_back(
        {"bar" + std::to_string(i), Vec3(0.3 * i, 10, 0), Vec3(0.3 * i + 0.2, 10.1, 1)});
  boxes.push_back(makeFloorBox());
  if (withPost) boxes.push_back({"post", Vec3(0, 9.5, 1.06), Vec3(0.2, 10.5, 1.3)});
  Model model = makeBoxModel(boxes);
  BodySpec shuttle = makeBodySpec("shuttle", BodyKind::path, {0, 1, 2, 3});
  shuttle.axis = Vec3::UnitY();
  shuttle.anchor = Vec3(0.5, 10, 0.5);
  shuttle.keys = {{0, Vec3::Zero(), 0}, {2, Vec3(0, 0, 0.1), 1}};
  shuttle.autoStart = true;
  model.bodies.push_back(shuttle);
  return model;
}

struct BoxWork {
  std::uint64_t vertices = 0, parts = 0;
};

BoxWork countWork(bool withPost) {
  BodyFixture t(makeShuttleModel(withPost));
  BoxWork work;
  for (int i = 0; i < 30; ++i) {
    const TickReport report = t.step();
    work.vertices += report.verticesLookedAt;
    work.parts += report.partBoxesMade;
  }
  return work;
}

TEST(BodyBoxes, OfPartsAreMadeOnlyWhileTheBodyOverlapsSomething) {
  const BoxWork alone = countWork(false), nearPost = countWork(true);
  EXPECT_EQ(alone.parts, 0u);
  EXPECT_GT(alone.vertices, 0u);
  EXPECT_GE(nearPost.parts, 80u);
  EXPECT_GT(nearPost.vertices, alone.vertices);
}

TEST(BodyBoxes, OfAStationaryBodyAreMadeOnceForAWalkerNextToIt) {
  Model model = makeBoxModel({{"left", Vec3(0, 0, 0), Vec3(0.2, 2, 1)},
                              {"right", Vec3(0.3, 0, 0), Vec3(0.5, 2, 1)},
                              makeFloorBox()});
  BodySpec doors = makeBodySpec("doors", BodyKind::sliding, {0, 1});
  doors.high = 1;
  model.bodies.push_back(doors);
  BodyFixture t(std::move(model));
  t.order("ann", Spawn{Vec3(-0.4, 0.001, 0.5), 0, 0.3, 1.75});
  t.runTicks(5);
  t.order("ann", Walk{{Vec3(-0.4, 0, 2)}, 1});
  for (int i = 0; i < 30; ++i) {
    const TickReport report = t.step();
    EXPECT_EQ(report.verticesLookedAt, 0u) << "tick " << i;
    EXPECT_EQ(report.partBoxesMade, 0u) << "tick " << i;
  }
}

TEST(BodyBoxes, ContainEveryVertexAndTheBoxesOfTheParts) {
  BodyFixture t(makeShuttleModel(true));
  for (int i = 0; i < 60; ++i) {
    t.step();
    const Body& body = t.world.data().bodies[0];
    for (std::uint32_t part = 0; part < getPartCount(body); ++part) {
      const Aabb box = getPartBox(body, part);
      EXPECT_TRUE(contains(inflate(body.boxes.whole, 1e-12), box));
      for (const Vec3& v : body.shape->parts[part].vertices) {
        const Vec3 at = body.rotation * v + body.position;
        EXPECT_TRUE(contains(box, Aabb{at, at})) << "tick " << i << " part " << part;
      }
    }
  }
}

}  // namespace
}  // namespace enfilade::scene
