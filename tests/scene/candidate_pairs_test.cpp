// Compares the candidate pairs of concave bodies with the double loop over their parts. With one
// another, with a static mesh, and with a kinematic body.
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
std::vector<NamedBox> makeComb(const std::string& name, const Vec3& at) {
  std::vector<NamedBox> boxes;
  for (std::uint32_t i = 0; i < kParts; ++i) {
    const double x = 0.1 * (i / 2);
    const Vec3 min(x, 0, i % 2 == 0 ? 0 : 0.12), max(x + 0.06, 0.08, i % 2 == 0 ? 0.1 : 0.6);
    boxes.push_back({name + std::to_string(i), at + min, at + max});
  }
  return boxes;
}

Model makeTwoCombs() {
  std::vector<NamedBox> boxes = makeComb("a", {0, 50, 0});
  for (const NamedBox& box : makeComb("b", {0.03, 50.4, 0.2})) boxes.push_back(box);
  boxes.push_back(makeFloorBox());
  Model model = makeBoxModel(boxes);
  for (const std::uint32_t first : {0u, kParts}) {
    std::vector<std::uint32_t> objects;
    for (std::uint32_t i = 0; i < kParts; ++i) objects.push_back(first + i);
    BodySpec spec = makeBodySpec(first == 0 ? "a" : "b", BodyKind::rigid, objects);
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
      if (overlaps(inflate(a[i], margin + bodies[0].maxStepDisplacement),
                   inflate(b[k], margin + bodies[1].maxStepDisplacement)))
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
  BodyFixture t(makeTwoCombs(), settings);
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

/// A sheet of waves below a tumbling comb, and a second comb that slides past it on a path.
Model makeCombOverWaves() {
  std::vector<NamedBox> boxes = makeComb("a", {0, 0.35, 0});
  for (const NamedBox& box : makeComb("b", {1.4, 0.4, 0.1})) boxes.push_back(box);
  boxes.push_back(makeFloorBox());
  Model model = makeBoxModel(boxes);
  Mesh& waves = model.meshes.back();
  waves = {};
  constexpr std::uint32_t kSide = 40;
  for (std::uint32_t i = 0; i <= kSide; ++i)
    for (std::uint32_t k = 0; k <= kSide; ++k)
      waves.positions.emplace_back(0.1 * i - 1, (i + k) % 2 == 0 ? 0.1 : 0.0, 0.1 * k - 2);
  for (std::uint32_t i = 0; i < kSide; ++i)
    for (std::uint32_t k = 0; k < kSide; ++k) {
      const std::uint32_t at = i * (kSide + 1) + k, next = at + kSide + 1;
      for (const std::uint32_t corner : {at, at + 1, next, next, at + 1, next + 1})
        waves.indices.push_back(corner);
    }
  std::vector<std::uint32_t> falling, sliding;
  for (std::uint32_t i = 0; i < kParts; ++i) falling.push_back(i), sliding.push_back(kParts + i);
  model.bodies.push_back(makeBodySpec("a", BodyKind::rigid, falling));
  model.bodies.back().angularVelocity = Vec3(0.5, 2, 3);
  model.bodies.push_back(makeBodySpec("b", BodyKind::path, sliding));
  model.bodies.back().loops = true;
  model.bodies.back().keys = {{0, Vec3::Zero(), 0}, {1, Vec3(-1.2, 0, 0), 0}, {2, Vec3::Zero(), 0}};
  return model;
}

TEST(CandidatePairs, WithAMeshAndWithAKinematicBodyEqualTheDoubleLoop) {
  BodyFixture t(makeCombOverWaves());
  WorldData& world = t.world.data();
  const std::uint32_t waves = 2 * kParts;  // the object
  const CollisionGeometry& mesh = world.scene->collisionGeometry(waves);
  const double margin = computeContactQueryMargin(world.settings);
  std::size_t meshPairs = 0, kinematicPairs = 0, fronts = 0;
  for (int tick = 0; tick < 60; ++tick) {  // then it is asleep
    t.step();
    const auto found = collectNextPairs(world);
    const Body &falling = world.bodies[0], &sliding = world.bodies[1];
    const auto& physics = world.dynamicBodies.physicsWorld.bodies;
    std::vector<PartPairKey> expectedMesh, expectedKinematic, withMesh, withKinematic;
    for (const PartPairKey& key : found) {
      const EntityId other = world.dynamicBodies.entities[key.b];
      if (other == waves + 1) withMesh.push_back({0, 0, key.partA, key.partB});
      if (other == sliding.id) withKinematic.push_back({0, 0, key.partA, key.partB});
    }
    for (std::uint32_t part = 0; part < kParts; ++part) {
      const Aabb box = inflate(getPartBox(falling, part), margin + physics[0].maxStepDisplacement);
      for (std::uint32_t i = 0; i < mesh.size(); ++i)
        if (overlaps(mesh.box(i), falling.motionBounds) && overlaps(mesh.box(i), box))
          expectedMesh.push_back({0, 0, part, i});
      if (!overlaps(falling.motionBounds, sliding.motionBounds)) continue;
      for (std::uint32_t i = 0; i < kParts; ++i)
        if (overlaps(inflate(getPartBox(sliding, i),
                             margin + 2 * sliding.kinematicTarget.maxDisplacement),
                     box))
          expectedKinematic.push_back({0, 0, part, i});
    }
    ASSERT_EQ(withMesh, expectedMesh) << "tick " << tick;
    ASSERT_EQ(withKinematic, expectedKinematic) << "tick " << tick;
    meshPairs += withMesh.size();
    kinematicPairs += withKinematic.size();
    fronts += world.dynamicBodies.partFronts[0].size();
  }
  EXPECT_GT(fronts, 20u);
  EXPECT_GT(meshPairs, 500u);
  EXPECT_GT(kinematicPairs, 50u);
}

}  // namespace
}  // namespace enfilade::scene
