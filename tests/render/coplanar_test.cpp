// Surfaces of several objects in one plane: all renderers show that of the smallest object.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/raytrace/ray_renderer.hpp"
#include "scene/model/coplanar_surfaces.hpp"
#include "scene/world/world.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

/// A roof, rafters flush with its upper side, and a hatch flush with both; turned, so that
/// positions are rounded. With `raised`, rafters and hatch stand out by some millimetres instead:
/// nothing is coplanar, and the same objects are visible but for pixels at edges.
std::shared_ptr<const scene::Scene> makeRoof(bool raised) {
  std::vector<PlacedBox> boxes{{{0, 0, 0}, {12, 0.4, 9}, makeColoured(0.8f, 0.3f, 0.1f)}};
  const auto addFlush = [&](const Vec3& centre, const Vec3& size, double rise) {
    const double top = 0.2 + (raised ? rise : 0);
    boxes.push_back(
        {{centre.x(), top - size.y() / 2, centre.z()}, size, makeColoured(0.9f, 0.8f, 0.5f)});
  };
  for (int i = 0; i < 5; ++i) addFlush({-4.6 + 2.3 * i, 0, 0}, {0.7, 0.3, 8.5}, 0.002);
  addFlush({0, 0, 1.5}, {5, 0.1, 1.2}, 0.004);
  scene::Model model = makeScene(boxes)->model();
  const Eigen::Affine3d turn =
      Eigen::Translation3d(31, 5, -17) * Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized());
  for (scene::Object& object : model.objects) object.worldFromMesh = turn * object.worldFromMesh;
  return std::make_shared<const scene::Scene>(std::move(model));
}

std::vector<Camera> makeCameras(const scene::Scene& scene) {
  const Eigen::Affine3d& roof = scene.model().objects[0].worldFromMesh;
  const Vec3 centre = roof.translation(), up = roof.linear().col(1).normalized();
  const Vec3 along = roof.linear().col(0).normalized(), aside = up.cross(along);
  std::vector<Camera> cameras;
  for (int i = 0; i < 6; ++i) {
    Camera camera;
    camera.eye = centre + (1 + 0.9 * i) * up + 7 * (std::cos(i) * along + std::sin(i) * aside);
    camera.forward = centre - camera.eye;
    camera.width = 240, camera.height = 180;
    camera.far = 60;
    cameras.push_back(camera);
  }
  cameras.back().projection = Camera::Projection::orthographic;
  cameras.back().heightY = 11;
  cameras.push_back(cameras.back());  // the roof is around and behind the eye
  cameras.back().eye = centre;
  cameras.back().near = -30;
  return cameras;
}

std::size_t countDifferentIds(const Frame& a, const Frame& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.ids.size(); ++i) count += a.ids[i] == b.ids[i] ? 0 : 1;
  return count;
}

/// Pixels of the roof, the largest object, of which the depth differs by more than a millimetre.
std::size_t countRoofDepthErrors(const Frame& a, const Frame& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.ids.size(); ++i)
    if (a.ids[i] == 1 && b.ids[i] == 1 && std::abs(a.depth[i] - b.depth[i]) > 1e-3f) ++count;
  return count;
}

/// Compares the frames of a renderer of coplanar surfaces with those of raised ones.
template <class FlushRenderer>
void expectSmallestVisible(FlushRenderer& renderer, const std::vector<Camera>& cameras) {
  RayRenderer raised(makeRoof(true));
  for (const Camera& camera : cameras) {
    for (const bool rgb : {true, false}) {  // ids alone take another path
      const FrameOptions options{.channels = {rgb, true, true, false}};
      const Frame frame = renderer.render({}, camera, options);
      const Frame expected = raised.render({}, camera, options);
      const std::set<std::uint32_t> seen = findIdsIn(frame);
      EXPECT_TRUE(seen.contains(1) && seen.contains(7));
      EXPECT_LT(countDifferentIds(frame, expected), frame.ids.size() / 50) << rgb;
      EXPECT_LT(countRoofDepthErrors(frame, expected), frame.ids.size() / 100) << rgb;
    }
  }
}

