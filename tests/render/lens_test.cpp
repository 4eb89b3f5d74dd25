// Fisheye and equirectangular frames against closed formulas and rays in double precision.
#include "render/camera/lens.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "render/image/depth_noise.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "scene/world/queries/ray_caster.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

constexpr double kPi = std::numbers::pi;

Camera makeLensCamera(Camera::Lens::Kind kind, int width, int height) {
  Camera camera;
  camera.eye = {0.3, 0.2, -0.1};
  camera.forward = {1, 0.3, -0.4};
  camera.up = {0.1, 1, 0.2};
  camera.width = width;
  camera.height = height;
  camera.lens = Camera::Lens{kind};
  return camera;
}

/// cv::fisheye::projectPoints of a direction in OpenCV's camera frame (x right, y down, z ahead).
std::pair<double, double> projectFisheye(const Vec3& point, const Pinhole& pinhole,
                                         const std::array<double, 4>& k) {
  const double r = std::hypot(point.x(), point.y());
  const double angle = std::atan2(r, point.z());
  double distorted = angle;
  for (std::size_t i = 0; i < 4; ++i)
    distorted += k[i] * std::pow(angle, static_cast<double>(2 * i + 3));
  const double scale = r > 0 ? distorted / r : 1;
  return {pinhole.fx * scale * point.x() + pinhole.cx, pinhole.fy * scale * point.y() + pinhole.cy};
}

/// The direction, in the scene's frame, of a point in OpenCV's camera frame (x right, y down, z
/// ahead).
Vec3 toSceneDirection(const Camera& camera, const Vec3& point) {
  const Vec3 forward = camera.forward.normalized(), right = forward.cross(camera.up).normalized(),
             down = forward.cross(right);
  return (point.x() * right + point.y() * down + point.z() * forward).normalized();
}

TEST(Lens, AFisheyeIsThatOfOpenCv) {
  struct Projected {
    Vec3 point;
    std::array<double, 4> k;
    double x, y;  ///< pixels, by cv2.fisheye.projectPoints of OpenCV 4.6.0
  };
  const Projected projections[] = {
      {{-0.8, -1.32, 0.25}, {0, 0, 0, 0}, 163.8159526252, 20.8565057399},
      {{0.42, 1.14, 0.11}, {0, 0, 0, 0}, 412.3634018927, 513.9513434519},
      {{-0.55, -0.78, 0.75}, {0, 0, 0, 0}, 205.7226383433, 109.5099545679},
      {{1.63, 0.27, 0.123}, {0, 0, 0, 0}, 605.2740857254, 296.4649098089},
      {{-0.96, 1.6, 0.2}, {0.05, -0.01, 0.002, -0.0003}, 148.1172310634, 506.3143841496},
      {{-1.73, -0.08, 1.16}, {0.05, -0.01, 0.002, -0.0003}, 106.1780934249, 241.0459740464},
      {{-0.63, -0.49, 0.71}, {0.05, -0.01, 0.002, -0.0003}, 172.6422124743, 148.5078569949},
      {{0.55, -0.06, 0.059}, {0.05, -0.01, 0.002, -0.0003}, 622.9138279504, 217.5707487397},
      {{0.41, 0.83, 1.64}, {-0.02, 0.003, 0, 0}, 355.2882285156, 337.0969955720},
      {{-0.26, -0.98, 0.17}, {-0.02, 0.003, 0, 0}, 239.9601365548, -0.7965879519},
      {{-1.29, 0.02, 0.04}, {-0.02, 0.003, 0, 0}, 11.4851679732, 254.3967300841},
      {{-0.3, -1.05, 0.04}, {-0.02, 0.003, 0, 0}, 228.2726298148, -21.7435058659},
  };
  for (const auto& [point, k, x, y] : projections) {
    Camera camera = makeLensCamera(Camera::Lens::Kind::fisheye, 640, 480);
    camera.pinhole = Pinhole{200, 190, 310, 250};
    camera.lens->k = k;
    const auto direction = LensMapping(camera).directionAt(x, y);
    ASSERT_TRUE(direction);
    EXPECT_LT((*direction - toSceneDirection(camera, point)).norm(), 1e-9) << x << " " << y;
  }
}

