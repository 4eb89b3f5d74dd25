#include "render/gl/gl_renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/image/image.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

TEST(GlRenderer, DepthIsTrueToRelative1e4NearAndFarInBothProjections) {
  for (const double distance : {0.06, 0.5, 3.0, 40.0, 900.0}) {
    GlRenderer renderer(makeScene({{{0, 0, -distance - 5}, {4 * distance, 4 * distance, 10}, {}}}));
    Camera camera = makeSquareCamera(50);
    const Frame perspective = renderer.render({}, camera);
    camera.projection = Camera::Projection::orthographic;
    camera.heightY = distance;
    const Frame parallel = renderer.render({}, camera);
    for (const float depth : perspective.depth) ASSERT_NEAR(depth, distance, 1e-4 * distance);
    // An orthographic image distributes its precision evenly over near..far.
    for (const float depth : parallel.depth) {
      ASSERT_NEAR(depth, distance, 1e-4 * std::max(distance, 1.0));
    }
  }
}

TEST(GlRenderer, TheTopOfTheWorldIsAtTheTopOfThePictureAndXToTheRight) {
  GlRenderer renderer(makeScene({{{0, 2, -5}, {1, 1, 1}, {}}, {{2, 0, -5}, {1, 1, 1}, {}}}));
  const Frame frame = renderer.render({}, makeSquareCamera());
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 100, 55)], 1u);
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 145, 100)], 2u);
  EXPECT_EQ(frame.ids[getPixelIndex(frame, 100, 145)], 0u);
}

TEST(GlRenderer, NearerHidesFartherWhateverTheirOrder) {
  const PlacedBox near{{0, 0, -3}, {1, 1, 1}, {}}, far{{0, 0, -6}, {1, 1, 1}, {}};
  GlRenderer one(makeScene({near, far}));
  GlRenderer other(makeScene({far, near}));
  EXPECT_EQ(one.render({}, makeSquareCamera()).ids[100 * 200 + 100], 1u);
  EXPECT_EQ(other.render({}, makeSquareCamera()).ids[100 * 200 + 100], 2u);
}

TEST(GlRenderer, AMirroredObjectLooksLikeItsOriginal) {
  GlRenderer straight(makeScene({{{0.3, 0.2, -4}, {2, 1, 1}, {}}}));
  GlRenderer mirrored(makeScene({{{0.3, 0.2, -4}, {-2, 1, 1}, {}}}));
  const Frame a = straight.render({}, makeSquareCamera());
  const Frame b = mirrored.render({}, makeSquareCamera());
  EXPECT_EQ(a.ids, b.ids);
  EXPECT_GT(std::count(a.ids.begin(), a.ids.end(), 1u), 100);
  for (std::size_t i = 0; i < a.rgb.size(); ++i) ASSERT_NEAR(a.rgb[i], b.rgb[i], 3) << i;
}

TEST(GlRenderer, SolidGlassIsAFirstHitInAllChannels) {
  const PlacedBox wall{{0, 0, -6}, {20, 20, 2}, makeColoured(0.8f, 0.8f, 0.8f)};
  const PlacedBox pane{{0, 0, -3}, {1, 1, 0.2}, makeColoured(0.05f, 0.05f, 0.9f, 0.5f)};
  PlacedBox opaque = pane;
  opaque.material = makeColoured(0.05f, 0.05f, 0.9f);
  const FrameOptions options{.channels = {true, true, true, true},
                             .transparency = TransparencyMode::opaque};
  const Frame solid = GlRenderer(makeScene({pane, wall})).render({}, makeSquareCamera(), options);
  const Frame expected =
      GlRenderer(makeScene({opaque, wall})).render({}, makeSquareCamera(), options);
  EXPECT_EQ(solid.ids[getPixelIndex(solid, 100, 100)], 1u);
  EXPECT_NEAR(solid.depth[getPixelIndex(solid, 100, 100)], 2.9, 3e-4);
  EXPECT_EQ(solid.rgb, expected.rgb);
  EXPECT_EQ(solid.ids, expected.ids);
  EXPECT_EQ(solid.normals, expected.normals);
}

