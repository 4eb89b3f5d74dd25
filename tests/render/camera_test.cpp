#include "render/camera/camera.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "render/culling/box_visibility.hpp"

namespace enfilade::render {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Bad {
  const char* field;
  std::function<void(Camera&)> spoil;
};

TEST(Camera, TheDefaultIsAccepted) {
  EXPECT_EQ(validateCamera(Camera{}), std::nullopt);
}

TEST(Camera, RefusalsNameTheField) {
  const std::vector<Bad> all{
      {"width", [](Camera& c) { c.width = 0; }},
      {"width", [](Camera& c) { c.width = 4097; }},
      {"height", [](Camera& c) { c.height = -1; }},
      {"eye", [](Camera& c) { c.eye.y() = kNaN; }},
      {"eye", [](Camera& c) { c.eye.x() = kInfinity; }},
      {"forward", [](Camera& c) { c.forward = Vec3::Zero(); }},
      {"forward", [](Camera& c) { c.forward.z() = kNaN; }},
      {"up", [](Camera& c) { c.up = Vec3::Zero(); }},
      {"up", [](Camera& c) { c.up = -3 * c.forward; }},
      {"near", [](Camera& c) { c.near = 0; }},
      {"near", [](Camera& c) { c.near = kNaN; }},
      {"far", [](Camera& c) { c.far = c.near; }},
      {"far", [](Camera& c) { c.far = kNaN; }},
      {"fovY", [](Camera& c) { c.fovY = 0; }},
      {"fovY", [](Camera& c) { c.fovY = 3.15; }},
      {"fovY", [](Camera& c) { c.fovY = kNaN; }},
      {"fovY", [](Camera& c) { c.fovY = std::nextafter(std::numbers::pi, 0.0); }},
      {"fovY", [](Camera& c) { c.fovY = 1e-12; }},
      {"fovY", [](Camera& c) { c.fovY = 5e-324; }},
      {"heightY",
       [](Camera& c) {
         c.projection = Camera::Projection::orthographic;
         c.heightY = kNaN;
       }},
      {"heightY",
       [](Camera& c) {
         c.projection = Camera::Projection::orthographic;
         c.heightY = 0;
       }},
      {"pinhole.fx",
       [](Camera& c) {
         c.pinhole = Pinhole{0, 100, 320, 240};
       }},
      {"pinhole.fy",
       [](Camera& c) {
         c.pinhole = Pinhole{100, kNaN, 320, 240};
       }},
      {"pinhole.cx",
       [](Camera& c) {
         c.pinhole = Pinhole{100, 100, kInfinity, 240};
       }},
      {"pinhole.cy",
       [](Camera& c) {
         c.pinhole = Pinhole{100, 100, 320, -1e6};
       }},
      {"pinhole",
       [](Camera& c) {
         c.projection = Camera::Projection::orthographic;
         c.pinhole = Pinhole{100, 100, 320, 240};
       }},
  };
  for (const Bad& bad : all) {
    Camera camera;
    bad.spoil(camera);
    const auto why = validateCamera(camera);
    ASSERT_TRUE(why.has_value()) << bad.field;
    EXPECT_EQ(why->rfind(std::string("camera: ") + bad.field + " is ", 0), 0u) << *why;
  }
}

TEST(Camera, AVerticalViewDirectionHasAnImage) {
  scene::AvatarSnapshot avatar;
  for (const Vec3& gaze : {Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(1, 0, 0)}) {
    avatar.viewDirection = gaze;
    EXPECT_EQ(validateCamera(makeFirstPersonCamera(avatar, 64, 48)), std::nullopt);
  }
}

TEST(Camera, FirstPersonLooksFromTheEyes) {
  scene::AvatarSnapshot avatar;
  avatar.footPosition = {1, 2, 3};
  avatar.eyeHeight = 1.5;
  avatar.viewDirection = {0, 0, 1};
  const Camera camera = makeFirstPersonCamera(avatar, 64, 48);
  EXPECT_EQ(camera.eye, Vec3(1, 3.5, 3));
  EXPECT_EQ(camera.forward, avatar.viewDirection);
}

TEST(Camera, APlanShowsTheBoundsWithXToTheRightAndZDownwards) {
  const scene::Aabb bounds{{-3, 0, 10}, {9, 3, 14}};
  for (const auto& [width, height] : {std::pair(400, 300), std::pair(100, 400)}) {
    const Camera camera = makePlanCamera(bounds, 0, 2, width, height);
    ASSERT_EQ(validateCamera(camera), std::nullopt);
    const Vec3 low = project(camera, {-3, 0, 10});
    const Vec3 high = project(camera, {9, 0, 14});
    EXPECT_LT(low.x(), high.x());
    EXPECT_LT(low.y(), high.y());
    for (const Vec3& corner : {low, high}) {
      EXPECT_GE(corner.x(), 0);
      EXPECT_LE(corner.x(), width);
      EXPECT_GE(corner.y(), 0);
      EXPECT_LE(corner.y(), height);
    }
    const Vec3 middle = project(camera, bounds.centre());
    EXPECT_NEAR(middle.x(), width / 2.0, 1e-9);
    EXPECT_NEAR(middle.y(), height / 2.0, 1e-9);
    EXPECT_NEAR(project(camera, {0, 2, 12}).z(), camera.near, 1e-12);
    EXPECT_LT(project(camera, {0, 0, 12}).z(), camera.far);
  }
}

TEST(Camera, APinholeProjectsAsItsIntrinsicsSay) {
  Camera camera;
  camera.eye = {1, 2, 3};
  camera.forward = {0, 0, -2};
  camera.pinhole = Pinhole{500, 450, 100, 400};
  ASSERT_EQ(validateCamera(camera), std::nullopt);
  const Vec3 pixel = project(camera, camera.eye + Vec3(0.3, -0.2, -2));
  EXPECT_NEAR(pixel.x(), 100 + 500 * 0.15, 1e-9);
  EXPECT_NEAR(pixel.y(), 400 + 450 * 0.10, 1e-9);
  EXPECT_NEAR(pixel.z(), 2, 1e-12);
}

TEST(Camera, TheIntrinsicsOfAnOpeningAngleGiveTheSamePicture) {
  Camera camera;
  camera.forward = {0.3, -0.2, 1};
  const Vec3 point = 7 * camera.forward + Vec3(0.4, 0.5, 0);
  const Vec3 angle = project(camera, point);
  camera.pinhole = computeIntrinsics(camera);
  EXPECT_EQ(camera.pinhole->cx, camera.width / 2.0);
  EXPECT_LT((project(camera, point) - angle).norm(), 1e-9);
}

TEST(Camera, CullingKeepsEveryBoxThatHoldsAPointOfThePicture) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&](double size) {
    const double x = unit(random), y = unit(random), z = unit(random);
    return Vec3(size * Vec3(x, y, z));
  };
  int seen = 0, culled = 0;
  constexpr int kBoxes = 4000;
  for (int i = 0; i < kBoxes; ++i) {
    Camera camera;
    camera.eye = vector(5);
    camera.forward = vector(1);
    camera.far = 20;
    if (i % 2 == 1) camera.projection = Camera::Projection::orthographic;
    if (i % 4 == 2) camera.pinhole = Pinhole{300, 400, 320 + 300 * unit(random), 240};
    const Vec3 centre = vector(15);
    const Vec3 half = vector(2).cwiseAbs();
    const BoxVisibility visibility(camera);
    const bool kept =
        !visibility.isOutsideFrustum(visibility.toEyeSpace({centre - half, centre + half}));
    bool inside = false;
    for (int sample = 0; sample < 50; ++sample) {
      const Vec3 pixel = project(camera, centre + half.cwiseProduct(vector(1)));
      inside = inside || (pixel.z() > camera.near && pixel.z() < camera.far && pixel.x() > 0 &&
                          pixel.x() < camera.width && pixel.y() > 0 && pixel.y() < camera.height);
    }
    EXPECT_TRUE(kept || !inside);
    seen += inside ? 1 : 0;
    culled += kept ? 0 : 1;
  }
  EXPECT_GT(seen, kBoxes / 20);
  EXPECT_GT(culled, kBoxes / 4);
}

}  // namespace
}  // namespace enfilade::render
