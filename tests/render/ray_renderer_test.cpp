#include "render/raytrace/ray_renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <set>

#include "render/gl/gl_renderer.hpp"
#include "tests/render/brute_force_rays.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

/// Cameras all around a crowd that reaches 10 m from `middle`: by field of view, by a pinhole with
/// an off-centre axis, and orthographic ones.
std::vector<Camera> makeCamerasAround(const Vec3& middle, int count, int width, int height) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    Camera camera;
    camera.eye = middle + 9 * Vec3(unit(random), unit(random), unit(random));
    camera.forward = middle - camera.eye + 3 * Vec3(unit(random), unit(random), unit(random));
    camera.fovY = 0.6 + 0.5 * (unit(random) + 1);
    camera.heightY = 12;
    camera.far = i % 5 == 4 ? 8 : 60;
    if (i % 3 == 2) camera.projection = Camera::Projection::orthographic;
    camera.width = width;
    camera.height = height;
    if (i % 3 == 1) camera.pinhole = Pinhole{0.7 * width, 0.9 * width, 0.4 * width, 0.65 * height};
    cameras.push_back(camera);
  }
  return cameras;
}

/// Whether a neighbouring pixel shows another object.
bool isNearAnEdge(const Frame& frame, int x, int y) {
  const Camera& camera = frame.camera;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int u = std::clamp(x + dx, 0, camera.width - 1);
      const int v = std::clamp(y + dy, 0, camera.height - 1);
      if (frame.ids[getPixelIndex(frame, u, v)] != frame.ids[getPixelIndex(frame, x, y)])
        return true;
    }
  }
  return false;
}

struct Agreement {
  std::size_t hits = 0, undecided = 0;
  double worst = 0;  ///< metres of depth
};

Agreement compareWithBruteForce(const std::shared_ptr<const scene::Scene>& scene,
                                const std::vector<Camera>& cameras) {
  RayRenderer renderer(scene);
  Agreement result;
  for (const Camera& camera : cameras) {
    const Frame frame = renderer.render({}, camera);
    const std::vector<BruteHit> truth = computeBruteFrame(scene->model(), camera);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      // At a silhouette, and where two surfaces meet, floats may select the other one.
      const bool clear =
          truth[i].id == 0 || (truth[i].inside > 1e-4 && truth[i].second - truth[i].depth > 1e-4);
      if (!clear || (frame.ids[i] != truth[i].id && truth[i].id == 0)) {
        ++result.undecided;
        continue;
      }
      EXPECT_EQ(frame.ids[i], truth[i].id) << i;
      if (truth[i].id == 0 || frame.ids[i] != truth[i].id) continue;
      ++result.hits;
      result.worst =
          std::max(result.worst, std::abs(static_cast<double>(frame.depth[i]) - truth[i].depth));
    }
  }
  return result;
}

TEST(RayRenderer, DepthAndIdsAreThoseOfABruteForceSearchInDoubles) {
  const auto scene = makeScene(makeOpaque(makeCrowd(150)));
  const auto cameras = makeCamerasAround(Vec3::Zero(), 12, 67, 41);
  const Agreement found = compareWithBruteForce(scene, cameras);
  EXPECT_GT(found.hits, 12u * 67u * 41u / 4);
  EXPECT_LT(found.undecided, 12u * 67u * 41u / 100);
  EXPECT_LT(found.worst, 2e-6);  // half a float's unit in the last place at 30 m
}

TEST(RayRenderer, DepthIsAsTrueAKilometreFromTheOriginOfTheScene) {
  std::vector<PlacedBox> boxes = makeOpaque(makeCrowd(150));
  const Vec3 far(900, 20, -700);
  for (PlacedBox& box : boxes) box.centre += far;
  boxes.push_back({{0, 0, 0}, {1, 1, 1}, {}});  // moves the scene's centre
  const Agreement found =
      compareWithBruteForce(makeScene(boxes), makeCamerasAround(far, 6, 67, 41));
  EXPECT_GT(found.hits, 6u * 67u * 41u / 4);
  EXPECT_LT(found.worst, 1e-5);
}

TEST(RayRenderer, APaneSeenSquarelyIsTintedOnceAlongItsDiagonalToo) {
  // The image centre is the pane's centre: rays hit the shared edge of its two triangles.
  const PlacedBox wall{{0, 0, -6}, {20, 20, 2}, makeColoured(0.8f, 0.8f, 0.8f)};
  const PlacedBox pane{{0, 0, -3}, {1, 1, 0}, makeColoured(0.05f, 0.05f, 0.9f, 0.5f)};
  RayRenderer renderer(makeScene({pane, wall}));
  Camera camera = makeSquareCamera(201);
  const Frame frame = renderer.render({}, camera);
  const auto red = [&](int x, int y) { return int{frame.rgb[3 * getPixelIndex(frame, x, y)]}; };
  for (int i = -14; i <= 14; ++i) {
    EXPECT_NEAR(red(100 + i, 100 + i), red(100 + i, 100 + i + 2), 3) << i;
    EXPECT_NEAR(red(100 + i, 100 - i), red(100 + i, 100 - i + 2), 3) << i;
  }
}

