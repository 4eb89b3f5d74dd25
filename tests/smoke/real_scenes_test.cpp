// Smoke test: an avatar walks for 600 ticks in each of the shared real buildings, and looks around.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "render/gl/gl_renderer.hpp"
#include "scene/import/import_model.hpp"
#include "scene/world/world.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade {
namespace {

using scene::ContactEvent;
using scene::Notice;
using scene::Vec3;

constexpr int kTicks = 600;

struct RealScene {
  const char* name;
  const char* file;
  std::optional<double> metresPerUnit;
};

void PrintTo(const RealScene& scene, std::ostream* out) {
  *out << scene.name;
}

class RealScenes : public ::testing::TestWithParam<RealScene> {};

double drawUniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

/// Checks that each contact that begins also ends.
struct Balance {
  std::set<std::pair<scene::EntityId, scene::EntityId>> open;
  int begins = 0;

  void take(const std::vector<ContactEvent>& events) {
    for (const ContactEvent& e : events) {
      const std::pair pair(e.a, e.b);
      if (e.kind == ContactEvent::Kind::begin) {
        EXPECT_TRUE(open.insert(pair).second);
        ++begins;
      }
      if (e.kind == ContactEvent::Kind::end) {
        EXPECT_EQ(open.erase(pair), 1u);
      }
    }
  }
};

/// Tries seeded places until the avatar stands on a surface instead of falling past the building.
bool standSomewhere(scene::World& world, std::mt19937_64& random, Balance& balance) {
  const scene::Aabb& b = world.scene().bounds();
  for (int attempt = 0; attempt < 400; ++attempt) {
    const double x = drawUniform(random, b.min.x(), b.max.x());
    const double z = drawUniform(random, b.min.z(), b.max.z());
    const double y = drawUniform(random, b.min.y(), b.min.y() + 0.7 * b.size().y());
    EXPECT_FALSE(submitAvatarCommand(world, {"ann", scene::Spawn{{x, y, z}}, 0}));
    balance.take(tickWorld(world).contacts);
    if (world.snapshot()->avatars.empty()) continue;
    for (int i = 0; i < 90; ++i) balance.take(tickWorld(world).contacts);
    if (!world.snapshot()->avatars.empty() && world.snapshot()->avatars[0].grounded) return true;
    EXPECT_FALSE(submitAvatarCommand(world, {"ann", scene::Leave{}, 0}));
    balance.take(tickWorld(world).contacts);
  }
  return false;
}

void expectSomethingSeen(const render::Frame& frame, const scene::World& world) {
  std::set<std::array<std::uint8_t, 3>> colours;
  std::set<scene::EntityId> ids(frame.ids.begin(), frame.ids.end());
  for (std::size_t i = 0; i < frame.ids.size(); ++i)
    colours.insert({frame.rgb[3 * i], frame.rgb[3 * i + 1], frame.rgb[3 * i + 2]});
  EXPECT_GT(colours.size(), 8u) << "the frame is blank";
  ids.erase(0);
  EXPECT_FALSE(ids.empty());
  for (const scene::EntityId id : ids) EXPECT_FALSE(findEntityName(world, id).empty()) << id;
}

TEST_P(RealScenes, AnAvatarWalksAndNeverPenetrates) {
  ENFILADE_NEED_SHARED(shared);
  scene::ImportOptions options;
  options.metresPerUnit = GetParam().metresPerUnit;
  const auto still = std::make_shared<const scene::Scene>(
      scene::importModel(*shared / "scenes" / GetParam().file, options));
  scene::World world(still);
  std::mt19937_64 random(2026);
  Balance balance;
  ASSERT_TRUE(standSomewhere(world, random, balance));

  render::GlRenderer renderer(still);
  const scene::Aabb& b = still->bounds();
  double worst = 0, walked = 0;  // metres
  for (int i = 0; i < kTicks; ++i) {
    if (i % 120 == 0 && !world.snapshot()->avatars.empty()) {
      const Vec3 goal(drawUniform(random, b.min.x(), b.max.x()), 0,
                      drawUniform(random, b.min.z(), b.max.z()));
      const Vec3 way = goal - world.snapshot()->avatars[0].footPosition;
      const Vec3 velocity = 1.5 * Vec3(way.x(), 0, way.z()).normalized();
      EXPECT_FALSE(submitAvatarCommand(world, {"ann", scene::Drive{velocity}, 0}));
    }
    const auto before = world.snapshot();
    const scene::TickReport report = tickWorld(world);
    worst = std::max(worst, report.maxPenetration);
    balance.take(report.contacts);
    if (!before->avatars.empty() && !report.snapshot->avatars.empty())
      walked += (report.snapshot->avatars[0].footPosition - before->avatars[0].footPosition).norm();
    if (i % 200 == 100 && !report.snapshot->avatars.empty()) {
      const auto& ann = report.snapshot->avatars[0];
      render::Camera eyes = render::makeFirstPersonCamera(ann, 320, 240);
      eyes.forward = b.centre() - eyes.eye;  // into the building, whatever the direction of the
                                             // walk
      expectSomethingSeen(renderer.render(*report.snapshot, eyes, {.hiddenEntity = ann.id}), world);
    }
  }
  EXPECT_EQ(worst, 0);
  EXPECT_GT(walked, 5) << "it neither walked far nor stayed in the scene";
  EXPECT_GT(balance.begins, 0);
  balance.take(endAllContacts(world, ContactEvent::Reason::shutdown));
  EXPECT_TRUE(balance.open.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Shared, RealScenes,
    ::testing::Values(RealScene{"small_house", "aws-small-house/small_house.gltf", {}},
                      RealScene{"duplex", "duplex/Duplex_A_20110907.ifc", {}},
                      RealScene{"willow", "willow-garage/meshes/willowgarage_visual.dae", {}},
                      RealScene{"office_dae", "cpr-office/office.dae", {}},
                      RealScene{"office_fbx", "cpr-office/cpr_office_ascii.fbx", {}},
                      RealScene{"pandora", "pandora/pandora.obj", 0.05},
                      RealScene{"estate", "schependomlaan/schependomlaan_estate.glb", {}}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace enfilade
