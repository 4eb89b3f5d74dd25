// Tests of both renderers: they draw the same scenes with the same answers.
#include "render/renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <type_traits>

#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

/// Error of a depth, as a fraction of it: the depth buffer's, and that of a float.
template <class Kind>
constexpr double kDepthError = 1e-4;
template <>
constexpr double kDepthError<RayRenderer> = 1e-7;

template <class Kind>
class BothRenderers : public ::testing::Test {};
using Kinds = ::testing::Types<GlRenderer, RayRenderer>;
struct KindNames {
  template <class Kind>
  static std::string GetName(int) {  // NOLINT: gtest's name
    return std::is_same_v<Kind, GlRenderer> ? "OpenGL" : "Rays";
  }
};
TYPED_TEST_SUITE(BothRenderers, Kinds, KindNames);

TYPED_TEST(BothRenderers, SeeABoxExactlyWhereItsGeometrySays) {
  // The box's face is 2 m square, 4 m ahead; the image is 8 m wide there: the middle 50 pixels of
  // 200.
  TypeParam renderer(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}));
  const Frame frame = renderer.render({}, makeSquareCamera());
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      const bool inside = x >= 75 && x < 125 && y >= 75 && y < 125;
      ASSERT_EQ(frame.ids[getPixelIndex(frame, x, y)], inside ? 1u : 0u) << x << ' ' << y;
      const float depth = frame.depth[getPixelIndex(frame, x, y)];
      if (inside) {
        ASSERT_NEAR(depth, 4, 4 * kDepthError<TypeParam>);
      } else {
        ASSERT_TRUE(std::isnan(depth));
      }
    }
  }
}

TYPED_TEST(BothRenderers, TintTheColourByGlassAndLetIdsAndDepthThrough) {
  const PlacedBox wall{{0, 0, -6}, {20, 20, 2}, makeColoured(0.8f, 0.8f, 0.8f)};
  const PlacedBox pane{{0, 0, -3}, {1, 1, 0.1}, makeColoured(0.05f, 0.05f, 0.9f, 0.5f)};
  TypeParam renderer(makeScene({pane, wall}));
  const Frame frame = renderer.render({}, makeSquareCamera());
  EXPECT_EQ(findIdsIn(frame), (std::set<std::uint32_t>{2}));
  const std::size_t through = getPixelIndex(frame, 100, 100),
                    nextTo = getPixelIndex(frame, 20, 100);
  EXPECT_NEAR(frame.depth[through], 5, 5 * kDepthError<TypeParam>);
  EXPECT_LT(frame.rgb[3 * through] + 30, frame.rgb[3 * nextTo]);
  EXPECT_GT(frame.rgb[3 * through + 2], frame.rgb[3 * through] + 30);
  EXPECT_NEAR(frame.rgb[3 * nextTo], frame.rgb[3 * nextTo + 2], 25);
  const Frame solid =
      renderer.render({}, makeSquareCamera(), {.transparency = TransparencyMode::opaque});
  EXPECT_EQ(solid.ids[through], 1u);
  EXPECT_NEAR(solid.depth[through], 2.95, 3 * kDepthError<TypeParam>);
  EXPECT_EQ(solid.ids[nextTo], 2u);
}

TYPED_TEST(BothRenderers, DoNotShowGlassBehindAWall) {
  const PlacedBox wall{{0, 0, -3}, {20, 20, 1}, {}};
  const PlacedBox pane{{0, 0, -6}, {9, 9, 0.1}, makeColoured(0.9f, 0.0f, 0.0f, 0.5f)};
  TypeParam with(makeScene({wall, pane}));
  TypeParam without(makeScene({wall}));
  EXPECT_EQ(with.render({}, makeSquareCamera()).rgb, without.render({}, makeSquareCamera()).rgb);
}

TYPED_TEST(BothRenderers, CutTheHolesOfAMaskIntoIdsAndDepth) {
  TypeParam renderer(makeMaskedSquare());
  const Frame frame = renderer.render({}, makeSquareCamera());
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 60, 100)], 1u);
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 140, 100)], 0u);
  EXPECT_TRUE(std::isnan(frame.depth[getPixelIndex(frame, 140, 100)]));
}

TYPED_TEST(BothRenderers, DrawAllAvatarsWhereTheyStandExceptTheHiddenOne) {
  TypeParam renderer(makeScene({{{0, 0, -20}, {60, 60, 1}, {}}}));
  scene::Snapshot snapshot;
  snapshot.tick = 42;
  snapshot.avatars = {makeAvatarAt(2, {-1, -1, -4}), makeAvatarAt(3, {1, -1, -4})};
  const Frame both = renderer.render(snapshot, makeSquareCamera());
  EXPECT_EQ(both.tick, 42u);
  EXPECT_EQ(findIdsIn(both), (std::set<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(both.ids[getPixelIndex(both, 75, 100)], 2u);
  EXPECT_EQ(both.ids[getPixelIndex(both, 125, 100)], 3u);
  EXPECT_NEAR(both.depth[getPixelIndex(both, 75, 100)], 3.7, 4 * kDepthError<TypeParam>);
  EXPECT_EQ(findIdsIn(renderer.render(snapshot, makeSquareCamera(), {.hiddenEntity = 2})),
            (std::set<std::uint32_t>{1, 3}));
  snapshot.avatars.front().footPosition.x() = 1;
  snapshot.avatars.back().footPosition.x() = -1;
  const Frame moved = renderer.render(snapshot, makeSquareCamera());
  EXPECT_EQ(moved.ids[getPixelIndex(moved, 75, 100)], 3u);
  snapshot.avatars.clear();
  EXPECT_EQ(findIdsIn(renderer.render(snapshot, makeSquareCamera())), (std::set<std::uint32_t>{1}));
}

TYPED_TEST(BothRenderers, ShowSkyInAnEmptyScene) {
  TypeParam renderer(std::make_shared<const scene::Scene>(scene::Model{}));
  const Frame frame = renderer.render({}, makeSquareCamera());
  EXPECT_EQ(findIdsIn(frame), (std::set<std::uint32_t>{0}));
  EXPECT_GT(frame.rgb[2], 100);
  EXPECT_EQ(frame.rgb.size(), 200u * 200u * 3u);
}

TYPED_TEST(BothRenderers, RefuseABadCameraAndDrawTheNextPicture) {
  TypeParam renderer(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}));
  Camera bad = makeSquareCamera();
  bad.far = std::nan("");
  EXPECT_THROW(renderer.render({}, bad), RenderError);
  EXPECT_EQ(findIdsIn(renderer.render({}, makeSquareCamera())), (std::set<std::uint32_t>{0, 1}));
}

}  // namespace
}  // namespace enfilade::render
