// Tests that images and renderers leak no memory.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "render/raytrace/ray_renderer.hpp"
#include "tests/render/hand_made_scene.hpp"

namespace enfilade::render {
namespace {

double readResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

std::vector<PlacedBox> makeManyBoxes() {
  std::vector<PlacedBox> boxes;
  for (int i = 0; i < 900; ++i) {
    const double x = i % 30 - 15.0, z = i / 30 - 15.0;
    boxes.push_back(
        {{x, 0, z}, {0.4, 1, 0.4}, makeColoured(0.5f, 0.6f, 0.7f, i % 9 == 0 ? 0.5f : 1)});
  }
  return boxes;
}

/// Reloads the scene `reloads` times and draws 20 images with each. frame_soak does more of it.
template <class OneRenderer>
void reloadRenderers(int reloads) {
  for (int reload = 0; reload < reloads; ++reload) {
    OneRenderer renderer(makeScene(makeManyBoxes()));
    for (int i = 0; i < 20; ++i) {
      Camera camera = makeSquareCamera(96);
      camera.forward = {std::cos(0.3 * i), -0.1, std::sin(0.3 * i)};
      renderer.render({}, camera, {.channels = {true, true, true, i % 2 == 0}});
    }
  }
}

template <class OneRenderer>
void expectFlat() {
  reloadRenderers<OneRenderer>(6);  // warms up allocations that are kept, such as compiled shaders
  const double before = readResidentMegabytes();
  reloadRenderers<OneRenderer>(24);
  EXPECT_LT(readResidentMegabytes() - before, 12) << "megabytes more after 24 reloads";
}

TEST(ResidentMemory, IsFlatOverReloadsAndPicturesOfGl) {
  expectFlat<GlRenderer>();
}

TEST(ResidentMemory, IsFlatOverReloadsAndPicturesOfRays) {
  expectFlat<RayRenderer>();
}

}  // namespace
}  // namespace enfilade::render