TEST(RayRenderer, AnOrthographicCameraSeesBehindItsEyeWithNegativeNear) {
  RayRenderer renderer(makeScene({{{0, 0, 5}, {2, 2, 2}, {}}, {{0, 0, -5}, {20, 20, 2}, {}}}));
  Camera camera = makeSquareCamera();
  camera.projection = Camera::Projection::orthographic;
  camera.heightY = 4;
  camera.near = -10;
  const Frame frame = renderer.render({}, camera);
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 100, 100)], 1u);
  EXPECT_EQ(frame.depth[getPixelIndex(frame, 100, 100)], -6);
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 10, 10)], 2u);
  EXPECT_EQ(frame.depth[getPixelIndex(frame, 10, 10)], 4);
}

TEST(RayRenderer, AFlatBodyIsVisible) {
  const auto lift = makeSceneWithLift();
  scene::Model model = lift->model();
  const std::uint32_t object = model.bodies.front().objects.front();
  model.objects[object].worldFromMesh.linear().col(2).setZero();
  const auto scene = std::make_shared<const scene::Scene>(std::move(model));
  RayRenderer renderer(scene);
  const Frame frame = renderer.render(makeSnapshotOfLift(*scene, 0), makeSquareCamera());
  EXPECT_TRUE(findIdsIn(frame).contains(object + 1));
}

TEST(RayRenderer, ABodyIsSeenWhereTheSnapshotHasIt) {
  const auto scene = makeSceneWithLift();
  RayRenderer renderer(scene);
  const scene::Snapshot authored = makeSnapshotOfLift(*scene, 0),
                        lifted = makeSnapshotOfLift(*scene, 2);
  const Frame before = renderer.render(authored, makeSquareCamera());
  const Frame after = renderer.render(lifted, makeSquareCamera());
  EXPECT_EQ(before.ids[getPixelIndex(before, 100, 100)], 2u);
  EXPECT_EQ(before.ids[getPixelIndex(before, 100, 60)], 1u);
  EXPECT_EQ(after.ids[getPixelIndex(after, 100, 100)], 1u);
  EXPECT_EQ(after.ids[getPixelIndex(after, 100, 60)], 2u);
  EXPECT_EQ(renderer.render(authored, makeSquareCamera()).ids, before.ids);
}

TEST(RayRenderer, PicturesDoNotDependOnTheNumberOfThreads) {
  const auto scene = makeScene(makeCrowd(300));
  scene::Snapshot snapshot;
  snapshot.avatars = {makeAvatarAt(301, {1, -1, -4})};
  RayRenderer one(scene, {1}), two(scene, {2}), five(scene, {5});
  FrameOptions options;
  options.channels.normals = true;
  for (const Camera& camera : makeCamerasAround(Vec3::Zero(), 6, 131, 97)) {
    const Frame a = one.render(snapshot, camera, options);
    for (RayRenderer* other : {&two, &five, &one}) {
      const Frame b = other->render(snapshot, camera, options);
      EXPECT_TRUE(a.rgb == b.rgb);
      EXPECT_TRUE(a.ids == b.ids);
      EXPECT_TRUE(a.normals == b.normals);
      EXPECT_EQ(std::memcmp(a.depth.data(), b.depth.data(), a.depth.size() * sizeof(float)), 0);
    }
  }
}

TEST(RayRenderer, UnrequestedChannelsAreEmptyAndTheOthersAreEqual) {
  RayRenderer renderer(makeScene(makeCrowd(100)));
  const Camera camera = makeCamerasAround(Vec3::Zero(), 1, 80, 60).front();
  FrameOptions all;
  all.channels.normals = true;
  const Frame whole = renderer.render({}, camera, all);
  for (int only = 0; only < 4; ++only) {
    FrameOptions one;
    one.channels = {only == 0, only == 1, only == 2, only == 3};
    const Frame part = renderer.render({}, camera, one);
    EXPECT_EQ(part.rgb, only == 0 ? whole.rgb : std::vector<std::uint8_t>{});
    EXPECT_EQ(part.ids, only == 1 ? whole.ids : std::vector<std::uint32_t>{});
    EXPECT_EQ(part.depth.size(), only == 2 ? whole.depth.size() : 0);
    EXPECT_EQ(part.normals, only == 3 ? whole.normals : std::vector<float>{});
  }
}

TEST(RayRenderer, NormalsHaveUnitLengthAndFaceTheEye) {
  RayRenderer renderer(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}));
  FrameOptions options;
  options.channels.normals = true;
  const Frame frame = renderer.render({}, makeSquareCamera(), options);
  const std::size_t box = 3 * getPixelIndex(frame, 100, 100),
                    sky = 3 * getPixelIndex(frame, 10, 10);
  EXPECT_EQ(frame.normals[box + 2], 1);
  EXPECT_EQ(frame.normals[box], 0);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(frame.normals[sky + i], 0);
}

