// Tests that culling leaves no trace in the image.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "render/culling/depth_pyramid.hpp"
#include "tests/render/hand_made_scene.hpp"

namespace enfilade::render {
namespace {

using Random = std::mt19937;

double drawUniform(Random& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 5) * 0x1p-27);
}

Vec3 drawWithin(Random& random, double size) {
  const double x = drawUniform(random, -size, size), y = drawUniform(random, -size, size);
  const double z = drawUniform(random, -size, size);
  return {x, y, z};
}

/// Walls with many boxes behind them, some transparent, some in the same place as others.
std::vector<PlacedBox> makeRooms(unsigned seed) {
  Random random(seed);
  std::vector<PlacedBox> boxes;
  for (int i = -3; i <= 3; ++i) {
    boxes.push_back({{4.0 * i, 0, 0}, {0.2, 4, 30}, makeColoured(0.7f, 0.7f, 0.6f)});
    boxes.push_back({{0, 0, 4.0 * i}, {30, 4, 0.2}, makeColoured(0.5f, 0.6f, 0.7f)});
  }
  boxes.push_back({{0, -2, 0}, {30, 0.2, 30}, makeColoured(0.3f, 0.3f, 0.3f)});
  for (int i = 0; i < 600; ++i) {
    PlacedBox box{
        drawWithin(random, 12), (drawWithin(random, 0.5).cwiseAbs() + Vec3(0.05, 0.05, 0.05)),
        makeColoured(0.1f * static_cast<float>(i % 9), 0.5f, 0.4f, i % 11 == 0 ? 0.4f : 1)};
    box.centre.y() *= 0.15;
    if (i % 5 == 0) box.size.x() *= -1;
    boxes.push_back(box);
    if (i % 20 == 0) {  // in the same place, with another colour: a depth tie in every pixel
      box.material = makeColoured(0.9f, 0.1f, 0.1f);
      boxes.push_back(box);
    }
  }
  return boxes;
}

void expectSame(const Frame& a, const Frame& b, const std::string& where) {
  EXPECT_TRUE(a.rgb == b.rgb) << "colour, " << where;
  EXPECT_TRUE(a.ids == b.ids) << "ids, " << where;
  EXPECT_TRUE(a.normals == b.normals) << "normals, " << where;
  ASSERT_EQ(a.depth.size(), b.depth.size());
  EXPECT_EQ(std::memcmp(a.depth.data(), b.depth.data(), a.depth.size() * sizeof(float)), 0)
      << "depth, " << where;
}

Camera makeCameraAt(Random& random, int kind) {
  Camera camera;
  camera.eye = drawWithin(random, 11);
  camera.eye.y() *= 0.15;
  camera.forward = drawWithin(random, 1);
  camera.forward.y() *= 0.3;
  camera.width = 90;
  camera.height = 70;
  if (kind == 1) camera.pinhole = Pinhole{60, 80, 20, 50};
  if (kind == 2) {
    camera.projection = Camera::Projection::orthographic;
    camera.heightY = 9;
  }
  return camera;
}

TEST(DepthPyramid, HidesABoxExactlyIfEveryPixelHidesIt) {
  Random random(3);
  DepthPyramid pyramid;
  int hidden = 0, shown = 0;
  for (int picture = 0; picture < 60; ++picture) {
    const int width = 1 + static_cast<int>(random() % 90),
              height = 1 + static_cast<int>(random() % 90);
    std::vector<float>& depth = pyramid.baseLevel(width, height);
    for (float& d : depth) d = random() % 200 == 0 ? 0.1f : 0.5f;
    const std::vector<float> copy = depth;
    pyramid.build();
    for (int i = 0; i < 200; ++i) {
      PixelRect r{static_cast<int>(random() % static_cast<unsigned>(width)),
                  static_cast<int>(random() % static_cast<unsigned>(height)), 0, 0};
      r.right = std::min(width - 1, r.left + static_cast<int>(random() % 30));
      r.bottom = std::min(height - 1, r.top + static_cast<int>(random() % 30));
      bool all = true;
      for (int y = r.top; y <= r.bottom; ++y)
        for (int x = r.left; x <= r.right; ++x)
          all = all && copy[static_cast<std::size_t>(y * width + x)] > 0.3f;
      ASSERT_EQ(pyramid.isOccluded(r, 0.3f), all);
      ++(all ? hidden : shown);
    }
  }
  EXPECT_GT(hidden, 2000);
  EXPECT_GT(shown, 2000);
}