TEST(Lens, AFisheyeInvertsOpenCvsProjection) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const std::array<double, 4>& k :
       {std::array<double, 4>{}, {0.05, -0.01, 0.002, -0.0003}, {-0.02, 0.003, 0, 0}}) {
    Camera camera = makeLensCamera(Camera::Lens::Kind::fisheye, 640, 480);
    camera.pinhole = Pinhole{200, 190, 310, 250};
    camera.lens->k = k;
    ASSERT_FALSE(validateCamera(camera));
    const LensMapping lens(camera);
    int checked = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 point(normal(random), normal(random), normal(random));
      if (std::atan2(std::hypot(point.x(), point.y()), point.z()) > 1.9) continue;
      const auto [x, y] = projectFisheye(point, *camera.pinhole, k);
      const auto direction = lens.directionAt(x, y);
      ASSERT_TRUE(direction);
      EXPECT_LT((*direction - toSceneDirection(camera, point)).norm(), 1e-9);
      ++checked;
    }
    EXPECT_GT(checked, 1000);
  }
}

TEST(Lens, WidthOfAFisheyeAndTheRimOfItsModel) {
  Camera camera = makeLensCamera(Camera::Lens::Kind::fisheye, 200, 100);
  const Vec3 forward = camera.forward.normalized();
  EXPECT_NEAR(LensMapping(camera).directionAt(0, 50)->dot(forward), 0, 1e-12);
  EXPECT_LT((*LensMapping(camera).directionAt(100, 50) - forward).norm(), 1e-12);
  camera.lens->width = 2 * kPi;
  EXPECT_NEAR(LensMapping(camera).directionAt(0, 50)->dot(forward), -1, 1e-12);
  EXPECT_FALSE(LensMapping(camera).directionAt(0, 0)) << "beyond half a turn";
  camera.pinhole = Pinhole{100, 100, 100, 50};
  camera.lens->k = {-0.3, 0, 0, 0};  // increases up to 1.054 radians
  EXPECT_TRUE(LensMapping(camera).directionAt(100 + 70, 50));
  EXPECT_FALSE(LensMapping(camera).directionAt(100 + 71, 50));
}

TEST(Lens, AnEquirectangularPictureHasAnglesAsARangeScan) {
  const Camera camera = makeLensCamera(Camera::Lens::Kind::equirectangular, 720, 360);
  const LensMapping lens(camera);
  scene::RangeScan scan;
  scan.forward = camera.forward;
  scan.up = camera.up;
  scan.width = 2 * kPi;
  scan.height = kPi;
  scan.columns = 24;
  scan.rows = 13;
  const std::vector<scene::Ray> rays = makeScanRays(scan);
  for (std::uint32_t row = 0; row < scan.rows; ++row)
    for (std::uint32_t column = 0; column < scan.columns; ++column) {
      const auto direction = lens.directionAt(30.0 * column, 30.0 * row);
      EXPECT_LT((*direction - rays[row * scan.columns + column].direction).norm(), 1e-12);
    }
}

