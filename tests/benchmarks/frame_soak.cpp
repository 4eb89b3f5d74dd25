// Many pictures and scenes in one process: a district is made and brought to a renderer again and
// again, pictures are taken of it, and memory may not grow.
//
//   frame_soak [gl|rays [RELOADS [PICTURES]]]     gl 200 10000
//
// Memory is sampled after each scene is gone; after the first tenth it may grow no more. Exit code
// 3: it did.
//
// On 2026-11-22, with Mesa's llvmpipe: gl had 137 MB after 20 scenes and 142 after 200, rays 79 and
// 93; at most 4.3 and 4.2 MB more than at most in the first tenth.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>

#include "assets/building.hpp"
#include "render/renderer.hpp"

namespace {

using namespace enfilade;

constexpr double kGrowthAllowed = 8;  // megabytes: what allocators keep one time and not another

double residentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

void takePictures(render::RendererKind kind, const scene::Model& model, int pictures, int first) {
  render::Renderer renderer(std::make_shared<const scene::Scene>(model), kind);
  for (int i = first; i < first + pictures; ++i) {
    render::Camera camera;
    camera.eye = {-26 + 0.01 * i, 1.6, 4 * std::sin(0.01 * i)};
    camera.forward = {std::cos(0.07 * i), -0.1, std::sin(0.07 * i)};
    camera.width = 96;
    camera.height = i % 3 == 0 ? 64 : 72;
    renderer.render({}, camera, {.channels = {true, true, true, i % 5 == 0}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto kind = render::rendererKindFrom(argc > 1 ? argv[1] : "gl");
  const int reloads = std::max(argc > 2 ? std::atoi(argv[2]) : 200, 10);
  const int pictures = argc > 3 ? std::atoi(argv[3]) : 10'000;
  if (!kind) {
    std::fprintf(stderr, "frame_soak: %s is no renderer; give gl or rays\n", argv[1]);
    return 2;
  }
  const scene::Model model = assets::makeDistrict(assets::kSmallestDistrict, 1);
  const int each = (pictures + reloads - 1) / reloads;
  double settled = 0, most = 0;
  for (int i = 0; i < reloads; ++i) {
    takePictures(*kind, model, each, i * each);
    const double now = residentMegabytes();
    (i < reloads / 10 ? settled : most) = std::max(i < reloads / 10 ? settled : most, now);
    if ((i + 1) % (reloads / 10) == 0)
      std::printf("%-4s %4d scenes %6d pictures  %7.1f MB\n", render::wordOf(*kind), i + 1,
                  (i + 1) * each, now);
    std::fflush(stdout);
  }
  std::printf("%-4s after the first tenth: %+.1f MB at most\n", render::wordOf(*kind),
              most - settled);
  return most - settled > kGrowthAllowed ? 3 : 0;
}
