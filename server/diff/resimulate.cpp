#include "server/diff/resimulate.hpp"

#include <chrono>
#include <map>
#include <stdexcept>

#include "protocol/recording/recording.hpp"
#include "render/image/atomic_file.hpp"
#include "scene/import/import_model.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/prepare_folder.hpp"
#include "server/base/progress.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/diff/change_images.hpp"
#include "server/diff/difference_json.hpp"
#include "server/diff/difference_text.hpp"
#include "server/log/log.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/in_process_driver.hpp"
#include "server/runs/reported_run.hpp"
#include "server/runs/run_report.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// Extra simulated time, in seconds, for orders that have not ended at the end of the recording.
constexpr double kMaxExtraSeconds = 60;
constexpr std::uint64_t kTicksPerUpdate = 64;

/// Completes the import options from the recording, because the new model is probably a version of
/// the old one.
ModelOptions makeModelOptions(const ModelOptions& requested, const v1::RecordingStart& start) {
  const ModelOptions recorded = modelOptionsFromProto(start.choices());
  ModelOptions model = requested;
  if (!model.import.metresPerUnit) model.import.metresPerUnit = recorded.import.metresPerUnit;
  if (!model.import.up) model.import.up = recorded.import.up;
  // The automatic offset depends on all objects, so that positions of commands would shift.
  if (!model.import.offset) model.import.offset = vectorFromProto(start.scene().offset());
  if (model.import.ifcReader == scene::IfcReader::automatic)
    model.import.ifcReader = recorded.import.ifcReader;
  if (model.doors == scene::IfcDoors::movable) model.doors = recorded.doors;
  model.import.georeference |= recorded.import.georeference;
  model.import.ignoreAppearance |= start.choices().ignore_appearance();
  if (model.import.gltfScene.empty()) model.import.gltfScene = recorded.import.gltfScene;
  return model;
}

/// Counts ends of orders by avatar and tag.
class OrderEndCounts {
 public:
  void add(const v1::Notice& notice, int count) {
    if (notice.kind() == v1::Notice::KIND_LEFT || notice.kind() == v1::Notice::KIND_CAPTURE ||
        notice.kind() == v1::Notice::KIND_DROPPED)
      return;
    int& missing = missing_[{notice.avatar(), notice.tag()}];
    open_ += (missing + count > 0 ? 1 : 0) - (missing > 0 ? 1 : 0);
    missing += count;
  }
  /// True if an order that ended in the recording has not ended yet.
  bool open() const { return open_ > 0; }

 private:
  std::map<std::pair<std::string, std::uint64_t>, int> missing_;
  int open_ = 0;
};

void countOutcome(protocol::ScriptResult& result, const protocol::StepOutcome& outcome) {
  result.ticks = outcome.tick;
  result.time = outcome.time;
  result.stateHash = outcome.stateHash;
  for (const v1::Notice& notice : outcome.notices) {
    result.spawned += notice.kind() == v1::Notice::KIND_SPAWNED ? 1 : 0;
    result.arrived += notice.kind() == v1::Notice::KIND_ARRIVED ? 1 : 0;
    result.blocked += notice.kind() == v1::Notice::KIND_BLOCKED ? 1 : 0;
    result.refused += notice.kind() == v1::Notice::KIND_REFUSED ? 1 : 0;
  }
  for (const protocol::CapturedFrame& frame : outcome.frames)
    ++(frame.error.empty() ? result.captured : result.uncaptured);
}

/// Submits the recorded commands to the new model.
class WalkResimulation {
 public:
  WalkResimulation(InProcessDriver& driver, RunReport& report) : driver_(driver), report_(report) {}

  /// `bytes`: size of the recording, for the progress bar.
  void replayCommands(protocol::RecordingReader& recording, double bytes) {
    while (const auto item = recording.next()) {
      if (const auto* commands = std::get_if<v1::RecordedCommands>(&*item))
        submitCommands(*commands);
      if (const auto* events = std::get_if<v1::TickEvents>(&*item))
        for (const v1::Notice& notice : events->notices()) ends_.add(notice, 1);
      if (!std::holds_alternative<v1::State>(*item)) continue;
      step();
      if (result.ticks % kTicksPerUpdate == 0)
        bar_.show(static_cast<double>(recording.wholeBytes()) / bytes,
                  "tick " + std::to_string(result.ticks));
    }
    bar_.clear();
  }

  /// Continues so that orders which now take longer can end.
  void finish() {
    const auto maxTicks = static_cast<std::uint64_t>(kMaxExtraSeconds / driver_.tickSeconds());
    std::uint64_t extraTicks = 0;
    while (ends_.open() && !idle_ && extraTicks < maxTicks) {
      step();
      ++extraTicks;
    }
    bar_.clear();
    if (extraTicks > 0)
      logInfo("{} ticks more than recorded: some orders take longer{}", extraTicks,
              ends_.open() && !idle_ ? ", and have not ended yet" : "");
  }

  protocol::ScriptResult result;
  std::vector<RefusedCommand> refused;
  std::uint32_t maxPairs = 0;

 private:
  void submitCommands(const v1::RecordedCommands& commands) {
    for (const auto& one : commands.commands()) {
      const auto error = one.has_body() ? driver_.submit(one.body()) : driver_.submit(one.avatar());
      if (!error) continue;
      const std::string& name = one.has_body() ? one.body().body() : one.avatar().avatar();
      refused.push_back({commands.tick(), name, error->message()});
      ++result.refused;
      result.outcomes.push_back(
          {protocol::LineOutcome::Kind::refused,
           one.has_body() ? 0 : static_cast<std::uint32_t>(one.avatar().tag()), commands.tick(),
           name, name + ": " + error->message()});
    }
  }

