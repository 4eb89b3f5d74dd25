// Benchmark of rendering: one draw an object with frustum culling against the renderer's culling,
// in one run over the same walks. Every channel is compared byte by byte. CPU time of all threads
// (with those of a software GL) is reported as well, since other load stretches the wall-clock
// time.
//
//   render_bench [SCENE [FRAMES]]
//   render_bench together SCENE    cameras of one tick: together against each alone
//
// SCENE is a file, or district:N for a generated district of N objects. Default: the district of
// 1e5 objects, and the small house and the estate if the shared folder exists.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "assets/building.hpp"
#include "assets/landmarks.hpp"
#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "scene/import/import_model.hpp"
#include "scene/import/import_worker.hpp"
#include "tests/support/seeded_walk.hpp"
#include "tests/support/shared_folder.hpp"

namespace {

using namespace enfilade;
using Clock = std::chrono::steady_clock;
using collision::Vec3;

constexpr std::size_t kCompared = 15;  // stops of a walk

struct Size {
  int width, height;
};

/// Pixels in which frames differ, and by how much in depth.
struct Difference {
  std::size_t ids = 0, depths = 0, colours = 0;
  double farthest = 0;  ///< metres

  void add(const render::Frame& a, const render::Frame& b) {
    for (std::size_t i = 0; i < a.ids.size(); ++i) ids += a.ids[i] != b.ids[i] ? 1 : 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) colours += a.rgb[i] != b.rgb[i] ? 1 : 0;
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      if (std::memcmp(&a.depth[i], &b.depth[i], sizeof(float)) == 0) continue;
      ++depths;
      farthest = std::max(farthest, static_cast<double>(std::abs(a.depth[i] - b.depth[i])));
    }
  }
};

scene::Model loadNamedModel(const std::string& name) {
  const std::string district = "district:";
  if (name.starts_with(district))
    return assets::makeDistrict(std::stoul(name.substr(district.size())), 1);
  return scene::importModel(name, {});
}

std::vector<tests::WalkStop> walkIn(const std::shared_ptr<const scene::Scene>& scene,
                                    const std::string& name, int frames) {
  tests::SeededWalk walk(scene, 2026);
  // In a district: through the rooms of the gallery in its first block.
  const bool begun = name.starts_with("district:")
                         ? walk.beginAt(Vec3(-26, 0.46, 0) + assets::landmarks::kRooms[2], 0)
                         : walk.begin(0);
  return begun ? walk.walk(frames) : std::vector<tests::WalkStop>{};
}

bool areSame(const render::Frame& a, const render::Frame& b) {
  return a.rgb == b.rgb && a.ids == b.ids && a.depth.size() == b.depth.size() &&
         std::memcmp(a.depth.data(), b.depth.data(), a.depth.size() * sizeof(float)) == 0;
}