TEST(GlRenderer, NormalsAreThoseOfTheFacesAndLookAtTheEye) {
  GlRenderer renderer(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}, {{0, -3, -5}, {40, 1, 4}, {}}}));
  Camera camera = makeSquareCamera();
  camera.pinhole = Pinhole{100, 100, 100, 100};
  const Frame frame = renderer.render({}, camera, {.channels = {false, true, true, true}});
  EXPECT_TRUE(frame.rgb.empty());
  ASSERT_EQ(frame.normals.size(), 3u * 200u * 200u);
  const auto normal = [&](int x, int y) {
    const float* n = &frame.normals[3 * getPixelIndex(frame, x, y)];
    return Eigen::Vector3f(n[0], n[1], n[2]);
  };
  EXPECT_LT((normal(100, 100) - Eigen::Vector3f::UnitZ()).norm(), 1e-4f);
  ASSERT_EQ(frame.ids[getPixelIndex(frame, 100, 160)], 2u);
  EXPECT_LT((normal(100, 160) - Eigen::Vector3f::UnitY()).norm(), 1e-4f);
  EXPECT_EQ(normal(3, 3), Eigen::Vector3f(0, 0, 0));
}

TEST(GlRenderer, EachChannelIsIndependentOfTheOtherRequestedChannels) {
  GlRenderer renderer(makeScene(makeCrowd(200)));
  const Frame all = renderer.render({}, makeSquareCamera(), {.channels = {true, true, true, true}});
  for (int asked = 0; asked < 16; ++asked) {
    const Channels channels{(asked & 1) != 0, (asked & 2) != 0, (asked & 4) != 0, (asked & 8) != 0};
    const Frame some = renderer.render({}, makeSquareCamera(), {.channels = channels});
    EXPECT_EQ(some.rgb, channels.rgb ? all.rgb : std::vector<std::uint8_t>{}) << asked;
    EXPECT_EQ(some.ids, channels.ids ? all.ids : std::vector<std::uint32_t>{}) << asked;
    EXPECT_EQ(some.normals, channels.normals ? all.normals : std::vector<float>{}) << asked;
    ASSERT_EQ(some.depth.size(), channels.depth ? all.depth.size() : 0) << asked;
    EXPECT_EQ(std::memcmp(some.depth.data(), all.depth.data(), some.depth.size() * sizeof(float)),
              0);
  }
}

TEST(GlRenderer, AnOffCentrePinholeSeesPartOfALargerImage) {
  // The right half of an image of twice the width: same focal length, principal axis at the left
  // border.
  GlRenderer renderer(makeScene(makeCrowd(200)));
  Camera wide = makeSquareCamera(100);
  wide.width = 200;
  wide.pinhole = Pinhole{50, 50, 100, 50};
  Camera right = makeSquareCamera(100);
  right.pinhole = Pinhole{50, 50, 0, 50};
  const Frame whole = renderer.render({}, wide), half = renderer.render({}, right);
  int differing = 0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      const bool same =
          half.ids[getPixelIndex(half, x, y)] == whole.ids[getPixelIndex(whole, 100 + x, y)];
      differing += same ? 0 : 1;
      const std::size_t a = 3 * getPixelIndex(half, x, y), b = 3 * getPixelIndex(whole, 100 + x, y);
      if (same) {
        ASSERT_NEAR(half.rgb[a], whole.rgb[b], 60) << x << ' ' << y;
      }
    }
  }
  EXPECT_LT(differing, 20) << "rounding at edges";
}

TEST(GlRenderer, RangeIsTheDistanceFromTheEye) {
  GlRenderer renderer(makeScene({{{0, 0, -5}, {40, 40, 2}, {}}}));
  Camera camera = makeSquareCamera();
  const Frame frame = renderer.render({}, camera);
  const std::vector<float> range = computeRange(frame);
  EXPECT_NEAR(range[getPixelIndex(frame, 100, 100)], 4, 1e-3);
  const double aside = 0.5 / 100 - 1;  // of the first pixel's centre, at distance 1
  EXPECT_NEAR(range[getPixelIndex(frame, 0, 0)], 4 * std::sqrt(1 + 2 * aside * aside), 2e-3);
  camera.projection = Camera::Projection::orthographic;
  const Frame parallel = renderer.render({}, camera);
  EXPECT_EQ(computeRange(parallel)[0], parallel.depth[0]);
}

