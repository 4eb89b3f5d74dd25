// Smoke test: paths from a bed of a shared house, whose covers and frame are uneven.
#include <gtest/gtest.h>

#include <memory>

#include "scene/import/import_model.hpp"
#include "scene/navigation/navigation.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade {
namespace {

using scene::Vec3;

struct Pair {
  Vec3 from, to;
  /// Metres across, up and down that the feet move on the shortest way in a flood fill at 2 cm.
  double filledLength;
};

TEST(FurniturePaths, AreAsShortAsThoseOfAFloodFill) {
  ENFILADE_NEED_SHARED(shared);
  const auto scene = std::make_shared<const scene::Scene>(
      scene::importModel(*shared / "scenes/aws-small-house/small_house.gltf"));
  scene::Navigation navigation(scene, {}, {});
  for (const auto& [from, to, filledLength] :
       {Pair{{-6.3174905776977539, 0.64603476595623699, -1.6992560625076294},
             {-4.9066705703735352, 0.00046562500238075261, 0.58824825286865234},
             3.4455},
        Pair{{-6.0423803329467773, 0.64603479499537275, -2.2214288711547852},
             {-4.6433806419372559, 0.00046562500238075261, 0.63498282432556152},
             3.8635}}) {
    const scene::NavigationPath path = navigation.findPath(from, to);
    ASSERT_TRUE(path.found()) << path.reason;
    EXPECT_LT(path.feetLength, 1.02 * filledLength);
    EXPECT_LE(path.points.size(), 4U) << "the edge of the bed is crossed without a stop";
  }
}

}  // namespace
}  // namespace enfilade
