// Paths over what is on no mesh of the agent: they are proved by a walk without a stop.
#include "scene/navigation/path_finder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scene/navigation/navigation.hpp"
#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {
namespace {

/// A room with pillars, from which narrow blocks of different heights lead to `farEnd`.
struct Rubble {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {6, 0, 6}}};
  Vec3 room = Vec3::Zero(), farEnd = Vec3::Zero();
};

Rubble makeRubble(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto draw = [&] { return unit(random); };
  Rubble made;
  const auto add = [&](const Vec3& min, const Vec3& max) {
    made.boxes.push_back({"box/" + std::to_string(made.boxes.size()), min, max});
  };
  for (int i = 0; i < 4; ++i) {
    const double x = 1 + 4 * draw(), z = 1 + 4 * draw();
    const double width = 0.2 + draw(), depth = 0.2 + draw();
    add({x, 0, z}, {x + width, 2.5, z + depth});
  }
  double x = 6, top = 0;
  while (x < 11) {
    const double length = 0.15 + 0.5 * draw();
    if (draw() < 0.6) {
      const double side = draw() < 0.5 ? -1 : 1;
      top += side * (draw() < 0.5 ? 0.299 : 0.3 * draw());
    }
    const double z = 3 + 0.15 * (draw() - 0.5), half = 0.1 + 0.15 * draw();
    add({x, top - 3, z - half}, {x + length, top, z + half});
    if (draw() < 0.3) add({x, top - 3, z + 0.4}, {x + 0.1, top + 2.5, z + 0.5});
    x += length;
  }
  made.farEnd = {x - 0.1, top, 3};
  const double z = 0.5 + 5 * draw();
  made.room = {0.5 + draw(), 0, z};
  return made;
}

bool isWalked(const std::shared_ptr<const Scene>& scene, const std::vector<Vec3>& points) {
  World world(scene);
  Spawn spawn;
  spawn.position = points.front();
  Walk walk;
  walk.waypoints.assign(points.begin() + 1, points.end());
  submitAvatarCommand(world, {"walker", spawn, 0});
  submitAvatarCommand(world, {"walker", walk, 0});
  for (int tick = 0; tick < 60 * 60; ++tick)
    for (const Notice& notice : tickWorld(world).notices)
      if (notice.kind != Notice::Kind::spawned) return notice.kind == Notice::Kind::arrived;
  return false;
}

/// Each leg of the way is walked while it is sought. In one of these scenes the shortened way is
/// not walked at once, since a step succeeds or not by where the ticks begin.
TEST(PathFinder, PathsOverRubbleAreWalkedWithoutAStop) {
  int found = 0;
  for (unsigned seed = 18; seed < 21; ++seed) {
    const Rubble rubble = makeRubble(seed);
    const auto scene = boxScene(rubble.boxes);
    Navigation navigation(scene, {}, {});
    for (const auto& [from, to] :
         {std::pair(rubble.room, rubble.farEnd), std::pair(rubble.farEnd, rubble.room)}) {
      const NavigationPath path = navigation.findPath(from, to);
      found += path.found() ? 1 : 0;
      EXPECT_TRUE(!path.found() || isWalked(scene, path.points)) << seed;
    }
  }
  EXPECT_GT(found, 2);
}

}  // namespace
}  // namespace enfilade::scene::testing