TEST(GlRenderer, ADeviceThatIsNotThereIsRefusedWithAllThatWereTried) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}});
  try {
    GlRenderer renderer(scene, {.device = "no such device"});
    ADD_FAILURE() << "drawn with " << renderer.deviceName();
  } catch (const RenderError& error) {
    EXPECT_NE(std::string(error.what()).find("EGL"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("no such device"), std::string::npos);
  }
  const GlRenderer first(scene, {.device = "0"});
  const GlRenderer named(scene, {.device = first.deviceName().substr(0, 4)});
  EXPECT_EQ(named.deviceName(), first.deviceName());
  if (first.software()) {
    EXPECT_THROW(GlRenderer(scene, {.device = "0", .requireGpu = true}), RenderError);
  }
}

TEST(GlRenderer, TheSamePictureHasTheSameBytesInEveryRenderer) {
  const auto scene = makeScene(makeCrowd(300));
  scene::Snapshot snapshot;
  snapshot.avatars = {makeAvatarAt(301, {1, -1, -4})};
  Camera camera = makeSquareCamera(300);
  GlRenderer first(scene);
  const Frame a = first.render(snapshot, camera);
  camera.forward = Vec3::UnitX();
  first.render(snapshot, camera);
  camera.forward = -Vec3::UnitZ();
  const Frame again = first.render(snapshot, camera);
  GlRenderer second(scene);
  const Frame b = second.render(snapshot, camera);
  EXPECT_EQ(a.rgb, again.rgb);
  EXPECT_EQ(a.rgb, b.rgb);
  EXPECT_EQ(a.ids, b.ids);
  EXPECT_EQ(findIdsIn(a).count(301), 1u);
}

TEST(GlRenderer, ProjectAgreesWithThePictureOfIds) {
  std::vector<PlacedBox> boxes = makeCrowd(60);
  for (PlacedBox& box : boxes) {
    box.material.alpha = scene::Material::Alpha::opaque;
    box.size = Vec3::Constant(0.15);
  }
  GlRenderer renderer(makeScene(boxes));
  int seen = 0;
  for (const bool parallel : {false, true}) {
    Camera camera;
    camera.eye = {1, 2, 12};
    camera.forward = {-0.1, -0.2, -1};
    camera.heightY = 18;
    if (parallel) camera.projection = Camera::Projection::orthographic;
    const Frame frame = renderer.render({}, camera);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Vec3 pixel = project(camera, boxes[i].centre);
      if (!(pixel.x() >= 0 && pixel.x() < camera.width && pixel.y() >= 0 &&
            pixel.y() < camera.height && pixel.z() > 0.2)) {
        continue;
      }
      const std::size_t index =
          getPixelIndex(frame, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
      if (frame.depth[index] < pixel.z() - 0.2) continue;  // occluded
      EXPECT_EQ(frame.ids[index], i + 1);
      EXPECT_NEAR(frame.depth[index], pixel.z(), 0.15);
      ++seen;
    }
  }
  EXPECT_GT(seen, 60);
}

TEST(GlRenderer, SizesMayChangeFromPictureToPicture) {
  GlRenderer renderer(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}));
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(333, 7), std::pair(8, 8)}) {
    Camera camera = makeSquareCamera();
    camera.width = width;
    camera.height = height;
    const Frame frame = renderer.render({}, camera);
    EXPECT_EQ(frame.rgb.size(), 3 * frame.ids.size());
    EXPECT_EQ(frame.ids[getPixelIndex(frame, width / 2, height / 2)], 1u) << width;
  }
}

TEST(GlRenderer, FiftyAreCreatedAndDestroyedAndTwoCoexist) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}});
  GlRenderer lasting(scene);
  const Frame before = lasting.render({}, makeSquareCamera(40));
  for (int i = 0; i < 50; ++i) {
    GlRenderer renderer(scene);
    if (i % 10 == 0) {
      EXPECT_EQ(renderer.render({}, makeSquareCamera(40)).rgb, before.rgb);
    }
  }
  EXPECT_EQ(lasting.render({}, makeSquareCamera(40)).rgb, before.rgb);
  EXPECT_FALSE(lasting.deviceName().empty());
  EXPECT_EQ(before.renderer, lasting.deviceName());
}

}  // namespace
}  // namespace enfilade::render
