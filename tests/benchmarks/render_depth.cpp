// Benchmark of renderers and depth buffers: speed against error. Depth and ids of the same cameras
// are compared with rays in doubles.
//
//   render_depth [--quick] [--out FILE] [--only PART_OF_A_SCENE]
//
// Scenes: the bundled building, the small house and the estate of the shared folder, and a district
// of 1e5 objects. They have no textures, masks and transparency, so that all methods see the same
// triangles. Cameras stand 1.6 m above the floor at seeded places and look level. Methods alternate
// at each camera; the first frame of a method is not timed. Reports CPU time of the process and
// wall-clock time.
#include <time.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "assets/building.hpp"
#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "render/reference/depth_report.hpp"
#include "scene/import/import_model.hpp"
#include "scene/import/import_worker.hpp"
#include "scene/world/queries/ray_caster.hpp"
#include "tests/benchmarks/depth_variant.hpp"
#include "tests/benchmarks/measurement.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade::benchmarks {
namespace {

using render::Camera;
using render::Frame;
using scene::Vec3;

double readProcessSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct NamedScene {
  std::string name;
  std::function<scene::Model()> make;
};

std::vector<NamedScene> listScenes() {
  std::vector<NamedScene> all{{"building", [] { return assets::makeBuilding(); }},
                              {"district", [] { return assets::makeDistrict(100'000, 1); }}};
  if (const auto shared = tests::findSharedFolder()) {
    const auto file = [&](const char* path) {
      return [path = *shared / "scenes" / path] { return scene::importModel(path); };
    };
    all.push_back({"small house", file("aws-small-house/small_house.gltf")});
    all.push_back({"estate", file("schependomlaan/schependomlaan_estate.glb")});
  } else {
    std::printf("no shared folder: the small house and the estate are skipped\n");
  }
  return all;
}

/// Reduces the scene to what all methods draw alike.
std::shared_ptr<const scene::Scene> makePlainScene(scene::Model model) {
  for (scene::Material& material : model.materials) {
    material.alpha = scene::Material::Alpha::opaque;
    material.baseColourTexture = -1;
  }
  model.bodies.clear();
  return std::make_shared<const scene::Scene>(std::move(model));
}

/// Cameras at eye height with a floor below and an object ahead.
std::vector<Camera> placeCamerasIn(const std::shared_ptr<const scene::Scene>& scene, int count) {
  const scene::RayCaster caster(scene);
  const scene::Aabb& bounds = scene->bounds();
  std::mt19937_64 random(2026);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  std::vector<Camera> cameras;
  constexpr int kTries = 10'000;
  for (int i = 0; i < kTries && static_cast<int>(cameras.size()) < count; ++i) {
    const double x = uniform(bounds.min.x(), bounds.max.x());
    const double y = uniform(bounds.min.y(), bounds.min.y() + 3);
    const double z = uniform(bounds.min.z(), bounds.max.z());
    const double turn = uniform(0, 6.283);
    const auto floor = caster.firstHit({{x, y + 1.6, z}, -Vec3::UnitY(), 3});
    if (!floor) continue;
    Camera camera;
    camera.eye = floor->point + Vec3(0, 1.6, 0);
    camera.forward = {std::cos(turn), -0.05, std::sin(turn)};
    camera.near = 0.1;
    camera.far = 500;
    const auto ahead = caster.firstHit({camera.eye, camera.forward, 30});
    const auto above = caster.firstHit({camera.eye, Vec3::UnitY(), 30});
    if (ahead && above && ahead->distance > 1) cameras.push_back(camera);
  }
  return cameras;
}

struct Method {
  std::string name;
  std::function<void(const Camera&)> aim;
  std::function<Frame(const Camera&)> draw;
  std::vector<double> milliseconds = {}, processor = {};
  render::DepthReport report = {};
};

const render::FrameOptions kMeasured{0, {false, true, true, false}};

std::vector<Method> makeMethodsFor(const std::shared_ptr<const scene::Scene>& scene) {
  const auto ignore = [](const Camera&) {};
  std::vector<Method> methods;
  for (const DepthBuffer& buffer :
       {DepthBuffer{"GL D24 standard", false, false}, DepthBuffer{"GL D32F standard", true, false},
        DepthBuffer{"GL D32F reversed", true, true}}) {
    const auto variant = std::make_shared<DepthVariant>(scene, buffer);
    methods.push_back({buffer.name, [=](const Camera& camera) { variant->aim(camera); },
                       [=](const Camera& camera) { return variant->draw(camera); }});
  }
  const auto gl = std::make_shared<render::GlRenderer>(scene);
  methods.push_back({"GL renderer", ignore,
                     [=](const Camera& camera) { return gl->render({}, camera, kMeasured); }});
  const auto rays = std::make_shared<render::RayRenderer>(scene);
  methods.push_back({"rays robust (renderer)", ignore,
                     [=](const Camera& camera) { return rays->render({}, camera, kMeasured); }});
  return methods;
}

void take(Method& method, const Camera& camera, const render::ReferenceFrame& truth, int times) {
  method.aim(camera);
  render::mergeReports(method.report, render::compareWithReference(method.draw(camera), truth));
  for (int i = 0; i < times; ++i) {
    const auto start = Clock::now();
    const double begun = readProcessSeconds();
    method.draw(camera);
    method.processor.push_back(1e3 * (readProcessSeconds() - begun));
    method.milliseconds.push_back(1e3 * measureSecondsSince(start));
  }
}

nlohmann::json makeLine(const std::string& scene, const scene::Model& model, std::size_t triangles,
                        const Camera& size, const Method& method) {
  nlohmann::json line = nlohmann::json::parse(render::formatReportJson(method.report));
  line["bench"] = "depth";
  line["scene"] = scene;
  line["objects"] = model.objects.size();
  line["triangles"] = triangles;
  line["size"] = std::to_string(size.width) + "x" + std::to_string(size.height);
  line["method"] = method.name;
  line["ms"] = toJsonNumber(computeQuantile(method.milliseconds, 0.5));
  line["cpu_ms"] = toJsonNumber(computeQuantile(method.processor, 0.5));
  return line;
}

std::size_t countTriangles(const scene::Model& model) {
  std::size_t triangles = 0;
  for (const scene::Object& object : model.objects)
    for (const std::uint32_t mesh : object.meshes)
      triangles += model.meshes[mesh].indices.size() / 3;
  return triangles;
}

void measure(const NamedScene& named, const Arguments& arguments, Results& results) {
  const auto scene = makePlainScene(named.make());
  const std::vector<Camera> cameras = placeCamerasIn(scene, arguments.quick ? 3 : 5);
  std::printf("%s: %zu objects, %zu cameras\n", named.name.c_str(), scene->model().objects.size(),
              cameras.size());
  render::ReferenceTracer rays(scene);
  const std::size_t triangles = countTriangles(scene->model());
  for (const auto& [width, height] : {std::pair(256, 256), std::pair(640, 480)}) {
    if (arguments.quick && width > 256) break;
    std::vector<Method> methods = makeMethodsFor(scene);
    Camera size;
    for (Camera camera : cameras) {
      camera.width = width;
      camera.height = height;
      size = camera;
      const render::ReferenceFrame truth = rays.render({}, camera);
      for (Method& method : methods) take(method, camera, truth, arguments.quick ? 2 : 3);
    }
    for (const Method& method : methods) {
      results.add(makeLine(named.name, scene->model(), triangles, size, method));
      const render::DepthErrors& away = method.report.awayFromEdges;
      std::printf("  %4dx%-4d %-24s %8.2f ms %8.2f ms CPU   mean %.5f mm  max %.4f mm\n", width,
                  height, method.name.c_str(), computeQuantile(method.milliseconds, 0.5),
                  computeQuantile(method.processor, 0.5), 1e3 * away.mean(), 1e3 * away.max);
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace enfilade::benchmarks

int main(int argc, char** argv) {
  using namespace enfilade;
  if (const auto code = scene::runImportWorker(argc, argv)) return *code;
  const benchmarks::Arguments arguments(argc, argv);
  benchmarks::Results results(arguments);
  for (const auto& scene : benchmarks::listScenes())
    if (arguments.wants(scene.name)) benchmarks::measure(scene, arguments, results);
}
