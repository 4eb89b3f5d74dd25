// How any two stand to one another, beside brute force over all their parts and beside what ticks
// find.
#include "scene/world/queries/proximity_query.hpp"

#include <cmath>
#include <random>

#include "tests/scene/world_fixture.hpp"

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

/// A world without avatars, to be asked about.
struct Still {
  explicit Still(Model model) : world(std::make_shared<const Scene>(std::move(model))) {}
  World world;
  SceneIndex index{sharedScene(world)};
  SceneThen then{index, *world.snapshot()};
};

PairState stateOf(const SceneThen& then, EntityId a, EntityId b, bool refined = false) {
  std::size_t work = kMostWork;
  return std::get<PairState>(stateOfPair(then, a, b, refined, work));
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
    const Still still(std::move(model));
    const PairState found = stateOf(still.then, 1, 2), back = stateOf(still.then, 2, 1),
                    refined = stateOf(still.then, 1, 2, true);
    const Scene& scene = still.world.scene();
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

TEST(PairState, LargeMeshesThatAreFarApartCostLittle) {
  // Two hilly plates of 40,000 triangles each, 3 m apart: brute force would be 1.6e9 decisions.
  Model model = boxModel({});
  for (const double height : {0.0, 3.0}) {
    Mesh mesh;
    constexpr std::uint32_t kSide = 142;
    for (std::uint32_t i = 0; i < kSide; ++i)
      for (std::uint32_t k = 0; k < kSide; ++k)
        mesh.positions.emplace_back(
            0.1F * static_cast<float>(i),
            static_cast<float>(height + 0.3 * std::sin(0.3 * i) * std::cos(0.2 * k + height)),
            0.1F * static_cast<float>(k));
    for (std::uint32_t i = 0; i + 1 < kSide; ++i)
      for (std::uint32_t k = 0; k + 1 < kSide; ++k)
        for (const std::uint32_t corner : {0u, 1u, kSide, kSide, 1u, kSide + 1})
          mesh.indices.push_back(i * kSide + k + corner);
    model.meshes.push_back(std::move(mesh));
    model.objects.push_back({"plate" + std::to_string(model.objects.size()),
                             "",
                             {static_cast<std::uint32_t>(model.meshes.size() - 1)},
                             Eigen::Affine3d::Identity()});
  }
  const Still still(std::move(model));
  std::size_t work = kMostWork;
  const auto found = std::get<PairState>(stateOfPair(still.then, 1, 2, false, work));
  EXPECT_NEAR(found.decision.distance, 2.4015, 1e-3);
  EXPECT_LT(kMostWork - work, kMostWork / 100);
  std::size_t little = 100;
  const auto none = stateOfPair(still.then, 1, 2, false, little);
  ASSERT_TRUE(std::holds_alternative<NoAnswer>(none));
  EXPECT_EQ(std::get<NoAnswer>(none).why, NoAnswer::Why::tooComplex);
  EXPECT_EQ(little, 0u) << "it stopped before there was nothing left to take";
  little = 100;
  const Near near = std::get<Near>(nearTo(still.then, 1, 5, little));
  EXPECT_TRUE(near.found.empty());
  EXPECT_EQ(near.leftOut, 1u);
}

/// A closed convex mesh with so many corners on a ball of 1 m.
Mesh ballMesh(std::mt19937& random, std::size_t corners, const Vec3& middle) {
  std::normal_distribution<double> coordinate;
  std::vector<Vec3> points;
  while (points.size() < corners)
    points.push_back(Vec3(coordinate(random), coordinate(random), coordinate(random)).normalized());
  const collision::Hull hull = collision::buildHull(points);
  Mesh mesh;
  for (const Vec3& vertex : hull.vertices)
    mesh.positions.push_back(Vec3(vertex + middle).cast<float>());
  for (const auto& face : hull.faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      for (const std::uint32_t corner : {face[0], face[i - 1], face[i]})
        mesh.indices.push_back(corner);
  return mesh;
}

TEST(PairState, TheDepthOfVeryRoundThingsIsMoreThanOneAnswerIsGiven) {
  std::mt19937 random(3);
  for (const std::size_t corners : {20u, 400u}) {
    Model model = boxModel({{"a", Vec3::Zero(), Vec3::Ones()}, {"b", Vec3::Zero(), Vec3::Ones()}});
    model.meshes = {ballMesh(random, corners, Vec3::Zero()),
                    ballMesh(random, corners, Vec3(1.2, 0, 0))};
    const Still still(std::move(model));
    ASSERT_EQ(still.world.scene().parts(0).hullCount(), 1u);
    std::size_t work = kMostWork;
    const auto state = stateOfPair(still.then, 1, 2, true, work);
    ASSERT_EQ(std::holds_alternative<PairState>(state), corners == 20);
    if (corners == 20) {
      EXPECT_GT(std::get<PairState>(state).penetration, 0.3);
    }
    EXPECT_EQ(stateOf(still.then, 1, 2).decision.verdict, collision::Verdict::penetrating);
  }
}

TEST(PairState, BoxesHaveTheDistancesThatWereBuilt) {
  const Still still(boxModel(
      {floorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}, {"inside", {5.1, 1, 0}, {6, 2, 1}}}));
  const SceneThen& then = still.then;
  EXPECT_EQ(entityNamed(then, "wall"), 2u);
  EXPECT_EQ(entityNamed(then, "window"), 0u);
  EXPECT_EQ(entityWith(then, 9), 0u);
  EXPECT_EQ(stateOf(then, 1, 2).decision.verdict, collision::Verdict::touching);
  EXPECT_EQ(stateOf(then, 2, 3).decision.verdict, collision::Verdict::penetrating);
  const PairState above = stateOf(then, 1, 3, true);
  EXPECT_EQ(above.decision.distance, 1.0);
  EXPECT_EQ(above.decision.normal, Vec3(0, 1, 0));
}

TEST(PairState, WhatIsNearIsWhatTheTickFound) {
  Trial trial({floorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}, {"post", {0, 0, 2}, {0.2, 3, 2.2}}});
  SceneIndex index(sharedScene(trial.world));
  trial.order("ann", Spawn{Vec3(0, 0.001, 0), 0});
  trial.order("ann", Walk{{Vec3(8, 0, 0)}, 2});
  for (int i = 0; i < 240; ++i) {
    trial.step();
    const SceneThen then{index, *trial.world.snapshot()};
    const EntityId ann = entityNamed(then, "ann");
    std::size_t work = kMostWork;
    const auto near = std::get<Near>(nearTo(then, ann, 2 * trial.world.lengths().epsilon, work));
    std::set<std::pair<EntityId, EntityId>> pairs;
    for (const PairState& one : near.found) pairs.insert({one.a, one.b});
    ASSERT_EQ(pairs, trial.open) << "tick " << then.snapshot.tick;
  }
  EXPECT_EQ(trial.open.size(), 2u) << "the wall was never reached";
}

}  // namespace
}  // namespace enfilade::scene::testing
