// Avatars among static objects of many parts, whose parts are found by their trees.
#include <chrono>
#include <numbers>
#include <thread>

#include "tests/scene/brute_force_contacts.hpp"
#include "tests/scene/checkpoint_fixture.hpp"
#include "tests/scene/thin_geometry.hpp"
#include "tests/scene/world_fixture.hpp"
#include "tests/support/dense_scenes.hpp"
#include "tests/support/sanitized.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

std::shared_ptr<const Scene> makeScene(const tests::DenseScene& dense, std::size_t triangles) {
  return std::make_shared<const Scene>(dense.make(triangles));
}

std::string makeName(int i) {
  return "a" + std::to_string(i);
}

/// A prism, a shape of two parts, an arm, and one that flies.
Spawn makeSpawn(int i, const Vec3& position) {
  Spawn spawn;
  spawn.position = position;
  spawn.flying = i % 4 == 3;
  if (i % 4 == 1)
    spawn.parts = {makeBoxPoints({-0.2, 0, -0.3}, {0.2, 0.9, 0.3}),
                   makeBoxPoints({-0.1, 0.9, -0.1}, {0.1, 1.2, 0.1})};
  if (i % 4 == 2)
    spawn.links = {{-1,
                    {LinkJoint::Kind::revolute, {0, 1.2, 0}, {0, 1, 0}, -3, 3},
                    makeBoxPoints({0, 0, -0.05}, {0.8, 0.1, 0.05}),
                    0}};
  return spawn;
}

Vec3 drawPlace(const Scene& scene, Seeded& random) {
  const Aabb& bounds = scene.bounds();
  return {random.drawUniform(bounds.min.x(), bounds.max.x()),
          random.drawUniform(bounds.min.y(), bounds.min.y() + 0.8 * bounds.size().y()),
          random.drawUniform(bounds.min.z(), bounds.max.z())};
}

/// Commands of one tick: spawns of those that have no place yet, and new directions.
TickCommands makeCommands(const Scene& scene, int avatars, int tick, Seeded& random) {
  TickCommands commands;
  for (int i = 0; i < avatars; ++i) {
    if (tick < 60)
      commands.avatars.push_back({makeName(i), makeSpawn(i, drawPlace(scene, random)), 0});
    if (tick % 20 != i % 20) continue;
    const double speed = random.drawUniform(0.5, 4);
    commands.avatars.push_back(
        {makeName(i), Drive{speed * drawVelocity(random, i % 4 == 3).normalized()}, 0});
    if (i % 4 == 2)
      commands.avatars.push_back(
          {makeName(i), DriveJoints{{random.drawUniform(-3, 3)}, 2, true}, 0});
    if (i % 4 == 0) commands.avatars.push_back({makeName(i), Jump{0.4, {}}, 0});
  }
  return commands;
}

class DenseObjects : public ::testing::TestWithParam<tests::DenseScene> {};

TEST_P(DenseObjects, ContactsAreThoseOfBruteForceAndNothingPenetrates) {
  constexpr int kAvatars = 8, kTicks = tests::kSanitized ? 100 : 500;
  const auto scene = makeScene(GetParam(), tests::kSanitized ? 6'000 : 20'000);
  WorldFixture run(scene);
  Seeded random(3);
  std::size_t contacts = 0;
  for (int tick = 0; tick < kTicks; ++tick) {
    give(run.world, makeCommands(*scene, kAvatars, tick, random));
    run.step();
    if (tick % 5 != 0) continue;
    const ContactComparison compared = compareStaticContacts(run.world);
    ASSERT_EQ(compared.different, 0u) << "tick " << tick;
    contacts += compared.expected;
    if (tick % 50 == 0) {
      ASSERT_EQ(countPenetrations(run.world), 0) << "tick " << tick;
    }
  }
  EXPECT_EQ(run.worstPenetration, 0);
  EXPECT_GE(run.world.snapshot()->avatars.size(), 6u);
  EXPECT_GT(contacts, static_cast<std::size_t>(kTicks / 5));
}

