// Navigation meshes that were saved answer as those that were built; others are refused.
#include "scene/navigation/mesh/saved_meshes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "scene/model/hasher.hpp"
#include "scene/navigation/navigation.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

std::shared_ptr<const Scene> makeHallWithCrate(double gap) {
  Model model = makeBoxModel({{"floor", {0, -0.2, -3}, {8, 0, 3}},
                              {"wall/left", {3.9, 0, -3}, {4.1, 2.5, -0.5 * gap}},
                              {"wall/right", {3.9, 0, 0.5 * gap}, {4.1, 2.5, 3}},
                              {"crate", {1, 0, -3}, {2, 1, -2}}});
  BodySpec crate = makeBodySpec("crate", BodyKind::sliding, {3});
  crate.axis = Vec3::UnitX();
  crate.high = 4;
  model.bodies.push_back(crate);
  return std::make_shared<const Scene>(std::move(model));
}

/// The last eight bytes are a hash of all others.
void seal(std::vector<std::uint8_t>& bytes) {
  Hasher hash;
  hash.add(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size() - 8));
  for (std::size_t i = 0; i < 8; ++i)
    bytes[bytes.size() - 8 + i] = static_cast<std::uint8_t>(hash.value() >> (8 * i));
}

std::string refuse(const std::shared_ptr<const Scene>& scene, const WorldSettings& settings,
                   const NavigationAgent& agent, const std::vector<std::uint8_t>& bytes) {
  try {
    Navigation(scene, settings, agent, bytes);
  } catch (const MeshFileError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SavedMeshes, AnswerAsThoseThatWereBuilt) {
  const auto scene = makeHallWithCrate(1);
  Navigation built(scene, {}, {});
  Navigation loaded(scene, {}, {}, built.save());
  EXPECT_EQ(loaded.save(), built.save());
  EXPECT_EQ(loaded.report().islandAreas, built.report().islandAreas);
  std::mt19937_64 one(5), two(5);
  for (int i = 0; i < 10; ++i) {
    const auto from = built.findRandomPlace(one, {}), to = built.findRandomPlace(one, {});
    ASSERT_EQ(from, loaded.findRandomPlace(two, {}));
    ASSERT_EQ(to, loaded.findRandomPlace(two, {}));
    EXPECT_EQ(loaded.findPath(*from, *to).points, built.findPath(*from, *to).points);
  }
}

TEST(SavedMeshes, ABodyThatHasMovedSinceIsBuiltAgain) {
  const auto scene = makeHallWithCrate(1);
  Navigation built(scene, {}, {});
  const std::vector<std::uint8_t> saved = built.save();
  World world(scene);
  submitBodyCommand(world, {"crate", BodyCommand::Action::open, 0, 0, std::nullopt});
  for (int tick = 0; tick < 300; ++tick) tickWorld(world);
  Navigation loaded(scene, {}, {}, saved);
  EXPECT_FALSE(loaded.snap({1.5, 0.1, -2.5}, 0));
  std::vector<double> shares;
  const auto report = [&](double share) { shares.push_back(share); };
  EXPECT_GT(loaded.update(*world.snapshot(), 2, report), 0u);
  ASSERT_GT(shares.size(), 2u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_LE(shares.front(), Navigation::kTileShare);
  EXPECT_EQ(shares.back(), 1);
  shares.clear();
  EXPECT_TRUE(loaded.findPath({1.5, 0.1, -2.4}, {7, 0.1, 0}).found());
  EXPECT_EQ(loaded.update(*world.snapshot(), 2, report), 0u);
  EXPECT_TRUE(shares.empty());
  Navigation moved(scene, {}, {}, loaded.save());
  EXPECT_EQ(moved.update(*world.snapshot()), 0u) << "the file has the places of bodies";
}

TEST(SavedMeshes, OfAnotherSceneOrSizeAreRefused) {
  const auto scene = makeHallWithCrate(1);
  const std::vector<std::uint8_t> saved = Navigation(scene, {}, {}).save();
  EXPECT_NE(refuse(makeHallWithCrate(0.9), {}, {}, saved).find("another scene"), std::string::npos);
  EXPECT_NE(refuse(scene, {}, {.radius = 0.25}, saved).find("radius of 0.3"), std::string::npos);
  WorldSettings settings;
  settings.stepHeight = 0.2;
  EXPECT_NE(refuse(scene, settings, {}, saved).find("step height"), std::string::npos);
  EXPECT_NE(refuse(scene, {}, {}, {1, 2, 3}).find("not a navigation mesh"), std::string::npos);
  auto damaged = saved;
  damaged[damaged.size() / 2] ^= 1;
  EXPECT_NE(refuse(scene, {}, {}, damaged).find("checksum"), std::string::npos);
  EXPECT_EQ(refuse(scene, {}, {.speed = 2}, saved), "accepted") << "the speed decides no mesh";
}

TEST(SavedMeshes, ForgedBytesAreRefusedOrHarmless) {
  const auto scene = makeHallWithCrate(1);
  const std::vector<std::uint8_t> saved = Navigation(scene, {}, {}).save();
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    auto forged = saved;
    for (int k = 0; k < 3; ++k)
      forged[8 + random() % (forged.size() - 16)] = static_cast<std::uint8_t>(random());
    seal(forged);
    try {
      Navigation navigation(scene, {}, {}, forged);
      navigation.findPath({1, 0.1, 2}, {7, 0.1, -2});
    } catch (const MeshFileError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 50);
  EXPECT_LT(refused, 400);
}

}  // namespace
}  // namespace enfilade::scene::testing