TEST(Coplanar, RaysAndLensesShowTheSmallestObject) {
  const auto scene = makeRoof(false);
  RayRenderer rays(scene);
  std::vector<Camera> cameras = makeCameras(*scene);
  Camera fisheye = cameras[2];
  fisheye.lens = Camera::Lens{Camera::Lens::Kind::equirectangular};
  cameras.push_back(fisheye);
  expectSmallestVisible(rays, cameras);
}

TEST(Coplanar, OpenGlShowsTheSmallestObjectAlsoWhereVerticesAreRounded) {
  const auto scene = makeRoof(false);
  GlRenderer exact(scene);
  GlRenderer rounded(scene,
                     {.device = "", .depthSource = DepthSource::plane, .roundsVertices = true});
  expectSmallestVisible(exact, makeCameras(*scene));
  expectSmallestVisible(rounded, makeCameras(*scene));
}

std::vector<std::uint8_t> listRanks(const scene::Model& model) {
  std::vector<std::uint8_t> ranks;
  for (const scene::CoplanarRank& one : scene::rankCoplanarObjects(model))
    ranks.push_back(one.rank);
  return ranks;
}

TEST(Coplanar, APanelThatIsFlushWithAMovedLeafStaysVisible) {
  // A leaf in a frame and a panel on it; both are of a body, and slide.
  scene::Model model = makeScene({{{0, 0, 0}, {4, 3, 0.2}, makeColoured(0.2f, 0.2f, 0.8f)},
                                  {{0, 0, 0.05}, {1, 1, 0.1}, makeColoured(0.9f, 0.1f, 0.1f)}})
                           ->model();
  scene::BodySpec door;
  door.name = "door";
  door.kind = scene::BodyKind::sliding;
  door.objects = {0, 1};
  door.axis = Vec3::UnitX();
  door.high = 20;
  model.bodies = {door};
  const auto scene = std::make_shared<const scene::Scene>(std::move(model));
  scene::World world(scene);
  submitBodyCommand(world, {"door", scene::BodyCommand::Action::open, 0, 0, std::nullopt});
  for (int tick = 0; tick < 60 * 60; ++tick) tickWorld(world);
  const auto snapshot = world.snapshot();
  const Vec3 at = snapshot->bodies->at(0).pose.translation;
  ASSERT_GT(at.x(), 10);
  Camera camera;
  camera.eye = at + Vec3(0.7, 0.9, 3);
  camera.forward = at - camera.eye;
  camera.width = 200, camera.height = 150;
  RayRenderer rays(scene);
  GlRenderer gl(scene);
  const Frame traced = rays.render(*snapshot, camera), drawn = gl.render(*snapshot, camera);
  const auto panel = static_cast<std::size_t>(std::ranges::count(traced.ids, 2u));
  EXPECT_GT(panel, 1000u);  // of 1162
  EXPECT_LT(countDifferentIds(traced, drawn), traced.ids.size() / 200);
  // The panel is a convex figure: no row has a gap in it.
  for (int y = 0; y < camera.height; ++y) {
    int changes = 0;
    for (int x = 1; x < camera.width; ++x)
      changes += (traced.ids[render::getPixelIndex(traced, x, y)] == 2) !=
                 (traced.ids[render::getPixelIndex(traced, x - 1, y)] == 2);
    EXPECT_LE(changes, 2) << y;
  }
}

TEST(Coplanar, RanksFollowSizes) {
  EXPECT_EQ(listRanks(makeRoof(false)->model()), (std::vector<std::uint8_t>{2, 0, 1, 1, 1, 0, 0}));
  EXPECT_EQ(listRanks(makeRoof(true)->model()), std::vector<std::uint8_t>(7, 0));
}

TEST(Coplanar, LargeModelsAreNotRanked) {
  scene::Model model = makeRoof(false)->model();
  model.meshes.emplace_back();
  model.meshes.back().positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.meshes.back().indices.assign(3'000'000, 0);
  model.objects.resize(10);
  for (std::size_t i = 7; i < 10; ++i)
    model.objects[i].meshes = {static_cast<std::uint32_t>(model.meshes.size() - 1)};
  EXPECT_EQ(listRanks(model), std::vector<std::uint8_t>(10, 0));
}

}  // namespace
}  // namespace enfilade::render
