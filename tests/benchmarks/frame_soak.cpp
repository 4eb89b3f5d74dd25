// Soak test of rendering: one process loads a district into a renderer and draws images repeatedly;
// memory must not grow.
//
//   frame_soak [gl|rays [RELOADS [PICTURES]]]     gl 200 10000
//
// Memory is sampled after each scene is destroyed. Allocated memory may not grow after the first
// tenth. Typical resident memory may not grow from the first half of the scenes to the second;
// single samples vary with the allocators' caches. Exit code 3: memory grew.
//
// On 2026-11-22 with Mesa's llvmpipe: gl had 13.98 MB allocated after 20 scenes and 13.99 after
// 200, rays 13.18 and 13.19. Resident memory varied in 137 to 156 MB and 90 to 93 MB.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <vector>

#include "assets/building.hpp"
#include "render/service/renderer_selector.hpp"

namespace {

using namespace enfilade;

constexpr double kAllocatedAllowed = 0.1, kResidentAllowed = 4;  // megabytes

double readResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Memory in use, without the allocators' free lists.
double readAllocatedMegabytes() {
  const struct mallinfo2 info = ::mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / 1e6;
}

double findMedian(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void takePictures(render::RendererKind kind, const scene::Model& model, int pictures, int first) {
  render::RendererSelector renderer(std::make_shared<const scene::Scene>(model), kind);
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
  const auto kind = render::parseRendererKind(argc > 1 ? argv[1] : "gl");
  const int reloads = std::max(argc > 2 ? std::atoi(argv[2]) : 200, 10);
  const int pictures = argc > 3 ? std::atoi(argv[3]) : 10'000;
  if (!kind) {
    std::fprintf(stderr, "frame_soak: unknown renderer %s; use gl or rays\n", argv[1]);
    return 2;
  }
  const scene::Model model = assets::makeDistrict(assets::kMinDistrictObjects, 1);
  const int each = (pictures + reloads - 1) / reloads;
  std::vector<double> resident, allocated;
  for (int i = 0; i < reloads; ++i) {
    takePictures(*kind, model, each, i * each);
    resident.push_back(readResidentMegabytes());
    allocated.push_back(readAllocatedMegabytes());
    if ((i + 1) % (reloads / 10) == 0)
      std::printf("%-4s %4d scenes %6d pictures  %7.1f MB, allocated %8.3f MB\n",
                  render::toString(*kind), i + 1, (i + 1) * each, resident.back(),
                  allocated.back());
    std::fflush(stdout);
  }
  const auto begin = resident.begin(), middle = begin + reloads / 2;
  const double grown = findMedian({middle, resident.end()}) - findMedian({begin, middle});
  const double kept = allocated.back() - allocated[static_cast<std::size_t>(reloads / 10)];
  std::printf("%-4s from half to half %+.1f MB, allocated after the first tenth %+.3f MB\n",
              render::toString(*kind), grown, kept);
  return grown > kResidentAllowed || kept > kAllocatedAllowed ? 3 : 0;
}
