// Compares proximity queries between any two entities with brute force over all their parts, and
// with the ticks' results.
#include "scene/world/queries/proximity_query.hpp"

#include <cmath>
#include <random>

#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

/// An object of random triangles in a ball: concave and not closed.
Object strewTriangles(Model& model, std::mt19937& random, const Vec3& middle, double spread) {
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

/// A world without avatars, as the target of queries.
struct Still {
  explicit Still(Model model) : world(std::make_shared<const Scene>(std::move(model))) {}
  World world;
  EntityIndex index{borrowScene(world)};
  SceneAt then{index, *world.snapshot()};
};

PairProximity computeState(const SceneAt& then, EntityId a, EntityId b, bool refined = false) {
  std::size_t work = kMaxQueryWork;
  return std::get<PairProximity>(computePairProximity(then, a, b, refined, work));
}

/// Reference implementation: every part with every part.
collision::SeparationResult findNearestByBruteForce(const CollisionGeometry& a,
                                                    const CollisionGeometry& b) {
  std::optional<collision::SeparationResult> nearest;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    for (std::uint32_t k = 0; k < b.size(); ++k) {
      collision::FeatureCache cache;
      const collision::SeparationResult one =
          collision::computeSeparation(a.convex(i), b.convex(k), cache);
      const bool nearer = !nearest || one.verdict > nearest->verdict ||
                          (one.verdict == nearest->verdict && one.distance < nearest->distance);
      if (nearer) nearest = one;
    }
  }
  return nearest.value();
}

TEST(PairProximity, TheDistanceOfStaticMeshesIsThatOfTheirNearestParts) {
  std::mt19937 random(7);
  int apart = 0;
  constexpr int kPairs = 40;
  for (int i = 0; i < kPairs; ++i) {
    Model model = makeBoxModel({});
    model.objects.push_back(strewTriangles(model, random, Vec3::Zero(), 0.3));
    model.objects.push_back(strewTriangles(model, random, Vec3(1.2 + 0.05 * i, 0.4, 0), 0.3));
    const Still still(std::move(model));
    const PairProximity found = computeState(still.then, 1, 2),
                        back = computeState(still.then, 2, 1),
                        refined = computeState(still.then, 1, 2, true);
    const Scene& scene = still.world.scene();
    const collision::SeparationResult truth =
        findNearestByBruteForce(scene.collisionGeometry(0), scene.collisionGeometry(1));
    ASSERT_EQ(found.separation.verdict, truth.verdict);
    EXPECT_EQ(back.separation.verdict, truth.verdict);
    EXPECT_NEAR(found.separation.distance, truth.distance, 1e-12);
    EXPECT_NEAR(back.separation.distance, truth.distance, 1e-12);
    EXPECT_NEAR(refined.separation.distance, truth.distance, 1e-12);
    EXPECT_NEAR((found.separation.pointA - found.separation.pointB).norm(), truth.distance, 1e-9);
    apart += truth.verdict == collision::Verdict::separated ? 1 : 0;
  }
  EXPECT_GT(apart, kPairs / 4);
  EXPECT_LT(apart, kPairs);
}

TEST(PairProximity, LargeMeshesThatAreFarApartCostLittle) {
  // Two hilly plates of 40,000 triangles each, 3 m apart; brute force would take 1.6e9 narrow-phase
  // calls.
  Model model = makeBoxModel({});
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
  std::size_t work = kMaxQueryWork;
  const auto found = std::get<PairProximity>(computePairProximity(still.then, 1, 2, false, work));
  EXPECT_NEAR(found.separation.distance, 2.4015, 1e-3);
  EXPECT_LT(kMaxQueryWork - work, kMaxQueryWork / 100);
  std::size_t little = 100;
  const auto none = computePairProximity(still.then, 1, 2, false, little);
  ASSERT_TRUE(std::holds_alternative<QueryError>(none));
  EXPECT_EQ(std::get<QueryError>(none).reason, QueryError::Reason::tooComplex);
  EXPECT_EQ(little, 0u) << "it stopped too early";
  little = 100;
  const NearbyEntities near =
      std::get<NearbyEntities>(findNearbyEntities(still.then, 1, 5, little));
  EXPECT_TRUE(near.pairs.empty());
  EXPECT_EQ(near.skipped, 1u);
}

/// A closed convex mesh with `corners` vertices on a sphere of 1 m.
Mesh makeBallMesh(std::mt19937& random, std::size_t corners, const Vec3& middle) {
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

TEST(PairProximity, TheDepthOfVeryRoundShapesExceedsTheWorkLimit) {
  std::mt19937 random(3);
  for (const std::size_t corners : {20u, 400u}) {
    Model model =
        makeBoxModel({{"a", Vec3::Zero(), Vec3::Ones()}, {"b", Vec3::Zero(), Vec3::Ones()}});
    model.meshes = {makeBallMesh(random, corners, Vec3::Zero()),
                    makeBallMesh(random, corners, Vec3(1.2, 0, 0))};
    const Still still(std::move(model));
    ASSERT_EQ(still.world.scene().collisionGeometry(0).hullCount(), 1u);
    std::size_t work = kMaxQueryWork;
    const auto state = computePairProximity(still.then, 1, 2, true, work);
    ASSERT_EQ(std::holds_alternative<PairProximity>(state), corners == 20);
    if (corners == 20) {
      EXPECT_GT(std::get<PairProximity>(state).penetration, 0.3);
    }
    EXPECT_EQ(computeState(still.then, 1, 2).separation.verdict, collision::Verdict::penetrating);
  }
}

TEST(PairProximity, BoxesHaveTheDistancesThatWereBuilt) {
  const Still still(makeBoxModel(
      {makeFloorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}, {"inside", {5.1, 1, 0}, {6, 2, 1}}}));
  const SceneAt& then = still.then;
  EXPECT_EQ(findEntity(then, "wall"), 2u);
  EXPECT_EQ(findEntity(then, "window"), 0u);
  EXPECT_EQ(resolveEntity(then, 9), 0u);
  EXPECT_EQ(computeState(then, 1, 2).separation.verdict, collision::Verdict::touching);
  EXPECT_EQ(computeState(then, 2, 3).separation.verdict, collision::Verdict::penetrating);
  const PairProximity above = computeState(then, 1, 3, true);
  EXPECT_EQ(above.separation.distance, 1.0);
  EXPECT_EQ(above.separation.normal, Vec3(0, 1, 0));
}

TEST(PairProximity, NearbyEntitiesEqualThoseOfTheTick) {
  WorldFixture run(
      {makeFloorBox(), {"wall", {5, 0, -4}, {5.2, 3, 4}}, {"post", {0, 0, 2}, {0.2, 3, 2.2}}});
  EntityIndex index(borrowScene(run.world));
  run.order("ann", Spawn{Vec3(0, 0.001, 0), 0});
  run.order("ann", Walk{{Vec3(8, 0, 0)}, 2});
  for (int i = 0; i < 240; ++i) {
    run.step();
    const SceneAt then{index, *run.world.snapshot()};
    const EntityId ann = findEntity(then, "ann");
    std::size_t work = kMaxQueryWork;
    const auto near = std::get<NearbyEntities>(
        findNearbyEntities(then, ann, 2 * run.world.settings().contactOffset, work));
    std::set<std::pair<EntityId, EntityId>> pairs;
    for (const PairProximity& one : near.pairs) pairs.insert({one.a, one.b});
    ASSERT_EQ(pairs, run.open) << "tick " << then.snapshot.tick;
  }
  EXPECT_EQ(run.open.size(), 2u) << "the wall was never reached";
}

}  // namespace
}  // namespace enfilade::scene::testing
