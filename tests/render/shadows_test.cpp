// Tests of sun shadows, against boxes intersected with lines in doubles.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "render/raytrace/primary_rays.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "render/raytrace/shading.hpp"
#include "render/service/renderer_selector.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

enum class Sun : std::uint8_t { reaches, kept, undecided };

/// Whether the line from `start` towards the sun intersects the box deflated by `inwards`.
bool passes(const PlacedBox& box, const Vec3& start, double inwards, double end) {
  const Vec3 sun = computeSunDirection();
  const Vec3 half = box.size.cwiseAbs() / 2 - Vec3::Constant(inwards);
  double from = 0, to = end;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.centre[axis] - half[axis] - start[axis]) / sun[axis];
    const double b = (box.centre[axis] + half[axis] - start[axis]) / sun[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from < to && (half.array() > 0).all();
}

/// For a point on a sunlit face of box `own`; a box never shadows its own sunlit faces.
Sun computeSunAt(const std::vector<PlacedBox>& boxes, std::size_t own, const Vec3& start,
                 double end) {
  Sun sun = Sun::reaches;
  for (const PlacedBox& box : boxes) {
    if (&box == &boxes[own]) continue;
    if (passes(box, start, 0.02, end)) return Sun::kept;
    if (passes(box, start, -0.02, end)) sun = Sun::undecided;
  }
  return sun;
}

Camera makeSlantedCamera() {
  Camera camera;
  camera.eye = {-7, 9, 8};
  camera.forward = Vec3(0, -1, 0) - camera.eye;
  camera.width = 150;
  camera.height = 110;
  return camera;
}

std::vector<PlacedBox> makeBoxesOnAFloor() {
  std::vector<PlacedBox> boxes = makeOpaque(makeCrowd(30));
  boxes.push_back({{0, -11, 0}, {60, 1, 60}, makeColoured(0.6f, 0.6f, 0.6f)});
  return boxes;
}

FrameOptions makeShadowOptions(bool shadows = true) {
  FrameOptions options;
  options.shadows = shadows;
  return options;
}

/// Faces turned away from the sun are dark with or without other occluders.
bool isTurnedToTheSun(const Frame& frame, std::size_t pixel) {
  const float* n = &frame.normals[3 * pixel];
  return Eigen::Vector3f(n[0], n[1], n[2]).cast<double>().dot(computeSunDirection()) > 0.05;
}

class Shadows : public testing::TestWithParam<RendererKind> {};

TEST_P(Shadows, AreWhereLinesTowardsTheSunPassBoxes) {
  const std::vector<PlacedBox> boxes = makeBoxesOnAFloor();
  RendererSelector renderer(makeScene(boxes), GetParam());
  for (const bool parallel : {false, true}) {
    Camera camera = makeSlantedCamera();
    if (parallel) camera.projection = Camera::Projection::orthographic, camera.heightY = 16;
    FrameOptions options = makeShadowOptions();
    options.channels.normals = true;
    const Frame shaded = renderer.render({}, camera, options);
    options.shadows = false;
    const Frame sunny = renderer.render({}, camera, options);
    EXPECT_EQ(shaded.ids, sunny.ids);
    const PrimaryRays rays = computePrimaryRays(camera);
    int kept = 0, reached = 0;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t pixel = getPixelIndex(shaded, x, y);
        const auto z = static_cast<double>(shaded.depth[pixel]);
        if (std::isnan(z) || !isTurnedToTheSun(shaded, pixel)) continue;
        const double up = computeSunDirection().dot(rays.forward);
        const double end = parallel ? ((up < 0 ? camera.near : camera.far) - z) / up
                                    : std::numeric_limits<double>::infinity();
        const Vec3 point = rays.eye + rays.originAt(x, y) + z * rays.directionAt(x, y);
        const Sun sun = computeSunAt(boxes, shaded.ids[pixel] - 1, point, end);
        const int less = sunny.rgb[3 * pixel] - shaded.rgb[3 * pixel];
        if (sun == Sun::kept) {
          ASSERT_GT(less, 0) << x << ", " << y;
          ++kept;
        } else if (sun == Sun::reaches) {
          ASSERT_EQ(less, 0) << x << ", " << y;
          ++reached;
        }
      }
    }
    EXPECT_GT(kept, 300);
    EXPECT_GT(reached, 3000);
  }
}

TEST_P(Shadows, OnlySolidGlassCastsShadows) {
  const PlacedBox floor{{0, -1, 0}, {20, 1, 20}, {}};
  const PlacedBox pane{{0, 2, 0}, {6, 0.1, 6}, makeColoured(0.2f, 0.2f, 0.9f, 0.3f)};
  RendererSelector renderer(makeScene({floor, pane}), GetParam());
  Camera camera = makeSquareCamera(40);  // below the pane, towards its shadow
  camera.eye = {-2, 1, -2};
  camera.forward = {0, -1, 0};
  camera.up = Vec3::UnitX();
  FrameOptions options = makeShadowOptions();
  EXPECT_EQ(renderer.render({}, camera, options).rgb,
            renderer.render({}, camera, makeShadowOptions(false)).rgb);
  options.transparency = TransparencyMode::opaque;
  const Frame shaded = renderer.render({}, camera, options);
  options.shadows = false;
  const Frame sunny = renderer.render({}, camera, options);
  const std::size_t middle = 3 * getPixelIndex(shaded, 20, 20);
  EXPECT_LT(shaded.rgb[middle] + 5, sunny.rgb[middle]);
}

