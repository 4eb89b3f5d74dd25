#include "render/optical_flow.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "render/raytrace/ray_renderer.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

TEST(OpticalFlow, OfAMovedCameraIsTheProjectionOfTheSamePoints) {
  const auto scene = makeScene(makeCrowd(40));
  RayRenderer renderer(scene);
  Camera now;
  now.eye = {0.3, 0.1, -0.2};
  now.forward = {1, 0.1, -0.3};
  now.width = 64;
  now.height = 48;
  Camera then = now;
  then.eye = {0.1, 0, -0.1};
  then.forward = {1, 0, -0.2};
  then.fovY = 1.1;
  FrameOptions options;
  options.channels = {false, true, true, false};
  const scene::Snapshot snapshot;
  const Frame frame = renderer.render(snapshot, now, options);
  const std::vector<float> flow = computeOpticalFlow(frame, *scene, snapshot, snapshot, then);
  ASSERT_EQ(flow.size(), 2 * frame.ids.size());
  int seen = 0;
  double largest = 0;
  for (std::size_t pixel = 0; pixel < frame.ids.size(); ++pixel) {
    const float u = flow[2 * pixel], v = flow[2 * pixel + 1];
    if (frame.ids[pixel] == 0) {
      EXPECT_TRUE(std::isnan(u) && std::isnan(v));
      continue;
    }
    // The point at (x - u, y - v) of the earlier picture is at (x, y) of this one.
    const double x = static_cast<double>(pixel % 64) + 0.5,
                 y = static_cast<double>(pixel / 64) + 0.5;
    const Vec3 forward = now.forward.normalized(), right = forward.cross(now.up).normalized();
    const double f = 24 / std::tan(0.5 * now.fovY);
    const Vec3 point =
        now.eye + static_cast<double>(frame.depth[pixel]) *
                      (forward + (x - 32) / f * right - (y - 24) / f * right.cross(forward));
    const Vec3 before = project(then, point);
    EXPECT_NEAR(x - static_cast<double>(u), before.x(), 1e-3);
    EXPECT_NEAR(y - static_cast<double>(v), before.y(), 1e-3);
    largest = std::max(largest, std::hypot(static_cast<double>(u), static_cast<double>(v)));
    ++seen;
  }
  EXPECT_GT(seen, 200);
  EXPECT_GT(largest, 2);
}

TEST(OpticalFlow, WithoutMotionIsZeroAndBehindTheCameraUnknown) {
  const auto scene = makeScene({{{0, 0, -5}, {40, 40, 1}, {}}});
  RayRenderer renderer(scene);
  Camera now;
  now.forward = {0, 0, -1};
  now.width = now.height = 16;
  FrameOptions options;
  options.channels = {false, true, true, false};
  const Frame frame = renderer.render({}, now, options);
  for (const float one : computeOpticalFlow(frame, *scene, {}, {}, now)) EXPECT_NEAR(one, 0, 1e-4);
  Camera away = now;
  away.forward = {0, 0, 1};
  for (const float one : computeOpticalFlow(frame, *scene, {}, {}, away))
    EXPECT_TRUE(std::isnan(one));
}

}  // namespace
}  // namespace enfilade::render