  void step() {
    if (isInterrupted()) throw Interrupted{};
    protocol::StepOutcome outcome = driver_.step();
    idle_ = outcome.idle;
    for (const v1::Notice& notice : outcome.notices) ends_.add(notice, -1);
    countOutcome(result, outcome);
    report_.add(outcome);
    if (outcome.tick % kTicksPerUpdate == 0)
      maxPairs = std::max(maxPairs, driver_.metrics().pairs());
  }

  InProcessDriver& driver_;
  RunReport& report_;
  OrderEndCounts ends_;
  bool idle_ = false;
  Progress bar_;
};

v1::RecordingStart readStart(protocol::RecordingReader& recording,
                             const std::filesystem::path& file) {
  const auto first = recording.next();
  if (first && std::holds_alternative<v1::RecordingStart>(*first))
    return std::get<v1::RecordingStart>(*first);
  throw RecordingError(file.string() + ": not a recording of Enfilade");
}

/// Loads the recorded model if it is unchanged; otherwise logs the reason and returns null.
std::shared_ptr<const scene::Scene> loadRecordedScene(const v1::RecordingStart& start, bool cache) {
  ModelOptions model = modelOptionsFromProto(start.choices());
  model.file = start.scene_file();
  model.cache = cache;
  try {
    if (!std::filesystem::exists(model.file)) throw std::runtime_error("it does not exist");
    auto scene = loadScene(model);
    if (scene->hash() != start.scene().hash())
      throw std::runtime_error("it changed since the recording");
    return scene;
  } catch (const std::exception& error) {
    logInfo("pictures show only the new model: {}: {}", model.file.string(), error.what());
    return nullptr;
  }
}

/// Runs the walk and writes its report and recording.
std::vector<RefusedCommand> resimulateWalk(const ResimulateCommand& command,
                                           protocol::RecordingReader& recording,
                                           const v1::RecordingStart& start,
                                           const std::shared_ptr<const scene::Scene>& scene,
                                           render::RendererSelector* renderer,
                                           const std::filesystem::path& record) {
  const auto startTime = std::chrono::steady_clock::now();
  const auto settings = settingsFromProto(start.lengths());
  if (!settings) throw RecordingError("the recording has invalid world settings");
  RunReport report(command.out);
  report.removePreviousRun();
  RecordableWorld world(scene::World(scene, *settings));
  RecordingOptions options;
  options.choice.file = record;
  options.model = command.model;
  world.record(options);
  InProcessDriver driver(world, renderer);
  WalkResimulation walk(driver, report);
  walk.replayCommands(recording,
                      static_cast<double>(std::filesystem::file_size(command.recording)));
  walk.finish();
  RunSummary summary{command.recording.filename().string(),
                     toProto(*scene),
                     renderer ? renderer->deviceName() : std::string(),
                     driver.metrics(),
                     walk.maxPairs,
                     0};
  summary.maxPairs = std::max(summary.maxPairs, summary.metrics.pairs());
  PlanRenderer renderPlan = [](const render::Camera&) { return std::nullopt; };
  if (renderer) renderPlan = makePlanRenderer(*renderer, world.snapshot());
  report.writePictures(summary, {std::move(renderPlan), makeFloorPlanSource(scene)});
  report.writeContacts(driver.endContacts());
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - startTime;
  summary.wallSeconds = elapsed.count();
  report.writeSummary(summary, walk.result);
  if (const auto error = world.recorder()->close()) throw RecordingError(*error);
  return std::move(walk.refused);
}

}  // namespace

ExitCode resimulate(const ResimulateCommand& requested) {
  return runInterruptible(
      [&] {
        ResimulateCommand command = requested;
        protocol::RecordingReader recording(command.recording, command.run);
        const v1::RecordingStart start = readStart(recording, command.recording);
        command.model = makeModelOptions(requested.model, start);
        const auto scene = loadScene(command.model);
        const auto renderer = tryMakeRenderer(scene, command.drawing);
        const auto record = command.record.empty() ? command.out / "new.mcap" : command.record;
        prepareFolder(command.out);
        requireDifferentFiles(record, command.recording);
        auto refused = resimulateWalk(command, recording, start, scene, renderer.get(), record);
        WalkDifference difference =
            compareWalks(command.recording, record, command.tolerance, command.run);
        difference.refused = std::move(refused);
        difference.worse += difference.refused.size();
        if (renderer && command.pictures > 0 && !difference.isEmpty()) {
          const auto before = loadRecordedScene(start, command.model.cache);
          drawChanges(difference, {before, scene, renderer.get(), command.drawing},
                      command.pictures, command.out);
        }
        const std::string text = formatDifferenceText(difference),
                          json = formatDifferenceJson(difference);
        render::writeFileAtomically(command.out / "diff.txt", text);
        render::writeFileAtomically(command.out / "diff.json", json + "\n");
        writeToStdout(command.json ? json + "\n" : text,
                      "the changes are in " + (command.out / "diff.txt").string());
        return difference.worse > 0 ? ExitCode::violations : ExitCode::success;
      },
      "no more files are written");
}

}  // namespace enfilade::server