TEST(Lens, FramesShowWhatRaysInDoublesMeet) {
  const auto scene = makeScene(makeCrowd(60));
  scene::RayCaster caster(scene);
  caster.update({});
  RayRenderer renderer(scene);
  for (const auto kind : {Camera::Lens::Kind::fisheye, Camera::Lens::Kind::equirectangular}) {
    Camera camera = makeLensCamera(kind, 96, 64);
    camera.lens->width = 1.6 * kPi;
    FrameOptions options;
    options.channels = {true, true, true, true};
    const Frame frame = renderer.render({}, camera, options);
    const std::vector<float> range = computeRange(frame);
    const LensMapping lens(camera);
    int hits = 0, differing = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const auto pixel = static_cast<std::size_t>(y * camera.width + x);
        const auto direction = lens.directionAt(x + 0.5, y + 0.5);
        const auto hit =
            direction ? caster.firstHit({camera.eye, *direction}, {.ignoreTransparent = true})
                      : std::nullopt;
        if (!hit || hit->distance < camera.near) continue;
        ++hits;
        if (frame.ids[pixel] != hit->entity) {
          ++differing;  // at edges single precision selects another surface
          continue;
        }
        EXPECT_NEAR(range[pixel], hit->distance, 1e-6 * hit->distance);
        const double depth = hit->distance * direction->dot(camera.forward.normalized());
        EXPECT_NEAR(frame.depth[pixel], depth, 1e-6 * hit->distance);
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_NEAR(frame.normals[3 * pixel + i], hit->normal[static_cast<int>(i)], 1e-5);
      }
    EXPECT_GT(hits, 400);
    EXPECT_LE(differing, hits / 500);
    RayRenderer alone(scene, {.threads = 1});
    const Frame again = alone.render({}, camera, options);
    EXPECT_EQ(again.rgb, frame.rgb);
    EXPECT_EQ(again.ids, frame.ids);
  }
}

TEST(Lens, InTheMiddleColoursAreThoseOfAPinhole) {
  const auto scene = makeScene(makeCrowd(60));
  RayRenderer renderer(scene);
  Camera pinhole = makeLensCamera(Camera::Lens::Kind::fisheye, 64, 64);
  pinhole.pinhole = Pinhole{600, 600, 32, 32};  // 6 degrees: almost no distortion
  Camera fisheye = pinhole;
  pinhole.lens.reset();
  FrameOptions options;
  const Frame a = renderer.render({}, pinhole, options), b = renderer.render({}, fisheye, options);
  std::size_t close = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) close += std::abs(a.rgb[i] - b.rgb[i]) <= 12;
  EXPECT_GT(close, a.rgb.size() * 95 / 100) << "but for ambient occlusion and edges";
}

TEST(Lens, CornersAreDarkerThanTheMiddleOfWalls) {
  PlacedBox floor, wall;
  floor.centre = {2, -1.6, 0}, floor.size = {8, 0.2, 8};
  wall.centre = {3.1, 0, 0}, wall.size = {0.2, 4, 8};
  floor.material = wall.material = makeColoured(0.6f, 0.6f, 0.6f, 1);
  RayRenderer renderer(makeScene({floor, wall}));
  for (const auto kind : {Camera::Lens::Kind::fisheye, Camera::Lens::Kind::equirectangular}) {
    Camera camera = makeLensCamera(kind, 400, 200);
    camera.eye = Vec3::Zero();
    camera.forward = Vec3::UnitX();
    camera.up = Vec3::UnitY();
    FrameOptions options;
    options.channels = {true, false, true, false};
    const Frame frame = renderer.render({}, camera, options);
    const LensMapping lens(camera);
    const auto greyAlong = [&](double up) {  // of the wall, at this height
      double minDifference = 1e9;
      const Vec3 target(3, up, 0);
      int at = -1;
      for (int pixel = 0; pixel < 400 * 200; ++pixel) {
        const auto direction = lens.directionAt(pixel % 400 + 0.5, pixel / 400 + 0.5);
        if (direction && (*direction - target.normalized()).norm() < minDifference)
          minDifference = (*direction - target.normalized()).norm(), at = pixel;
      }
      return int{frame.rgb[3 * static_cast<std::size_t>(at)]};
    };
    EXPECT_LT(greyAlong(-1.45), greyAlong(-0.7) - 5);
    EXPECT_NEAR(greyAlong(-0.7), greyAlong(-0.5), 4);
    EXPECT_TRUE(frame.range.size() == frame.depth.size() && !frame.range.empty());
    options.channels = {true, false, false, false};
    const Frame colours = renderer.render({}, camera, options);
    EXPECT_EQ(colours.rgb, frame.rgb);
    EXPECT_TRUE(colours.depth.empty() && colours.range.empty());
  }
}

