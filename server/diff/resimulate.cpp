#include "server/diff/resimulate.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <map>
#include <stdexcept>

#include "protocol/recording/recording.hpp"
#include "scene/import/import_model.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/progress.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/diff/change_images.hpp"
#include "server/diff/difference_report.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/in_process_driver.hpp"
#include "server/runs/run_report.hpp"
#include "server/runs/script_run.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// Seconds of simulated time that walks get beyond the recorded ones, where some have not ended.
constexpr double kMostExtra = 60;
constexpr std::uint64_t kTicksPerBar = 64;

/// What the command line leaves open the recording says: the new model is most likely of the same
/// kind as the old one.
ModelOptions modelLike(const ModelOptions& asked, const v1::RecordingStart& start) {
  const ModelOptions was = modelOptionsFrom(start.choices());
  ModelOptions model = asked;
  if (!model.metresPerUnit) model.metresPerUnit = was.metresPerUnit;
  if (!model.up) model.up = was.up;
  // The importer's own depends on all objects: commands and places would be those of another spot.
  if (!model.offset) model.offset = vectorFrom(start.scene().offset());
  if (model.ifcReader == scene::IfcReader::automatic) model.ifcReader = was.ifcReader;
  if (model.doors == scene::IfcDoors::move) model.doors = was.doors;
  return model;
}

/// How often orders ended, by avatar and tag.
class OrderEnds {
 public:
  void add(const v1::Notice& notice, int count) {
    if (notice.kind() == v1::Notice::KIND_LEFT || notice.kind() == v1::Notice::KIND_CAPTURE ||
        notice.kind() == v1::Notice::KIND_DROPPED)
      return;
    int& missing = missing_[{notice.avatar(), notice.tag()}];
    open_ += (missing + count > 0 ? 1 : 0) - (missing > 0 ? 1 : 0);
    missing += count;
  }
  /// Some order has not ended yet that ended in the recording.
  bool open() const { return open_ > 0; }

 private:
  std::map<std::pair<std::string, std::uint64_t>, int> missing_;
  int open_ = 0;
};

