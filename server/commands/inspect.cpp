#include "server/commands/inspect.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "protocol/mcap/reader.hpp"
#include "render/service/renderer_selector.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "server/base/standard_output.hpp"
#include "server/capture/capture_folder.hpp"
#include "server/commands/inspect_recording.hpp"
#include "server/commands/inspection.hpp"
#include "server/plans/floor_plans.hpp"

namespace enfilade::server {
namespace {

void drawPlans(const std::shared_ptr<const scene::Scene>& scene, const InspectCommand& command) {
  render::RendererSelector renderer(scene);
  const PlanRenderer picture = [&](const render::Camera& camera) {
    const render::Frame frame = renderer.render(scene::Snapshot(), camera);
    return std::optional(PlanPicture{render::toImage(frame), frame.ids});
  };
  int number = 0;
  for (const StoreyFloor& storey : findStoreys(*scene)) {
    const auto file =
        command.plan / ("storey-" + std::to_string(++number) + "." + command.planFormat);
    if (command.planFormat == "png") {
      render::writePng(file, drawStoreyPlan(*scene, storey, picture).value());
    } else {
      writeStoreyPage(*scene, storey, picture, command.planScale, file);
    }
    spdlog::info("floor at {:.2f} m: {}", storey.height, file.string());
  }
}

}  // namespace

ExitCode inspect(const InspectCommand& command) {
  if (protocol::mcap::isMcap(command.model.file))
    return inspectRecording(command.model.file, command.json, command.strict);
  if (!command.plan.empty()) prepareFolder(command.plan, "--plan");
  const Inspection inspection =
      makeInspection(loadSceneTimed(command.model),
                     command.model.cache ? scene::modelCacheFromEnvironment() : std::nullopt);
  const std::string text = command.json ? formatInspectionJson(inspection, command.objects) + "\n"
                                        : formatInspectionTable(inspection, command.objects);
  writeToStdout(text);
  if (!command.plan.empty()) drawPlans(inspection.loaded.scene, command);
  const auto& problems = inspection.report.diagnostics;
  const bool hasProblems =
      command.strict && std::any_of(problems.begin(), problems.end(), [](const auto& problem) {
        return !scene::findDiagnosticKind(problem).isNote;
      });
  return hasProblems ? ExitCode::violations : ExitCode::success;
}

}  // namespace enfilade::server