void expectSameFromAnywhere(DepthSource depthSource) {
  GlRenderer renderer(makeScene(makeRooms(1)), {.device = "", .depthSource = depthSource});
  Random random(5);
  std::uint64_t occluded = 0;
  for (int i = 0; i < 60; ++i) {
    const Camera camera = makeCameraAt(random, i % 4);
    const bool all = i % 5 != 0;  // otherwise ids and depth alone, which use another code path
    FrameOptions options{
        .channels = {all, true, true, all},
        .transparency = i % 3 == 0 ? TransparencyMode::opaque : TransparencyMode::blend};
    const Frame culled = renderer.render({}, camera, options);
    options.culling = Culling::frustum;
    const Frame drawn = renderer.render({}, camera, options);
    expectSame(culled, drawn, "picture " + std::to_string(i));
    EXPECT_LE(culled.statistics.drawn, drawn.statistics.drawn);
    occluded += culled.statistics.occluded;
  }
  EXPECT_GT(occluded, 60u * 50u);
}

TEST(Culling, PicturesFromAnywhereAreThoseOfDrawingEverything) {
  expectSameFromAnywhere(DepthSource::buffer);
}

TEST(Culling, ThePlaneDepthIsThatOfDrawingEverything) {
  expectSameFromAnywhere(DepthSource::plane);
}

TEST(Culling, AWalkKeepsItsPicturesAndMostlyDrawsOnce) {
  GlRenderer renderer(makeScene(makeRooms(2)));
  Camera camera;
  camera.width = camera.height = 80;
  std::uint32_t passes = 0, drawn = 0, inside = 0;
  constexpr int kSteps = 120;
  for (int i = 0; i < kSteps; ++i) {
    camera.eye = {-11 + 0.15 * i, 0.1, 1.7};
    camera.forward = {std::cos(0.02 * i), 0, std::sin(0.02 * i)};
    const Frame culled = renderer.render({}, camera);
    const Frame single = renderer.render({}, camera, {.culling = Culling::none});
    expectSame(culled, single, "step " + std::to_string(i));
    passes += culled.statistics.passes;
    drawn += culled.statistics.drawn;
    inside += single.statistics.drawn;
  }
  EXPECT_LT(passes, 2u * kSteps);
  EXPECT_LT(3 * drawn, 2 * inside);
}

TEST(Culling, CoincidentObjectsThatAppearLaterAreDrawnAsWithoutCulling) {
  // A red and a blue box in one place. A smaller box hides the red one, the first in order, from
  // the occlusion guess: the blue one is found a frame earlier.
  for (const bool swapped : {false, true}) {
    PlacedBox red{{0, 0, -6}, {2, 2, 2}, makeColoured(1, 0, 0)};
    PlacedBox blue{{0, 0, -5.5}, {2, 2, 1}, makeColoured(0, 0, 1)};
    if (swapped) std::swap(red, blue);
    std::vector<PlacedBox> boxes{red, blue, {{0, 0, -2}, {1, 6, 0.1}, makeColoured(0, 1, 0)}};
    // Behind the eye: enough boxes to start the search for occluded ones in any case.
    for (int i = 0; i < 300; ++i) boxes.push_back({{0, 0, 10.0 + i}, {0.5, 0.5, 0.5}, {}});
    GlRenderer renderer(makeScene(boxes));
    Camera camera = makeSquareCamera(64);
    for (int i = -40; i <= 40; ++i) {
      camera.eye.x() = 0.1 * i;
      for (const bool colours : {true, false}) {
        FrameOptions options{.channels = {.rgb = colours}};
        const Frame culled = renderer.render({}, camera, options);
        options.culling = Culling::frustum;
        expectSame(culled, renderer.render({}, camera, options), "step " + std::to_string(i));
      }
    }
  }
}

