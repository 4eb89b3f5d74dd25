// Smoke test of culling on walks through the bundled and the shared buildings: images are equal to
// those without culling, byte for byte.
#include <gtest/gtest.h>

#include <cstring>

#include "assets/building.hpp"
#include "assets/landmarks.hpp"
#include "render/gl/gl_renderer.hpp"
#include "scene/import/import_model.hpp"
#include "tests/support/seeded_walk.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade {
namespace {

/// Compares every twelfth image; counts the objects culled in these.
void expectSamePictures(const std::shared_ptr<const scene::Scene>& scene,
                        const std::vector<tests::WalkStop>& stops, std::uint64_t& left) {
  ASSERT_FALSE(stops.empty());
  render::GlRenderer renderer(scene);
  for (std::size_t i = 0; i < stops.size(); ++i) {
    render::Camera camera = stops[i].camera;
    camera.width = 160;
    camera.height = 120;
    render::FrameOptions options{.hiddenEntity = stops[i].walker};
    const render::Frame culled = renderer.render(*stops[i].snapshot, camera, options);
    if (i % 12 != 0) continue;
    options.culling = render::Culling::frustum;
    const render::Frame all = renderer.render(*stops[i].snapshot, camera, options);
    EXPECT_TRUE(culled.rgb == all.rgb) << "colour, step " << i;
    EXPECT_TRUE(culled.ids == all.ids) << "ids, step " << i;
    EXPECT_EQ(std::memcmp(culled.depth.data(), all.depth.data(), 4 * all.depth.size()), 0)
        << "depth, step " << i;
    EXPECT_LE(culled.statistics.drawn, all.statistics.drawn);
    left += all.statistics.drawn - culled.statistics.drawn;
  }
}

TEST(SamePictures, InTheBundledBuildingAmongOthers) {
  const auto scene = std::make_shared<const scene::Scene>(assets::makeBuilding());
  tests::SeededWalk walk(scene, 7);
  ASSERT_TRUE(walk.beginAt(assets::landmarks::kRooms[1], 0));
  std::uint64_t left = 0;
  expectSamePictures(scene, walk.walk(240), left);
  EXPECT_GT(left, 20u * 100u);  // in twenty images
}

class SamePicturesIn : public ::testing::TestWithParam<const char*> {};

TEST_P(SamePicturesIn, ASharedScene) {
  ENFILADE_NEED_SHARED(shared);
  scene::ImportOptions options;
  if (std::string(GetParam()).ends_with(".obj")) options.metresPerUnit = 0.05;
  const auto scene = std::make_shared<const scene::Scene>(
      scene::importModel(*shared / "scenes" / GetParam(), options));
  tests::SeededWalk walk(scene, 11);
  ASSERT_TRUE(walk.begin(2));
  std::uint64_t left = 0;
  expectSamePictures(scene, walk.walk(180), left);
  // Small scenes with few hidden objects are drawn whole.
  const bool small = scene->model().objects.size() <= 256;
  EXPECT_TRUE(small || left > 0);
}

INSTANTIATE_TEST_SUITE_P(Shared, SamePicturesIn,
                         ::testing::Values("aws-small-house/small_house.gltf",
                                           "duplex/Duplex_A_20110907.ifc", "cpr-office/office.dae",
                                           "pandora/pandora.obj",
                                           "schependomlaan/schependomlaan_estate.glb"));

}  // namespace
}  // namespace enfilade