void count(protocol::ScriptResult& result, const protocol::StepOutcome& outcome) {
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

/// The recorded commands on their way through the new model.
class Walk {
 public:
  Walk(InProcessDriver& driver, WalkReport& report) : driver_(driver), report_(report) {}

  /// `bytes`: of the recording, for the bar.
  void follow(protocol::RecordingReader& recording, double bytes) {
    while (const auto item = recording.next()) {
      if (const auto* commands = std::get_if<v1::RecordedCommands>(&*item)) take(*commands);
      if (const auto* events = std::get_if<v1::TickEvents>(&*item))
        for (const v1::Notice& notice : events->notices()) ends_.add(notice, 1);
      if (!std::holds_alternative<v1::State>(*item)) continue;
      step();
      if (result.ticks % kTicksPerBar == 0)
        bar_.show(static_cast<double>(recording.wholeBytes()) / bytes,
                  "tick " + std::to_string(result.ticks));
    }
    bar_.clear();
  }

  /// Walks that now take longer may come to their end.
  void finish() {
    const auto most = static_cast<std::uint64_t>(kMostExtra / driver_.tickSeconds());
    std::uint64_t extra = 0;
    while (ends_.open() && !idle_ && extra < most) {
      step();
      ++extra;
    }
    bar_.clear();
    if (extra > 0)
      spdlog::info("{} ticks more than were recorded: some orders take longer{}", extra,
                   ends_.open() && !idle_ ? ", and have not ended yet" : "");
  }

  protocol::ScriptResult result;
  std::vector<RefusedCommand> refused;
  std::uint32_t mostPairs = 0;

 private:
  void take(const v1::RecordedCommands& commands) {
    for (const auto& one : commands.commands()) {
      const auto why = one.has_body() ? driver_.submit(one.body()) : driver_.submit(one.avatar());
      if (!why) continue;
      const std::string& who = one.has_body() ? one.body().body() : one.avatar().avatar();
      refused.push_back({commands.tick(), who, why->message()});
      ++result.refused;
      result.outcomes.push_back(
          {protocol::LineOutcome::Kind::refused,
           one.has_body() ? 0 : static_cast<std::uint32_t>(one.avatar().tag()), commands.tick(),
           who, who + ": " + why->message()});
    }
  }

  void step() {
    if (interrupted()) throw Interrupted{};
    protocol::StepOutcome outcome = driver_.step();
    idle_ = outcome.idle;
    for (const v1::Notice& notice : outcome.notices) ends_.add(notice, -1);
    count(result, outcome);
    report_.add(outcome);
    if (outcome.tick % kTicksPerBar == 0)
      mostPairs = std::max(mostPairs, driver_.metrics().pairs());
  }

  InProcessDriver& driver_;
  WalkReport& report_;
  OrderEnds ends_;
  bool idle_ = false;
  Progress bar_;
};

v1::RecordingStart startOf(protocol::RecordingReader& recording,
                           const std::filesystem::path& file) {
  const auto first = recording.next();
  if (first && std::holds_alternative<v1::RecordingStart>(*first))
    return std::get<v1::RecordingStart>(*first);
  throw RecordingError(file.string() + ": no recording of Enfilade begins in it");
}

/// The model that was recorded, if it is still there as it was; else null, and told.
std::shared_ptr<const scene::Scene> recordedScene(const v1::RecordingStart& start, bool cache) {
  ModelOptions model = modelOptionsFrom(start.choices());
  model.file = start.scene_file();
  model.cache = cache;
  try {
    if (!std::filesystem::exists(model.file)) throw std::runtime_error("it is not there");
    auto scene = loadScene(model);
    if (scene->hash() != start.scene().hash())
      throw std::runtime_error("it is not as it was recorded");
    return scene;
  } catch (const std::exception& error) {
    spdlog::info("pictures of the new model alone: {}: {}", model.file.string(), error.what());
    return nullptr;
  }
}

void writeText(const std::filesystem::path& file, const std::string& text) {
  render::writeFileWhole(file, text.data(), text.size());
}

TakePicture pictureOf(render::Renderer* renderer, const scene::World& world) {
  return [renderer, &world](const render::Camera& camera) -> std::optional<PlanPicture> {
    if (!renderer) return std::nullopt;
    const render::Frame frame = renderer->render(*world.snapshot(), camera);
    return PlanPicture{render::colourOf(frame), frame.ids};
  };
}

/// Everything up to the new recording.
std::vector<RefusedCommand> walkAgain(const RewalkCommand& command,
                                      protocol::RecordingReader& recording,
                                      const v1::RecordingStart& start,
                                      const std::shared_ptr<const scene::Scene>& scene,
                                      render::Renderer* renderer,
                                      const std::filesystem::path& record) {
  const auto began = std::chrono::steady_clock::now();
  const auto lengths = lengthsFrom(start.lengths());
  if (!lengths) throw RecordingError("the recording has lengths that no world can have");
  WalkReport report(command.out);
  report.removeEarlier();
  RecordedWorld world(scene::World(scene, *lengths));
  RecordingOptions options;
  options.choice.file = record;
  options.model = command.model;
  world.record(options);
  InProcessDriver driver(world, renderer);
  Walk walk(driver, report);
  walk.follow(recording, static_cast<double>(std::filesystem::file_size(command.recording)));
  walk.finish();
  WalkFacts facts{command.recording.filename().string(),
                  messageOf(*scene),
                  renderer ? renderer->deviceName() : std::string(),
                  driver.metrics(),
                  walk.mostPairs,
                  0};
  facts.mostPairs = std::max(facts.mostPairs, facts.metrics.pairs());
  report.writePictures(facts, {pictureOf(renderer, world), scene.get()});
  report.writeContacts(driver.endContacts());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  facts.wallSeconds = took.count();
  report.writeSummary(facts, walk.result);
  if (const auto broken = world.recorder()->close()) throw RecordingError(*broken);
  return std::move(walk.refused);
}

}  // namespace

ExitCode rewalk(const RewalkCommand& asked) {
  return interruptible(
      [&] {
        RewalkCommand command = asked;
        protocol::RecordingReader recording(command.recording, command.run);
        const v1::RecordingStart start = startOf(recording, command.recording);
        command.model = modelLike(asked.model, start);
        const auto scene = loadScene(command.model);
        const auto renderer = rendererOf(scene, command.drawing);
        const auto record = command.record.empty() ? command.out / "new.mcap" : command.record;
        std::filesystem::create_directories(command.out);
        requireAnotherFile(record, command.recording);
        auto refused = walkAgain(command, recording, start, scene, renderer.get(), record);
        WalkDifference difference =
            compareWalks(command.recording, record, command.tolerance, command.run);
        difference.refused = std::move(refused);
        difference.worse += difference.refused.size();
        if (renderer && command.pictures > 0 && !difference.none()) {
          const auto before = recordedScene(start, command.model.cache);
          drawChanges(difference, {before, scene, renderer.get(), command.drawing},
                      command.pictures, command.out);
        }
        const std::string text = differenceText(difference), json = differenceJson(difference);
        writeText(command.out / "diff.txt", text);
        writeText(command.out / "diff.json", json + "\n");
        writeToStdout(command.json ? json + "\n" : text,
                      "what changed stands in " + (command.out / "diff.txt").string());
        return difference.worse > 0 ? ExitCode::violations : ExitCode::done;
      },
      "nothing more is written");
}

}  // namespace enfilade::server
