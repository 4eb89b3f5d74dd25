// Tests of several samples a pixel, against pictures of eight times the size.
#include "render/camera/samples.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "render/camera/lens.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "render/renderer_kind.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

TEST(MeanColour, OfEqualBytesIsThatByteAndOfBlackAndWhiteIsHalfTheLight) {
  std::vector<std::uint8_t> all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
  MeanColour same(256);
  for (int i = 0; i < 16; ++i) same.add(all);
  EXPECT_EQ(same.compute(), all);
  MeanColour grey(1);
  grey.add({0});
  grey.add({255});
  EXPECT_EQ(grey.compute(), std::vector<std::uint8_t>{188});
}

TEST(SamplePositions, AreCentredAndNoTwoShareARowOrAColumn) {
  for (const int count : {4, 16}) {
    const auto positions = getSamplePositions(count);
    ASSERT_EQ(positions.size(), static_cast<std::size_t>(count));
    Eigen::Vector2d sum(0, 0);
    std::set<double> columns, rows;
    for (const Eigen::Vector2d& position : positions) {
      EXPECT_LT(position.cwiseAbs().maxCoeff(), 0.5);
      sum += position;
      columns.insert(position.x());
      rows.insert(position.y());
    }
    EXPECT_LT(sum.norm(), 1e-12);
    EXPECT_EQ(columns.size(), positions.size());
    EXPECT_EQ(rows.size(), positions.size());
  }
}

std::vector<Camera> makeCamerasOfAllProjections() {
  Camera camera;
  camera.eye = {1, 2, 6};
  camera.forward = {-0.2, -0.3, -1};
  camera.width = 64;
  camera.height = 48;
  std::vector<Camera> cameras(3, camera);
  cameras[1].pinhole = Pinhole{70, 55, 20.5, 30};
  cameras[2].projection = Camera::Projection::orthographic;
  cameras[2].heightY = 14;
  return cameras;
}

TEST(ShiftCamera, MovesThePictureByTheOffset) {
  const Eigen::Vector2d offset(0.3, -0.2);
  for (const Camera& camera : makeCamerasOfAllProjections()) {
    const Vec3 point(0.4, -0.5, 0.6);
    const Vec3 whole = project(camera, point),
               shifted = project(shiftCamera(camera, offset), point);
    EXPECT_NEAR(whole.x() - shifted.x(), offset.x(), 1e-9);
    EXPECT_NEAR(whole.y() - shifted.y(), offset.y(), 1e-9);
    EXPECT_NEAR(whole.z(), shifted.z(), 1e-9);
  }
  for (const auto kind : {Camera::Lens::Kind::fisheye, Camera::Lens::Kind::equirectangular}) {
    Camera camera = makeCamerasOfAllProjections().front();
    camera.lens = Camera::Lens{.kind = kind};
    const auto a = LensMapping(camera).directionAt(20.5 + offset.x(), 9.5 + offset.y());
    const auto b = LensMapping(shiftCamera(camera, offset)).directionAt(20.5, 9.5);
    ASSERT_TRUE(a && b);
    EXPECT_LT((*a - *b).norm(), 1e-12);
  }
}

class Samples : public testing::TestWithParam<RendererKind> {
 protected:
  std::unique_ptr<Renderer> makeRenderer(const std::shared_ptr<const scene::Scene>& scene) const {
    if (GetParam() == RendererKind::gl) return std::make_unique<GlRenderer>(scene);
    return std::make_unique<RayRenderer>(scene);
  }
};

double toLinear(std::uint8_t byte) {
  const double s = byte / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

/// The mean difference of linear light from a picture of eight times the size.
double computeMeanDifference(const Frame& large, const Frame& frame) {
  constexpr int kScale = 8;
  double sum = 0;
  for (int y = 0; y < frame.camera.height; ++y) {
    for (int x = 0; x < frame.camera.width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        double mean = 0;
        for (int v = 0; v < kScale; ++v)
          for (int u = 0; u < kScale; ++u)
            mean +=
                toLinear(large.rgb[3 * getPixelIndex(large, kScale * x + u, kScale * y + v) + c]);
        sum += std::abs(mean / (kScale * kScale) -
                        toLinear(frame.rgb[3 * getPixelIndex(frame, x, y) + c]));
      }
    }
  }
  return sum / static_cast<double>(frame.rgb.size());
}