TEST_P(Shadows, HolesOfTexturesLetTheSunThrough) {
  // The left half of the square (x < 0) is a leaf, its right half a hole; a floor behind it is
  // perpendicular to the sun.
  scene::Model model = makeMaskedSquare()->model();
  scene::Mesh floor;
  floor.material = 1;
  model.materials.push_back(makeColoured(0.7f, 0.7f, 0.7f));
  for (const auto& [x, z] : {std::pair{-9, -9}, {9, -9}, {9, 9}, {-9, 9}})
    floor.positions.emplace_back(static_cast<float>(x), -1.5f, static_cast<float>(z) - 2);
  floor.indices = {0, 1, 2, 0, 2, 3};
  model.meshes.push_back(floor);
  model.objects.resize(2);
  model.objects[1].meshes = {1};
  RendererSelector renderer(std::make_shared<const scene::Scene>(std::move(model)), GetParam());
  // Projects a point of the square along the sun's ray to the floor.
  const auto darker = [&](double x) {
    const Vec3 below = Vec3(x, 0, -2) - 1.5 / computeSunDirection().y() * computeSunDirection();
    Camera camera;
    camera.eye = below + Vec3(0, 0.5, -0.5);
    camera.forward = below - camera.eye;
    camera.width = camera.height = 1;
    return renderer.render({}, camera, makeShadowOptions(false)).rgb[0] -
           renderer.render({}, camera, makeShadowOptions()).rgb[0];
  };
  EXPECT_GT(darker(-0.5), 5);
  EXPECT_EQ(darker(0.5), 0);
  EXPECT_EQ(darker(1.5), 0) << "next to the square";
}

TEST_P(Shadows, GeometryThatAPlanCutsAwayCastsNone) {
  const PlacedBox floor{{0, -0.5, 0}, {20, 1, 20}, {}}, roof{{0, 3, 0}, {20, 0.2, 20}, {}};
  const PlacedBox wall{{0, 1.25, 0}, {0.2, 2.5, 8}, {}};
  RendererSelector renderer(makeScene({floor, roof, wall}), GetParam());
  Camera camera = makePlanCamera({Vec3(-4, 0, -4), Vec3(4, 0, 4)}, -0.1, 2, 80, 80);
  const Frame shaded = renderer.render({}, camera, makeShadowOptions());
  const Frame sunny = renderer.render({}, camera, makeShadowOptions(false));
  const auto less = [&](double x, double z) {
    const std::size_t pixel = 3 * getPixelIndex(shaded, static_cast<int>(40 + 10 * x * 0.9),
                                                static_cast<int>(40 + 10 * z * 0.9));
    return sunny.rgb[pixel] - shaded.rgb[pixel];
  };
  EXPECT_GT(less(-0.5, 0), 5) << "behind the wall, up to the cut";
  EXPECT_EQ(less(-2.5, 0), 0) << "the roof is cut away";
  EXPECT_EQ(less(2.5, 0), 0);
}

TEST_P(Shadows, APersonCastsOneButForTheirOwnEyes) {
  RendererSelector renderer(makeScene({{{0, -0.5, 0}, {20, 1, 20}, {}}}), GetParam());
  scene::Snapshot snapshot;
  snapshot.avatars = {makeAvatarAt(7, Vec3::Zero())};
  Camera camera = makeSlantedCamera();
  FrameOptions options = makeShadowOptions();
  const Frame seen = renderer.render(snapshot, camera, options);
  EXPECT_GT(std::count(seen.ids.begin(), seen.ids.end(), 7u), 20);
  camera.eye = {-0.6, 3, -0.8};  // above the shadow
  camera.forward = {0, -1, 0};
  camera.up = Vec3::UnitX();
  const auto getFloorRed = [&](const Frame& frame) {
    return frame.rgb[3 * getPixelIndex(frame, 75, 55)];
  };
  const int shaded = getFloorRed(renderer.render(snapshot, camera, options));
  options.hiddenEntity = 7;
  EXPECT_GT(getFloorRed(renderer.render(snapshot, camera, options)), shaded + 5);
}

INSTANTIATE_TEST_SUITE_P(OfBothRenderers, Shadows,
                         testing::Values(RendererKind::gl, RendererKind::rays),
                         [](const auto& kind) { return std::string(toString(kind.param)); });

TEST(ShadowsOfGl, NeedAShadowMask) {
  GlRenderer renderer(makeScene(makeBoxesOnAFloor()));
  EXPECT_THROW(renderer.render({}, makeSquareCamera(20), makeShadowOptions()), RenderError);
  EXPECT_EQ(renderer.render({}, makeSquareCamera(20)).rgb.size(), 1200u);
}

TEST(ShadowsOfGl, AreTheSameWhateverIsLeftOutOfTheDrawing) {
  const auto scene = makeScene(makeCrowd(600));
  RayRenderer rays(scene);
  GlRenderer gl(scene, {}, [&](const auto&... frame) { return rays.computeShadowMask(frame...); });
  for (int i = 0; i < 12; ++i) {
    Camera camera = makeSlantedCamera();
    camera.eye = Vec3(12 * std::cos(0.5 * i), 3, 12 * std::sin(0.5 * i));
    camera.forward = -camera.eye;
    FrameOptions options = makeShadowOptions();
    options.transparency = i % 3 == 0 ? TransparencyMode::opaque : TransparencyMode::blend;
    const auto drawn = [&](Culling culling) {
      options.culling = culling;
      return gl.render({}, camera, options);
    };
    const Frame culled = drawn(Culling::occlusion);
    EXPECT_TRUE(culled.rgb == drawn(Culling::frustum).rgb) << i;
    EXPECT_TRUE(culled.rgb == drawn(Culling::none).rgb) << i;
  }
}

}  // namespace
}  // namespace enfilade::render