TEST_P(DenseObjects, ACopyFromACheckpointIsBitEqual) {
  constexpr int kAvatars = 8, kUntil = tests::kSanitized ? 250 : 500;
  WorldSettings watchful;
  watchful.nearMissDistance = 0.1;
  const auto scene = makeScene(GetParam(), 10'000);
  Seeded random(4);
  std::map<std::uint64_t, TickCommands> commands;
  for (int tick = 1; tick < kUntil; ++tick)
    commands[static_cast<std::uint64_t>(tick)] = makeCommands(*scene, kAvatars, tick, random);
  compareCopies(scene, watchful, commands, kUntil, {0, 61, 90, 110}, 250);
}

INSTANTIATE_TEST_SUITE_P(In, DenseObjects, ::testing::ValuesIn(tests::listDenseScenes()),
                         [](const auto& dense) { return std::string(dense.param.name); });

/// A flat floor of 2 * steps * steps triangles.
Model makeFineFloor(int steps) {
  Mesh mesh;
  for (int i = 0; i <= steps; ++i)
    for (int k = 0; k <= steps; ++k)
      mesh.positions.emplace_back(static_cast<float>(10.0 * i / steps), 0.0F,
                                  static_cast<float>(10.0 * k / steps));
  const auto row = static_cast<std::uint32_t>(steps) + 1;
  for (std::uint32_t i = 0; i + 1 < row; ++i)
    for (std::uint32_t k = 0; k + 1 < row; ++k) {
      const std::uint32_t at = i * row + k;
      mesh.indices.insert(mesh.indices.end(),
                          {at, at + 1, at + row, at + 1, at + row + 1, at + row});
    }
  Builder builder;
  builder.add("floor", std::move(mesh));
  return builder.model;
}

TEST(DenseObjects, AWalkOnAFineFloorAsksAsLittleAsOnACoarseOne) {
  for (const int steps : {10, 300}) {
    WorldFixture run(std::make_shared<const Scene>(makeFineFloor(steps)));
    run.order("ann", Spawn{Vec3(2, 0.1, 5)});
    run.runTicks(30);
    run.order("ann", Drive{{1.5, 0, 0.3}});
    std::uint64_t queries = 0;
    for (int i = 0; i < 120; ++i) {
      const TickReport report = run.step();
      queries += report.narrowQueries;
      EXPECT_EQ(report.avatarWork.at(0).narrowQueries, report.narrowQueries);
      EXPECT_GT(report.partsLookedAt, 0u);
    }
    EXPECT_GT(run.getFeet("ann").x(), 4.9);
    EXPECT_LT(queries / 120, 15u) << steps << " steps";
  }
}

TEST(DenseObjects, PartsLookedAtAreThoseOfTheAvatarThatIsNearThem) {
  Model model = makeBoxModel({makeFloorBox()});
  model.meshes.push_back(makeFineFloor(60).meshes.front());
  Eigen::Affine3d upright(Eigen::Translation3d(4, 0, -5));  // a wall at x = 4
  upright.rotate(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitZ()));
  model.objects.push_back({"fine wall", "", {1}, upright});
  WorldFixture run(std::make_shared<const Scene>(std::move(model)));
  run.order("ann", Spawn{Vec3(3.5, 0.1, 0)});
  run.order("ben", Spawn{Vec3(-6, 0.1, 0)});
  run.runTicks(30);
  for (const char* name : {"ann", "ben"}) run.order(name, Drive{{1.5, 0, 0.3}});
  run.runTicks(30);
  EXPECT_TRUE(run.hasTouched("fine wall"));
  for (int i = 0; i < 60; ++i) {
    const TickReport report = run.step();
    ASSERT_EQ(report.avatarWork.size(), 2u);
    const AvatarWork &near = report.avatarWork[0], &far = report.avatarWork[1];
    ASSERT_EQ(near.id, run.getView("ann").id);
    ASSERT_EQ(far.id, run.getView("ben").id);
    EXPECT_GT(far.partsLookedAt, 0u) << "of the floor, tick " << i;
    EXPECT_GT(near.partsLookedAt, far.partsLookedAt) << "tick " << i;
    EXPECT_EQ(near.partsLookedAt + far.partsLookedAt, report.partsLookedAt) << "tick " << i;
    EXPECT_EQ(near.footPosition, run.getFeet("ann"));
  }
}

TEST(DenseObjects, GeometryIsBuiltBeforeAnAvatarGetsThere) {
  Model model = makeFineFloor(2);
  model.meshes.push_back(makeFineFloor(20).meshes.front());
  model.objects.push_back({"far floor", "", {1}, Eigen::Affine3d(Eigen::Translation3d(12, 0, 0))});
  const auto scene = std::make_shared<const Scene>(std::move(model));
  WorldFixture run(scene);
  run.order("ann", Spawn{Vec3(9.5, 0.1, 5)});  // 2 m from the far floor
  run.step();
  const std::size_t before = scene->memory().parts;
  for (int i = 0; i < 500 && scene->memory().parts == before; ++i) {
    run.step();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_GT(scene->memory().parts, 800 * sizeof(collision::Triangle));
}

TEST(DenseObjects, ABlockedWalkAndItsEndReportTheDistanceOfTheNearestTriangle) {
  const auto scene = makeScene(*tests::findDenseScene("plant_room"), 20'000);
  WorldFixture run(scene);
  Seeded random(5);
  for (int tick = 0; tick < 400; ++tick) {
    give(run.world, makeCommands(*scene, 4, tick, random));
    for (const ContactEvent& event : run.step().contacts) {
      if (event.b == 0 || event.b > scene->model().objects.size()) continue;
      if (event.kind != ContactEvent::Kind::blocked && event.kind != ContactEvent::Kind::end)
        continue;
      const auto& avatars = run.world.snapshot()->avatars;
      const auto avatar = std::ranges::find(avatars, event.a, &AvatarSnapshot::id);
      if (avatar == avatars.end() || event.reason != ContactEvent::Reason::separated) continue;
      const double distance = event.separation.distance, error = 1e-9 + event.separation.errorBound;
      EXPECT_TRUE(isObjectCloser(*scene, event.b - 1, *avatar, distance + error)) << tick;
      EXPECT_FALSE(isObjectCloser(*scene, event.b - 1, *avatar, distance - error)) << tick;
    }
  }
}

}  // namespace
}  // namespace enfilade::scene