TEST(RayRenderer, NearAndFarCutAsInEveryPicture) {
  RayRenderer renderer(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}, {{0, 0, -9}, {9, 9, 1}, {}}}));
  Camera camera = makeSquareCamera();
  camera.near = 4.5;
  const Frame inside = renderer.render({}, camera);
  EXPECT_NEAR(inside.depth[getPixelIndex(inside, 100, 100)], 6,
              1e-6);  // the box's back face, from inside
  camera.near = 6.5;
  EXPECT_EQ(renderer.render({}, camera).ids[getPixelIndex(inside, 100, 100)], 2u);
  camera.far = 8;
  EXPECT_EQ(findIdsIn(renderer.render({}, camera)), (std::set<std::uint32_t>{0}));
}

TEST(RayRenderer, NamesEmbreeInItsFrames) {
  RayRenderer renderer(std::make_shared<const scene::Scene>(scene::Model{}));
  EXPECT_TRUE(renderer.render({}, makeSquareCamera(8)).renderer.starts_with("Embree "));
}

TEST(RayRenderer, IdsEqualThoseOfOpenGlExceptAtEdges) {
  const auto scene = makeScene(makeCrowd(300));
  scene::Snapshot snapshot;
  snapshot.avatars = {makeAvatarAt(301, {1, -1, -4})};
  RayRenderer rays(scene);
  GlRenderer gl(scene);
  std::size_t pixels = 0, differ = 0, awayFromEdges = 0, turned = 0;
  double meanColour = 0;
  const FrameOptions all{.channels = {true, true, true, true}};
  for (const Camera& camera : makeCamerasAround(Vec3::Zero(), 9, 201, 133)) {
    const Frame a = rays.render(snapshot, camera, all), b = gl.render(snapshot, camera, all);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t i = getPixelIndex(a, x, y);
        ++pixels;
        for (std::size_t c = 0; c < 3; ++c)
          meanColour += std::abs(int{a.rgb[3 * i + c]} - int{b.rgb[3 * i + c]}) / 3.0;
        if (a.ids[i] != b.ids[i]) {
          ++differ;
          if (!isNearAnEdge(a, x, y)) ++awayFromEdges;
        } else if (a.ids[i] != 0 && !isNearAnEdge(a, x, y)) {
          // GL's orthographic images spread 24 bits evenly over 60 m.
          ASSERT_NEAR(a.depth[i], b.depth[i], 3e-3);
          using Normal = Eigen::Map<const Eigen::Vector3f>;
          if (Normal(&a.normals[3 * i]).dot(Normal(&b.normals[3 * i])) < 0.999f) ++turned;
        }
      }
    }
  }
  EXPECT_LT(static_cast<double>(differ), 1e-3 * static_cast<double>(pixels));
  EXPECT_EQ(awayFromEdges, 0u);
  EXPECT_LT(static_cast<double>(turned), 1e-3 * static_cast<double>(pixels));  // on the box's edges
  EXPECT_LT(meanColour / static_cast<double>(pixels), 0.6);                    // of 255
}

TEST(RayRenderer, EveryShadeFromBlackToWhiteIsWithinAStepOfGl) {
  // A row of boxes, black except for their emission, from zero to far beyond white.
  constexpr int kBoxes = 100;
  std::vector<PlacedBox> boxes;
  for (int i = 0; i < kBoxes; ++i) {
    const float t = static_cast<float>(i) / kBoxes;
    scene::Material material = makeColoured(0, 0, 0);
    material.emissive = {4 * t * t * t, t * t, 0.02f * t};
    material.roughness = 1;
    boxes.push_back({{-4.95 + 0.1 * i, 0, -5}, {0.1, 1, 0.1}, material});
  }
  const auto scene = makeScene(boxes);
  RayRenderer rays(scene);
  GlRenderer gl(scene);
  const Frame a = rays.render({}, makeSquareCamera(400)), b = gl.render({}, makeSquareCamera(400));
  std::set<int> shades;
  for (int x = 2; x < 398; ++x) {
    const std::size_t i = 3 * getPixelIndex(a, x, 200);
    if (isNearAnEdge(a, x, 200)) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      shades.insert(a.rgb[i + c]);
      EXPECT_NEAR(a.rgb[i + c], b.rgb[i + c], 1) << x << ' ' << c;
    }
  }
  EXPECT_GT(shades.size(), 120u);
  EXPECT_LT(*shades.begin(), 40);
  EXPECT_EQ(*shades.rbegin(), 255);
}

TEST(RayRenderer, ColoursOfTexturesAndPlansAreThoseOfGl) {
  const auto scene = makeTexturedRoom();
  RayRenderer rays(scene);
  GlRenderer gl(scene);
  for (const Camera& camera :
       {makeSquareCamera(), makePlanCamera(scene->bounds(), -1, 0.2, 190, 121)}) {
    const Frame a = rays.render({}, camera), b = gl.render({}, camera);
    double sum = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
    EXPECT_LT(sum / static_cast<double>(a.rgb.size()), 0.2);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < a.ids.size(); ++i) differ += a.ids[i] != b.ids[i] ? 1 : 0;
    EXPECT_LE(differ, a.ids.size() / 1000);
  }
}

}  // namespace
}  // namespace enfilade::render