/// Boxes so far apart that ambient occlusion, which depends on the size of the picture, is absent.
std::shared_ptr<const scene::Scene> makeBoxesApart() {
  std::vector<PlacedBox> boxes;
  for (int i = 0; i < 27; ++i) {
    const Vec3 place(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 2);
    boxes.push_back({3.5 * place, {1, 1.2, 0.8}, makeColoured(0.9f, 0.2f, 0.1f)});
  }
  return makeScene(boxes);
}

TEST_P(Samples, ApproachThePictureOfEightTimesTheSize) {
  const auto renderer = makeRenderer(makeBoxesApart());
  for (const Camera& camera : makeCamerasOfAllProjections()) {
    Camera enlarged = camera;
    enlarged.width *= 8;
    enlarged.height *= 8;
    if (camera.pinhole)
      enlarged.pinhole = Pinhole{8 * camera.pinhole->fx, 8 * camera.pinhole->fy,
                                 8 * camera.pinhole->cx, 8 * camera.pinhole->cy};
    const Frame large = renderer->render({}, enlarged);
    double previous = 1;
    SCOPED_TRACE(static_cast<int>(camera.projection));
    for (const std::uint32_t samples : {1u, 4u, 16u}) {
      const Frame frame = renderer->render({}, camera, {.samples = samples});
      EXPECT_EQ(frame.samples, samples);
      const double difference = computeMeanDifference(large, frame);
      EXPECT_LT(difference, 0.7 * previous) << samples << " samples";
      previous = difference;
    }
  }
}

TEST_P(Samples, ChangeOnlyTheColour) {
  const auto renderer = makeRenderer(makeScene(makeCrowd(200)));
  FrameOptions options{.channels = {true, true, true, true}};
  for (const Camera& camera : makeCamerasOfAllProjections()) {
    options.samples = 1;
    const Frame one = renderer->render({}, camera, options);
    options.samples = 4;
    const Frame four = renderer->render({}, camera, options);
    EXPECT_FALSE(one.rgb == four.rgb);
    EXPECT_TRUE(one.ids == four.ids);
    EXPECT_TRUE(one.normals == four.normals);
    EXPECT_EQ(std::memcmp(one.depth.data(), four.depth.data(), 4 * one.depth.size()), 0);
    EXPECT_EQ(four.camera.eye, camera.eye);
    EXPECT_EQ(four.camera.pinhole.has_value(), camera.pinhole.has_value());
    FrameOptions colour{.channels = {true, false, false, false}, .samples = 4};
    EXPECT_TRUE(renderer->render({}, camera, colour).rgb == four.rgb);
  }
}

TEST_P(Samples, OfOtherNumbersAreRefusedByName) {
  const auto renderer = makeRenderer(makeScene(makeCrowd(3)));
  for (const std::uint32_t samples : {0u, 2u, 3u, 8u, 64u}) {
    try {
      renderer->render({}, makeSquareCamera(8), {.samples = samples});
      ADD_FAILURE() << samples;
    } catch (const RenderError& error) {
      EXPECT_EQ(error.what(), "samples is " + std::to_string(samples) + "; it must be 1, 4 or 16");
    }
  }
}

TEST(SamplesOfALens, SmoothItsEdges) {
  RayRenderer renderer(makeScene(makeOpaque(makeCrowd(200))));
  for (const auto kind : {Camera::Lens::Kind::fisheye, Camera::Lens::Kind::equirectangular}) {
    Camera camera = makeCamerasOfAllProjections().front();
    camera.lens = Camera::Lens{.kind = kind};
    Camera enlarged = camera;
    enlarged.width *= 8;
    enlarged.height *= 8;
    const Frame large = renderer.render({}, enlarged);
    const double one = computeMeanDifference(large, renderer.render({}, camera));
    EXPECT_LT(computeMeanDifference(large, renderer.render({}, camera, {.samples = 16})),
              0.4 * one);
  }
}

INSTANTIATE_TEST_SUITE_P(OfBothRenderers, Samples,
                         testing::Values(RendererKind::gl, RendererKind::rays),
                         [](const auto& kind) { return std::string(toString(kind.param)); });

}  // namespace
}  // namespace enfilade::render
