// Rays of clients and frames share the trees of a scene, with filters of their own.
#include "scene/world/queries/scene_trees.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <vector>

#include "render/raytrace/ray_renderer.hpp"
#include "scene/world/queries/ray_caster.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

using scene::RayCaster;
using scene::SceneTrees;

constexpr scene::EntityId kWall = 1, kPane = 2, kLift = 3;

/// A wall, a pane, and before them a lift of two cubes with one mesh.
std::shared_ptr<const scene::Scene> makeTwoCubesLift() {
  scene::Model model = makeScene({{{0, 0, -9}, {40, 40, 1}, {}},
                                  {{0, 0, -7}, {40, 40, 0.1}, makeColoured(0, 0, 1, 0.5f)},
                                  {{-1, 0, -5}, {1, 1, 1}, {}},
                                  {{1, 0, -5}, {1, 1, 1}, {}}})
                           ->model();
  model.objects[3].meshes = {2};
  scene::BodySpec lift;
  lift.name = "lift";
  lift.kind = scene::BodyKind::lift;
  lift.objects = {2, 3};
  lift.anchor = {0, 0, -5};
  lift.high = 3;
  lift.stops = {0, 3};
  model.bodies = {lift};
  return std::make_shared<const scene::Scene>(std::move(model));
}

scene::Snapshot makeLiftAt(const scene::Scene& scene, double height) {
  scene::BodySnapshot lift;
  lift.id = kLift;
  lift.displaced = height != 0;
  lift.pose.translation = scene.bodyShape(0)->origin + Vec3(0, height, 0);
  scene::Snapshot snapshot;
  snapshot.bodies = std::make_shared<const std::vector<scene::BodySnapshot>>(1, lift);
  return snapshot;
}

/// The entity seen along -z from (x, 0, 0); 0: none.
scene::EntityId findEntityAhead(const RayCaster& caster, double x, const scene::RayFilter& filter) {
  const auto hit = caster.firstHit({{x, 0, 0}, -Vec3::UnitZ()}, filter);
  return hit ? hit->entity : 0;
}

/// Counts after frames, rays, or both, at two heights of the lift.
SceneTrees::Counts countTrees(int renderers, int casters) {
  const auto scene = makeTwoCubesLift();
  const std::vector<scene::Snapshot> snapshots{makeLiftAt(*scene, 0), makeLiftAt(*scene, 2)};
  std::vector<std::unique_ptr<RayRenderer>> allRenderers;
  for (int i = 0; i < renderers; ++i) {
    allRenderers.push_back(std::make_unique<RayRenderer>(scene));
    for (const scene::Snapshot& snapshot : snapshots)
      EXPECT_TRUE(
          findIdsIn(allRenderers.back()->render(snapshot, makeSquareCamera(20))).contains(kLift));
  }
  std::vector<RayCaster> allCasters;
  for (int i = 0; i < casters; ++i) {
    allCasters.emplace_back(scene);
    for (const scene::Snapshot& snapshot : snapshots) allCasters.back().update(snapshot);
    EXPECT_EQ(findEntityAhead(allCasters.back(), 0, {}), kPane);
  }
  return SceneTrees::of(*scene).counts();
}

TEST(SceneTrees, AreBuiltOnceForRaysAndFrames) {
  for (const auto& [renderers, casters] : {std::pair{1, 0}, {0, 1}, {1, 1}, {2, 3}}) {
    const SceneTrees::Counts counts = countTrees(renderers, casters);
    EXPECT_EQ(counts.meshes, 1u) << renderers << ' ' << casters;
    // Opaque and transparent static items, and the lift at two heights.
    EXPECT_EQ(counts.placed, 4u) << renderers << ' ' << casters;
  }
}

TEST(SceneTrees, ABodyIsOneEntityOfRaysAndSeveralObjectsOfFrames) {
  const auto scene = makeTwoCubesLift();
  RayCaster caster(scene);
  EXPECT_EQ(findEntityAhead(caster, 1, {}), kPane) << "bodies appear with the first update()";
  const scene::Snapshot snapshot = makeLiftAt(*scene, 0);
  caster.update(snapshot);
  EXPECT_EQ(findEntityAhead(caster, -1, {}), kLift);
  EXPECT_EQ(findEntityAhead(caster, 1, {}), kLift);
  EXPECT_EQ(findEntityAhead(caster, 1, {kLift, false}), kPane);
  EXPECT_EQ(findEntityAhead(caster, 1, {kLift, true}), kWall);
  RayRenderer renderer(scene);
  FrameOptions options;
  options.hiddenEntity = kLift;
  EXPECT_EQ(findIdsIn(renderer.render(snapshot, makeSquareCamera(), options)),
            (std::set<std::uint32_t>{kWall, kLift + 1}));
}

TEST(SceneTrees, PicturesCutOutMaskedTexelsAndRaysDoNot) {
  const auto scene = makeMaskedSquare();
  RayRenderer renderer(scene);
  const Frame frame = renderer.render({}, makeSquareCamera());
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 70, 100)], 1u);
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 130, 100)], 0u);
  const RayCaster caster(scene);
  EXPECT_EQ(findEntityAhead(caster, -0.5, {}), 1u);
  EXPECT_EQ(findEntityAhead(caster, 0.5, {}), 1u);
  EXPECT_EQ(SceneTrees::of(*scene).counts().placed, 1u);
}

TEST(SceneTrees, ServeARendererAndCastersAtOnce) {
  constexpr int kHeights = 40, kThreads = 3;
  const auto scene = makeTwoCubesLift();
  std::vector<scene::Snapshot> snapshots;
  for (int i = 0; i < kHeights; ++i) {
    snapshots.push_back(makeLiftAt(*scene, 0.05 * i));
    snapshots.back().avatars = {makeAvatarAt(9, {3 + 0.05 * i, -1, -5})};
  }
  std::vector<std::vector<double>> distances(kThreads);
  std::vector<Frame> frames;
  {
    std::vector<std::jthread> threads;
    threads.emplace_back([&] {
      RayRenderer renderer(scene);
      for (const scene::Snapshot& snapshot : snapshots)
        frames.push_back(renderer.render(snapshot, makeSquareCamera(16)));
    });
    for (std::vector<double>& mine : distances) {
      threads.emplace_back([&] {
        RayCaster caster(scene);
        for (const scene::Snapshot& snapshot : snapshots) {
          caster.update(snapshot);
          mine.push_back(caster.firstHit({{1, 9, -5}, -Vec3::UnitY()}).value().distance);
        }
      });
    }
  }
  RayRenderer alone(makeTwoCubesLift());
  for (std::size_t i = 0; i < kHeights; ++i) {
    for (const std::vector<double>& mine : distances)
      EXPECT_NEAR(mine[i], 8.5 - 0.05 * static_cast<double>(i), 1e-12);
    const Frame expected = alone.render(snapshots[i], makeSquareCamera(16));
    EXPECT_EQ(frames[i].ids, expected.ids);
    EXPECT_EQ(frames[i].rgb, expected.rgb);
  }
}

}  // namespace
}  // namespace enfilade::render
