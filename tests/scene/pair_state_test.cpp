// How any two stand to one another, beside brute force over all their parts and beside what ticks
// find.
#include "scene/pair_state.hpp"

#include <random>

#include "tests/scene/trial.hpp"

namespace enfilade::scene::testing {
namespace {

/// An object of triangles that are strewn in a ball: concave, and not closed.
Object strewn(Model& model, std::mt19937& random, const Vec3& middle, double spread) {
  std::normal_distribution<double> coordinate(0, spread);
  const auto near = [&](const Vec3& place) {
    return Vec3(place + Vec3(coordinate(random), coordinate(random), coordinate(random)));
  };
  Mesh mesh;
  for (std::uint32_t i = 0; i < 30; ++i) {
    const Vec3 corner = near(middle);
    for (int k = 0; k < 3; ++k) mesh.positions.push_back(near(corner).cast<float>());
    for (std::uint32_t k = 0; k < 3; ++k) mesh.indices.push_back(3 * i + k);
  }
  model.meshes.push_back(std::move(mesh));
  return {"strewn" + std::to_string(model.objects.size()),
          "",
          {static_cast<std::uint32_t>(model.meshes.size() - 1)},
          Eigen::Affine3d::Identity()};
}

/// The slow twin: every part with every part.
collision::Decision bruteForce(const ObjectParts& a, const ObjectParts& b) {
  std::optional<collision::Decision> nearest;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    for (std::uint32_t k = 0; k < b.size(); ++k) {
      collision::FeatureCache cache;
      const collision::Decision one = collision::decide(a.body(i), b.body(k), cache);
      const bool nearer = !nearest || one.verdict > nearest->verdict ||
                          (one.verdict == nearest->verdict && one.distance < nearest->distance);
      if (nearer) nearest = one;
    }
  }
  return nearest.value();
}

TEST(PairState, TwoStillMeshesAreAsFarApartAsTheirNearestParts) {
  std::mt19937 random(7);
  int apart = 0;
  constexpr int kPairs = 40;
  for (int i = 0; i < kPairs; ++i) {
    Model model = boxModel({});
    model.objects.push_back(strewn(model, random, Vec3::Zero(), 0.3));
    model.objects.push_back(strewn(model, random, Vec3(1.2 + 0.05 * i, 0.4, 0), 0.3));
    const Scene scene(std::move(model));
    const World world(std::shared_ptr<const Scene>(std::shared_ptr<void>(), &scene));
    const SceneThen then{scene, *world.snapshot()};
    const auto found = std::get<PairState>(stateOfPair(then, 1, 2));
    const auto back = std::get<PairState>(stateOfPair(then, 2, 1));
    const auto refined = std::get<PairState>(stateOfPair(then, 1, 2, true));
    const collision::Decision truth = bruteForce(scene.parts(0), scene.parts(1));
    ASSERT_EQ(found.decision.verdict, truth.verdict);
    EXPECT_EQ(back.decision.verdict, truth.verdict);
    EXPECT_NEAR(found.decision.distance, truth.distance, 1e-12);
    EXPECT_NEAR(back.decision.distance, truth.distance, 1e-12);
    EXPECT_NEAR(refined.decision.distance, truth.distance, 1e-12);
    EXPECT_NEAR((found.decision.pointA - found.decision.pointB).norm(), truth.distance, 1e-9);
    apart += truth.verdict == collision::Verdict::separated ? 1 : 0;
  }
  EXPECT_GT(apart, kPairs / 4);
  EXPECT_LT(apart, kPairs);
}

TEST(PairState, BoxesHaveTheDistancesThatWereBuilt) {
  Trial trial({floorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}, {"inside", {5.1, 1, 0}, {6, 2, 1}}});
  const SceneThen then{trial.world.scene(), *trial.world.snapshot()};
  EXPECT_EQ(entityNamed(then, "wall"), 2u);
  EXPECT_EQ(entityNamed(then, "window"), 0u);
  EXPECT_EQ(entityWith(then, 9), 0u);
  const auto verdict = [&](EntityId a, EntityId b) {
    return std::get<PairState>(stateOfPair(then, a, b)).decision.verdict;
  };
  EXPECT_EQ(verdict(1, 2), collision::Verdict::touching);
  EXPECT_EQ(verdict(2, 3), collision::Verdict::penetrating);
  const auto above = std::get<PairState>(stateOfPair(then, 1, 3, true));
  EXPECT_EQ(above.decision.distance, 1.0);
  EXPECT_EQ(above.decision.normal, Vec3(0, 1, 0));
}

TEST(PairState, WhatIsNearIsWhatTheTickFound) {
  Trial trial({floorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}, {"post", {0, 0, 2}, {0.2, 3, 2.2}}});
  trial.order("ann", Spawn{Vec3(0, 0.001, 0), 0});
  trial.order("ann", Walk{{Vec3(8, 0, 0)}, 2});
  for (int i = 0; i < 240; ++i) {
    trial.step();
    const SceneThen then{trial.world.scene(), *trial.world.snapshot()};
    const EntityId ann = entityNamed(then, "ann");
    const auto near = std::get<Near>(nearTo(then, ann, 2 * trial.world.lengths().epsilon));
    std::set<std::pair<EntityId, EntityId>> pairs;
    for (const PairState& one : near.found) pairs.insert({one.a, one.b});
    ASSERT_EQ(pairs, trial.open) << "tick " << then.snapshot.tick;
  }
  EXPECT_EQ(trial.open.size(), 2u) << "the wall was never reached";
}

TEST(PairState, NobodyTouchesBeforeTheTimeThatWasProved) {
  Trial trial({floorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}});
  trial.order("ann", Spawn{Vec3(0, 0.001, 0), 0});
  trial.order("ann", Walk{{Vec3(8, 0, 3)}, 2});
  trial.ticks(30);
  const Lengths& lengths = trial.world.lengths();
  for (int i = 0; i < 60; ++i) {
    trial.step();
    const SceneThen then{trial.world.scene(), *trial.world.snapshot()};
    const EntityId ann = entityNamed(then, "ann");
    const auto apart = [&](Assume assume, double least) {
      return std::get<TimeApart>(timeApart(then, lengths, ann, 2, assume, least));
    };
    const TimeApart now = apart(Assume::presentMotion, 0);
    EXPECT_TRUE(now.again.proved);
    // 2 m/s on the way to (8, 3), of which this is the part towards the wall.
    const double speed = 2 * 8 / std::hypot(8, 3);
    EXPECT_NEAR(now.contact, now.now.decision.distance / speed, 0.02);
    EXPECT_LT(apart(Assume::anyCommand, 0).contact, now.contact);
    EXPECT_FALSE(apart(Assume::presentMotion, 9).again.proved);
    if (trial.open.contains({ann, 2})) break;
  }
}

}  // namespace
}  // namespace enfilade::scene::testing
