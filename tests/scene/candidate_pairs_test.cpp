// Compares the candidate pairs of concave bodies with the double loop over their parts.
#include "scene/world/bodies/candidate_pairs.hpp"

#include <gtest/gtest.h>

#include "scene/physics/physics_world.hpp"
#include "scene/world/bodies/step_dynamic_bodies.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

constexpr std::uint32_t kParts = 24;

/// The boxes of a comb: a spine along x and, at every second place, a tooth along z.
std::vector<NamedBox> comb(const std::string& name, const Vec3& at) {
  std::vector<NamedBox> boxes;
  for (std::uint32_t i = 0; i < kParts; ++i) {
    const double x = 0.1 * (i / 2);
    const Vec3 min(x, 0, i % 2 == 0 ? 0 : 0.12), max(x + 0.06, 0.08, i % 2 == 0 ? 0.1 : 0.6);
    boxes.push_back({name + std::to_string(i), at + min, at + max});
  }
  return boxes;
}

Model twoCombs() {
  std::vector<NamedBox> boxes = comb("a", {0, 50, 0});
  for (const NamedBox& box : comb("b", {0.03, 50.4, 0.2})) boxes.push_back(box);
  boxes.push_back(floorBox());
  Model model = boxModel(boxes);
  for (const std::uint32_t first : {0u, kParts}) {
    std::vector<std::uint32_t> objects;
    for (std::uint32_t i = 0; i < kParts; ++i) objects.push_back(first + i);
    BodySpec spec = bodySpec(first == 0 ? "a" : "b", BodyKind::rigid, objects);
    spec.velocity = first == 0 ? Vec3(0, 0, 0) : Vec3(0.5, -1, 0);
    spec.angularVelocity = first == 0 ? Vec3(0.5, 2, 3) : Vec3(-2, 1, 0.5);
    model.bodies.push_back(std::move(spec));
  }
  return model;
}

std::vector<PartPairKey> findPairsByDoubleLoop(const WorldData& world) {
  const auto& bodies = world.dynamicBodies.physicsWorld.bodies;
  const double margin = computeContactQueryMargin(world.settings);
  std::vector<PartPairKey> keys;
  if (!mayMeet(computeMotionSphere(bodies[0]), computeMotionSphere(bodies[1]), margin)) return keys;
  const std::vector<Aabb>&a = world.bodies[0].boxes.parts, &b = world.bodies[1].boxes.parts;
  for (std::uint32_t i = 0; i < a.size(); ++i)
    for (std::uint32_t k = 0; k < b.size(); ++k)
      if (overlaps(inflated(a[i], margin + bodies[0].maxStepDisplacement),
                   inflated(b[k], margin + bodies[1].maxStepDisplacement)))
        keys.push_back({0, 1, i, k});
  return keys;
}

/// Pairs that the solver would examine in the next tick.
std::vector<PartPairKey> collectNextPairs(WorldData& world) {
  planDynamicMotion(world);
  world.broadPhase.update();
  collectPairs(world, nullptr);
  std::vector<PartPairKey> keys;
  for (const BodyPair& pair : world.dynamicBodies.physicsWorld.pairs) keys.push_back(pair.key);
  return keys;
}

TEST(CandidatePairs, OfTumblingConcaveBodiesEqualTheDoubleLoop) {
  WorldSettings settings;
  settings.gravity = 0;
  BodyFixture t(twoCombs(), settings);
  WorldData& world = t.world.data();
  ASSERT_EQ(world.bodies[0].boxes.parts.size(), kParts);
  std::size_t pairs = 0, withFront = 0;
  for (int tick = 0; tick < 90; ++tick) {  // then they are asleep
    t.step();
    const auto found = collectNextPairs(world);
    ASSERT_EQ(found, findPairsByDoubleLoop(world)) << "tick " << tick;
    pairs += found.size();
    withFront += world.dynamicBodies.partFronts[0].size();
  }
  EXPECT_GT(pairs, 200u);
  EXPECT_GT(withFront, 20u);
}

}  // namespace
}  // namespace enfilade::scene
