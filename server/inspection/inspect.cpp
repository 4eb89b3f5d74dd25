#include "server/inspection/inspect.hpp"

#include <cmath>
#include <filesystem>

#include "protocol/mcap/reader.hpp"
#include "render/image/atomic_file.hpp"
#include "render/service/renderer_selector.hpp"
#include "server/base/prepare_folder.hpp"
#include "server/base/standard_output.hpp"
#include "server/inspection/inspect_recording.hpp"
#include "server/inspection/inspection.hpp"
#include "server/inspection/inspection_html.hpp"
#include "server/log/log.hpp"
#include "server/plans/floor_plans.hpp"

namespace enfilade::server {
namespace {

void writePlans(const std::shared_ptr<const scene::Scene>& scene, const InspectCommand& command) {
  render::RendererSelector renderer(scene);
  const PlanRenderer picture = makePlanRenderer(renderer, std::make_shared<scene::Snapshot>());
  int number = 0;
  for (const StoreyFloor& storey : findStoreys(*scene)) {
    const auto file =
        command.plan / ("storey-" + std::to_string(++number) + "." + command.planFormat);
    if (command.planFormat == "png") {
      render::writePng(file, drawStoreyPlan(*scene, storey, picture).value());
    } else {
      writeStoreyPage(*scene, storey, picture, command.planScale, file);
    }
    // Without the sign of a zero.
    const double rounded = std::round(100 * storey.height) / 100 + 0.0;
    logInfo("floor at {:.2f} m: {}", rounded, file.string());
  }
}

void writePage(const Inspection& inspection, const InspectCommand& command) {
  const std::shared_ptr<const scene::Scene>& scene = inspection.loaded.scene;
  render::RendererSelector renderer(scene);
  const PlanRenderer picture = makePlanRenderer(renderer, std::make_shared<scene::Snapshot>());
  std::vector<StoreyPlan> plans;
  for (const StoreyFloor& storey : findStoreys(*scene))
    plans.push_back(
        {storey.name.empty() ? fmt::format("Floor at {:.2f} m", storey.height) : storey.name,
         drawStoreyPlan(*scene, storey, picture).value()});
  render::writeFileAtomically(command.html,
                              formatInspectionHtml(inspection, command.accepted, plans));
  logInfo("report: {}", command.html.string());
}

/// Logs the kinds that fail the check, with the option that accepts them.
ExitCode checkDiagnostics(const scene::SceneReport& report,
                          const std::vector<std::string>& accepted) {
  std::string kinds;
  for (const InspectedDiagnostic& entry : listDiagnostics(report, accepted))
    if (entry.fails()) kinds += (kinds.empty() ? "" : ",") + entry.diagnostic->kind;
  if (kinds.empty()) return ExitCode::success;
  logError("--strict: the scene has problems; --accept {} accepts them", kinds);
  return ExitCode::violations;
}

/// Throws for a file that is a recording by its name, but not by its first bytes.
void requireNoMcapName(const std::filesystem::path& file) {
  if (file.extension() == ".mcap" && std::filesystem::is_regular_file(file))
    throw std::runtime_error(file.string() +
                             ": not an MCAP file by its first bytes; copy the recording again");
}

}  // namespace

ExitCode inspect(const InspectCommand& command) {
  if (protocol::mcap::isMcap(command.model.file))
    return inspectRecording(command.model.file, command.json, command.strict);
  requireNoMcapName(command.model.file);
  if (!command.plan.empty()) prepareFolder(command.plan, "--plan");
  const Inspection inspection =
      makeInspection(loadSceneTimed(command.model),
                     command.model.cache ? scene::findDefaultModelCache() : std::nullopt);
  writeToStdout(command.json
                    ? formatInspectionJson(inspection, command.accepted, command.objects) + "\n"
                    : formatInspectionTable(inspection, command.accepted, command.objects));
  if (!command.plan.empty()) writePlans(inspection.loaded.scene, command);
  if (!command.html.empty()) writePage(inspection, command);
  return command.strict ? checkDiagnostics(inspection.report, command.accepted) : ExitCode::success;
}

}  // namespace enfilade::server