TEST(Culling, AWalkThatShowsIdsAloneKeepsThem) {
  GlRenderer renderer(makeScene(makeRooms(7)));
  Camera camera;
  camera.width = camera.height = 80;
  int once = 0, again = 0;
  for (int i = 0; i < 120; ++i) {
    camera.eye = {-11 + 0.15 * (i / 2), 0.1, 1.7};  // the camera moves in every second frame only
    camera.forward = {std::cos(0.02 * (i / 2)), 0, std::sin(0.02 * (i / 2))};
    FrameOptions options{.channels = {.rgb = false}};
    const Frame culled = renderer.render({}, camera, options);
    options.culling = Culling::frustum;
    expectSame(culled, renderer.render({}, camera, options), "step " + std::to_string(i));
    ++(culled.statistics.passes == 1 ? once : again);
  }
  EXPECT_GT(once, 30);
  EXPECT_GT(again, 5);
}

TEST(Culling, SeveralCamerasInTurnEachKeepTheirPictures) {
  GlRenderer renderer(makeScene(makeRooms(4)));
  std::vector<Camera> cameras;
  Random random(8);
  for (int i = 0; i < 6; ++i) cameras.push_back(makeCameraAt(random, 0));
  for (int turn = 0; turn < 8; ++turn) {
    for (Camera& camera : cameras) {
      camera.eye += 0.05 * camera.forward;
      const Frame culled = renderer.render({}, camera);
      expectSame(culled, renderer.render({}, camera, {.culling = Culling::frustum}), "a camera");
    }
  }
}

TEST(Culling, NothingIsLostWhereNothingHides) {
  GlRenderer renderer(makeScene({{{-1, 0, -5}, {0.5, 1, 1}, {}}, {{1, 0, -5}, {0.5, 1, 1}, {}}}));
  const Frame frame = renderer.render({}, makeSquareCamera(64));
  EXPECT_EQ(frame.statistics.drawn, 2u);
  EXPECT_EQ(frame.statistics.occluded, 0u);
  EXPECT_EQ(frame.statistics.frustumCulled, 0u);
}

TEST(Culling, ASmallSceneDrawsPoorOccludersAtOnce) {
  std::vector<PlacedBox> boxes{{{0, 0, -4}, {3, 3, 0.1}, {}}};
  for (int i = 0; i < 3; ++i) boxes.push_back({{-1.0 + i, 0, -2}, {0.3, 0.3, 0.3}, {}});
  for (int i = 0; i < 3; ++i) boxes.push_back({{-1.0 + i, 0, -6}, {0.3, 0.3, 0.3}, {}});
  const auto renderSecond = [](const std::vector<PlacedBox>& some) {
    GlRenderer renderer(makeScene(some));
    const Camera camera = makeSquareCamera(64);
    const Frame first = renderer.render({}, camera);
    EXPECT_EQ(first.statistics.drawn, 4u);  // the visibility cache was empty
    const Frame second = renderer.render({}, camera);
    expectSame(first, second, "with " + std::to_string(some.size()) + " boxes");
    return second.statistics;
  };
  EXPECT_EQ(renderSecond(boxes).drawn, 7u);
  EXPECT_EQ(renderSecond(boxes).passes, 1u);
  for (int i = 0; i < 9; ++i) boxes.push_back({{-0.4 + 0.1 * i, 1, -6}, {0.1, 0.1, 0.1}, {}});
  EXPECT_EQ(renderSecond(boxes).drawn, 4u);  // more boxes are hidden than visible
}

}  // namespace
}  // namespace enfilade::render
