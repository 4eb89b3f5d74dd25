#include "server/load_scene.hpp"

#include <spdlog/spdlog.h>

#include "scene/import_model.hpp"
#include "server/progress.hpp"

namespace enfilade::server {

std::shared_ptr<const scene::Scene> loadScene(const ModelOptions& options) {
  scene::ImportOptions import;
  import.metresPerUnit = options.metresPerUnit;
  import.up = options.up;
  Progress bar;
  auto model = scene::importModel(
      options.file, import,
      [&](const std::string& stage, double fraction) { bar.show(fraction, stage); });
  bar.clear();
  for (const scene::Problem& problem : model.problems) {
    spdlog::info("{}: {} x {}, as {}", options.file.filename().string(), problem.count,
                 problem.kind, problem.example);
  }
  auto scene = std::make_shared<const scene::Scene>(std::move(model));
  const auto& made = scene->model();
  const scene::Vec3 size =
      scene->bounds().empty() ? scene::Vec3::Zero().eval() : scene->bounds().size();
  spdlog::info("{}: {} objects, {:.1f} x {:.1f} x {:.1f} m, unit {} m, up {}",
               options.file.filename().string(), made.objects.size(), size.x(), size.y(), size.z(),
               made.metresPerUnit, made.up);
  return scene;
}

}  // namespace enfilade::server
