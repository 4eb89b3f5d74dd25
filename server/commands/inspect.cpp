#include "server/commands/inspect.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "protocol/mcap/reader.hpp"
#include "render/service/renderer.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "server/base/standard_output.hpp"
#include "server/commands/inspect_recording.hpp"
#include "server/commands/inspection.hpp"
#include "server/plans/floor_plans.hpp"

namespace enfilade::server {
namespace {

/// Makes the folder. Throws when it cannot be written to: better before a long import than after.
void prepareFolder(const std::filesystem::path& folder) {
  const std::filesystem::path probe = folder / ".writable";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::ofstream(probe).put(' ').flush())
    error = std::error_code(errno, std::generic_category());
  if (error)
    throw std::runtime_error("cannot write into " + folder.string() + ": " + error.message() +
                             "; give another folder with --plan");
  std::filesystem::remove(probe);
}

void drawPlans(const std::shared_ptr<const scene::Scene>& scene,
               const std::filesystem::path& folder) {
  render::Renderer renderer(scene);
  const TakePicture picture = [&](const render::Camera& camera) {
    const render::Frame frame = renderer.render(scene::Snapshot(), camera);
    return std::optional(PlanPicture{render::colourOf(frame), frame.ids});
  };
  int number = 0;
  for (const StoreyFloor& storey : storeysOf(*scene)) {
    const auto file = folder / ("storey-" + std::to_string(++number) + ".png");
    render::writePng(file, drawStoreyPlan(*scene, storey, picture).value());
    spdlog::info("floor at {:.2f} m: {}", storey.height, file.string());
  }
}

}  // namespace

ExitCode inspect(const InspectCommand& command) {
  if (protocol::mcap::isMcap(command.model.file))
    return inspectRecording(command.model.file, command.json, command.strict);
  if (!command.plan.empty()) prepareFolder(command.plan);
  const Inspection inspection =
      inspected(loadSceneTimed(command.model),
                command.model.cache ? scene::modelCacheOfEnvironment() : std::nullopt);
  const std::string text = command.json ? inspectionJson(inspection, command.objects) + "\n"
                                        : inspectionTable(inspection, command.objects);
  writeToStdout(text);
  if (!command.plan.empty()) drawPlans(inspection.loaded.scene, command.plan);
  const auto& problems = inspection.report.problems;
  const bool wrong = command.strict &&
                     std::any_of(problems.begin(), problems.end(),
                                 [](const auto& problem) { return !scene::kindOf(problem).note; });
  return wrong ? ExitCode::violations : ExitCode::done;
}

}  // namespace enfilade::server