double readProcessSeconds() {
  std::timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Result {
  double seconds = 0, processor = 0;
  std::size_t frames = 0;
  render::FrameStatistics statistics{0, 0, 0, 0, 0};
};

render::Frame draw(render::GlRenderer& renderer, const tests::WalkStop& stop, Size size,
                   render::Culling culling, Result& result) {
  render::Camera camera = stop.camera;
  camera.width = size.width;
  camera.height = size.height;
  const double busy = readProcessSeconds();
  const auto begin = Clock::now();
  render::Frame frame =
      renderer.render(*stop.snapshot, camera, {.hiddenEntity = stop.walker, .culling = culling});
  result.seconds += std::chrono::duration<double>(Clock::now() - begin).count();
  result.processor += readProcessSeconds() - busy;
  ++result.frames;
  result.statistics.drawn += frame.statistics.drawn;
  result.statistics.occluded += frame.statistics.occluded;
  result.statistics.frustumCulled += frame.statistics.frustumCulled;
  result.statistics.passes += frame.statistics.passes - 1;
  return frame;
}

/// Walks once with culling alone, as in use. A second walk compares frames of both methods at some
/// stops. Only these stops of the first walk and of the drawing without culling are timed.
void measure(const std::shared_ptr<const scene::Scene>& scene, const std::string& name,
             bool textured, Size size, int frames) {
  const std::vector<tests::WalkStop> stops = walkIn(scene, name, frames);
  if (stops.empty()) {
    std::printf("%s: found no place to stand\n", name.c_str());
    return;
  }
  render::GlRenderer renderer(scene);
  Result warm, culled, single, ignored;
  for (int i = 0; i < 3; ++i) draw(renderer, stops[0], size, render::Culling::occlusion, warm);
  const std::size_t every = std::max<std::size_t>(1, stops.size() / kCompared);
  for (std::size_t i = 0; i < stops.size(); ++i)
    draw(renderer, stops[i], size, render::Culling::occlusion, i % every == 0 ? culled : warm);
  std::size_t different = 0, compared = 0;
  draw(renderer, stops[0], size, render::Culling::none, warm);
  for (std::size_t i = 0; i < stops.size(); i += every, ++compared) {
    const render::Frame all = draw(renderer, stops[i], size, render::Culling::none, single);
    const render::Frame seen = draw(renderer, stops[i], size, render::Culling::occlusion, ignored);
    different += areSame(all, seen) ? 0 : 1;
  }
  const double n = static_cast<double>(culled.frames), m = static_cast<double>(single.frames);
  const double fast = n / culled.seconds, slow = m / single.seconds;
  const double few = 1e3 * culled.processor / n, many = 1e3 * single.processor / m;
  std::printf(
      "%-28.28s %-5s %4dx%-4d %8.1f %8.2f %7.1f %7.1f %8.1f %7.1f  drawn %6.0f of %6.0f  redrawn "
      "%4.1f%%  %s\n",
      std::filesystem::path(name).filename().c_str(), textured ? "yes" : "no", size.width,
      size.height, fast, slow, fast / slow, few, many, many / few, culled.statistics.drawn / n,
      (culled.statistics.drawn + culled.statistics.occluded) / n,
      100 * static_cast<double>(culled.statistics.passes) / n,
      different == 0 ? "same bytes" : "DIFFERENT BYTES");
  std::fflush(stdout);
}

/// Cameras of one tick: rendered together against each alone, by turns.
void measureTogether(const std::shared_ptr<const scene::Scene>& scene, const std::string& name,
                     render::Renderer& renderer, Size size, bool coloured) {
  constexpr std::size_t kViews = 16;
  constexpr int kRounds = 12;
  const std::vector<tests::WalkStop> stops = walkIn(scene, name, 4 * kViews);
  if (stops.empty()) return;
  const scene::Snapshot& snapshot = *stops.front().snapshot;
  std::vector<render::View> views;
  for (std::size_t i = 0; i < stops.size() && views.size() < kViews; i += 4) {
    views.push_back({&snapshot, stops[i].camera, {.channels = {coloured, true, true, false}}});
    views.back().camera.width = size.width;
    views.back().camera.height = size.height;
  }
  double together = 0, alone = 0;
  Difference different;
  for (int round = -6; round < kRounds; ++round) {  // the first ones fill the caches
    const auto begin = Clock::now();
    const std::vector<render::Frame> frames = renderer.render(views);
    const auto middle = Clock::now();
    std::vector<render::Frame> each;
    for (const render::View& view : views)
      each.push_back(renderer.render(snapshot, view.camera, view.options));
    const auto end = Clock::now();
    for (std::size_t i = 0; i < views.size(); ++i) different.add(frames[i], each[i]);
    if (round < 0) continue;
    together += std::chrono::duration<double>(middle - begin).count();
    alone += std::chrono::duration<double>(end - middle).count();
  }
  const double frames = kRounds * static_cast<double>(views.size());
  std::printf(
      "%-28.28s %-12.12s %-6s %4dx%-4d %2zu views: %8.3f ms alone %8.3f ratio %5.2f  different: "
      "%zu ids, "
      "%zu depths (%.2g m), %zu colours\n",
      std::filesystem::path(name).filename().c_str(), renderer.deviceName().c_str(),
      coloured ? "colour" : "depth", size.width, size.height, views.size(), 1e3 * together / frames,
      1e3 * alone / frames, alone / together, different.ids, different.depths, different.farthest,
      different.colours);
  std::fflush(stdout);
}

void benchmarkTogether(const std::string& name) {
  const auto scene = std::make_shared<const scene::Scene>(loadNamedModel(name));
  render::GlRenderer gl(scene);
  render::RayRenderer rays(scene);
  for (render::Renderer* renderer :
       {static_cast<render::Renderer*>(&gl), static_cast<render::Renderer*>(&rays)})
    for (const Size size : {Size{64, 64}, Size{128, 128}, Size{256, 256}})
      for (const bool coloured : {false, true})
        measureTogether(scene, name, *renderer, size, coloured);
}

void benchmark(const std::string& name, int frames) {
  scene::Model model = loadNamedModel(name);
  const bool textures = !model.textures.empty();
  const auto textured = std::make_shared<const scene::Scene>(model);
  for (scene::Material& material : model.materials) material.baseColourTexture = -1;
  const auto plain = textures ? std::make_shared<const scene::Scene>(std::move(model)) : textured;
  for (const Size size : {Size{256, 256}, Size{640, 480}}) {
    measure(plain, name, false, size, frames);
    if (textures) measure(textured, name, true, size, frames);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportWorker(argc, argv)) return *code;
  if (argc > 2 && std::strcmp(argv[1], "together") == 0) {
    benchmarkTogether(argv[2]);
    return 0;
  }
  std::printf(
      "                                              on the clock              processor ms a "
      "frame\n"
      "scene                        text. size      frames/s one-each   ratio      ms one-each   "
      "ratio\n");
  const int frames = argc > 2 ? std::atoi(argv[2]) : 120;
  if (argc > 1) {
    benchmark(argv[1], frames);
    return 0;
  }
  benchmark("district:100000", frames);
  if (const auto shared = tests::findSharedFolder()) {
    benchmark((*shared / "scenes/schependomlaan/schependomlaan_estate.glb").string(), frames);
    benchmark((*shared / "scenes/aws-small-house/small_house.gltf").string(), frames);
  }
  return 0;
}