TEST(Lens, UnusableLensesAreNamed) {
  Camera camera = makeLensCamera(Camera::Lens::Kind::fisheye, 64, 64);
  camera.lens->width = 7;
  EXPECT_NE(validateCamera(camera).value_or("").find("lens.width"), std::string::npos);
  camera.lens = Camera::Lens{Camera::Lens::Kind::equirectangular};
  camera.pinhole = Pinhole{60, 60, 32, 32};
  EXPECT_NE(validateCamera(camera).value_or("").find("pinhole"), std::string::npos);
  camera.pinhole.reset();
  camera.projection = Camera::Projection::orthographic;
  EXPECT_NE(validateCamera(camera).value_or("").find("lens"), std::string::npos);
}

TEST(DepthNoise, DependsOnSeedFrameAndPixelAlone) {
  const std::vector<float> clean(64 * 48, 2.5f);
  const auto noisy = [&](std::uint64_t seed, std::uint64_t frame) {
    std::vector<float> depth = clean;
    addDepthNoise(depth, 64, 48, {.seed = seed}, frame);
    return depth;
  };
  EXPECT_EQ(noisy(1, 7), noisy(1, 7));
  EXPECT_NE(noisy(1, 7), noisy(2, 7));
  EXPECT_NE(noisy(1, 7), noisy(1, 8));
}

TEST(DepthNoise, ADistortionTableDividesDepths) {
  // Two columns; the right one is off by 2 % at 1 m and 4 % at 3 m, and sees nothing at 9 m.
  DepthNoise noise{4, 1e-9, {1, 1, 1, 1, 1, 1.02f, 1.04f, 1.04f, 1.04f, 0}, 1};
  const auto measure = [&](float depth) {
    std::vector<float> pixels(8, depth);
    addDepthNoise(pixels, 8, 1, noise, 0);
    EXPECT_EQ(pixels[0], pixels[3]);
    EXPECT_EQ(std::isnan(pixels[4]), std::isnan(pixels[7]));
    return std::pair(static_cast<double>(pixels[0]), static_cast<double>(pixels[4]));
  };
  for (const auto& [depth, factor] :
       {std::pair(1.0, 1.02), {2.0, 1.03}, {0.6, 1.02}, {4.0, 1.04}}) {
    const auto [left, right] = measure(static_cast<float>(depth));
    EXPECT_NEAR(35.13 / left, 35.13 / depth, 1.0 / 16);
    EXPECT_NEAR(35.13 / right, 35.13 / (depth / factor), 1.0 / 16);
  }
  EXPECT_TRUE(std::isnan(measure(9).second));
  EXPECT_FALSE(std::isnan(measure(9).first));
}

TEST(DepthNoise, HasTheDeviationAndTheStepsOfTheModel) {
  constexpr double kDisparity = 11.75;  // 94 steps of an eighth: rounding is symmetric
  std::vector<float> depth(200 * 200, static_cast<float>(35.13 / kDisparity));
  addDepthNoise(depth, 200, 200, {.seed = 4}, 0);
  double sum = 0, squares = 0;
  for (const float d : depth) {
    const double steps = 35.13 * 8 / static_cast<double>(d);
    EXPECT_NEAR(steps, std::round(steps), 1e-4);
    sum += 35.13 / static_cast<double>(d);
    squares += std::pow(35.13 / static_cast<double>(d), 2);
  }
  const double count = 200 * 200, mean = sum / count;
  EXPECT_NEAR(mean, kDisparity, 0.001);
  // Half a step is 9/4 deviations of 1/36: rarely more, and then one step is made.
  const double expected = std::sqrt(std::erfc(2.25 / std::sqrt(2.0))) / 8;
  EXPECT_NEAR(std::sqrt(squares / count - mean * mean), expected, 0.1 * expected);
  std::vector<float> far{12.0f, std::numeric_limits<float>::quiet_NaN()};
  addDepthNoise(far, 2, 1, {.seed = 4}, 0);
  EXPECT_TRUE(std::isnan(far[0]) && std::isnan(far[1]));
}

}  // namespace
}  // namespace enfilade::render
