#include "server/runs/reported_run.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <set>

#include "protocol/clients/cpp/socket_driver.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/progress.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/floors/plan_messages.hpp"
#include "server/log/log.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/frame_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/recording/contact_history.hpp"
#include "server/recording/playback.hpp"
#include "server/runs/in_process_driver.hpp"
#include "server/runs/run_report.hpp"

namespace enfilade::server {

namespace {

constexpr std::uint32_t kWidth = 960, kHeight = 540;  // pixels of a capture
constexpr std::uint64_t kTicksPerSample = 16;         // of the broad phase's pair count

/// The world of a script run, as the report needs it.
struct ScriptTarget {
  protocol::ScriptDriver& driver;
  std::function<protocol::ReceivedFrame(const v1::FrameRequest&)> frame;
  std::function<v1::Metrics()> metrics;
  /// Ends the contacts that are active after the run, and returns their end events.
  std::function<std::vector<v1::ContactEvent>()> endContacts;
  v1::Scene scene;
  std::string renderer;
  FloorPlanSource findFloorPlan;  ///< for the map
};

protocol::CaptureFormat makeCaptureFormat(std::uint32_t samples) {
  protocol::CaptureFormat format;
  format.width = kWidth;
  format.height = kHeight;
  format.samples = samples;
  return format;
}

PlanRenderer makePlanRenderer(const ScriptTarget& target) {
  return [&target](const render::Camera& camera) -> std::optional<PlanPicture> {
    v1::FrameRequest request;
    *request.mutable_free() = toProto(camera);
    request.set_width(static_cast<std::uint32_t>(camera.width));
    request.set_height(static_cast<std::uint32_t>(camera.height));
    request.add_channels(v1::CHANNEL_RGB);
    request.add_channels(v1::CHANNEL_IDS);
    try {
      const protocol::ReceivedFrame frame = target.frame(request);
      const auto rgb = frame.plane(v1::CHANNEL_RGB), ids = frame.plane(v1::CHANNEL_IDS);
      PlanPicture plan{{camera.width, camera.height, {rgb.begin(), rgb.end()}}, {}};
      plan.ids.resize(ids.size() / sizeof(std::uint32_t));
      std::memcpy(plan.ids.data(), ids.data(), plan.ids.size() * sizeof(std::uint32_t));
      return plan;
    } catch (const protocol::ProtocolError& problem) {
      logWarning("no map: {}", problem.what());
      return std::nullopt;
    }
  };
}

void showProgress(Progress& bar, const protocol::StepOutcome& outcome,
                  const protocol::ScriptProgress& progress) {
  char text[96];
  std::snprintf(text, sizeof text, "line %u  tick %llu  %.1f s  %zu avatars", progress.line,
                static_cast<unsigned long long>(outcome.tick), outcome.time,
                outcome.avatars.size());
  const double lines = static_cast<double>(std::max<std::size_t>(progress.lines, 1));
  bar.show(static_cast<double>(progress.linesDone) / lines, text);
}

void printSummary(const RunReport& report, const RunSummary& runSummary,
                  const protocol::ScriptResult& result) {
  std::fprintf(stderr, "%s in %s (%u objects)\n", runSummary.script.c_str(),
               runSummary.scene.source().c_str(), runSummary.scene.objects());
  std::fprintf(stderr, "  %llu ticks = %.1f s simulated in %.1f s; median tick %.0f us\n",
               static_cast<unsigned long long>(result.ticks), result.time, runSummary.wallSeconds,
               runSummary.metrics.tick().median_us());
  std::fprintf(stderr, "  walks: %u arrived, %u blocked; orders refused: %u\n", result.arrived,
               result.blocked, result.refused);
  std::fprintf(stderr, "  contacts: %llu began in this world; worst penetration %g m\n",
               static_cast<unsigned long long>(runSummary.metrics.contacts()),
               runSummary.metrics.worst_penetration());
  if (const v1::Audit& audit = runSummary.metrics.audit(); audit.ticks() > 0) {
    std::fprintf(stderr,
                 "  audit: %llu ticks, %llu pairs by brute force, %llu missed, %llu extra\n",
                 static_cast<unsigned long long>(audit.ticks()),
                 static_cast<unsigned long long>(audit.pairs()),
                 static_cast<unsigned long long>(audit.missed()),
                 static_cast<unsigned long long>(audit.extra()));
  }
  std::fprintf(stderr, "  pictures: %u by %s\n", result.captured,
               runSummary.renderer.empty() ? "no renderer" : runSummary.renderer.c_str());
  for (const v1::Notice& notice : report.walks()) {
    // Only avatars that left without an order, for example by falling out of the scene.
    if (notice.kind() != v1::Notice::KIND_LEFT || notice.text().empty()) continue;
    std::fprintf(stderr, "  %s left: %s\n", notice.avatar().c_str(), notice.text().c_str());
  }
  for (const protocol::LineOutcome& outcome : result.outcomes) {
    std::fprintf(stderr, "  %s\n", outcome.text.c_str());
  }
  std::fprintf(stderr, "  written to %s/\n", report.folder().string().c_str());
}

ExitCode runAndReport(const protocol::Script& script, RunReport& report, bool strict,
                      ScriptTarget target) {
  const auto start = std::chrono::steady_clock::now();
  RunSummary runSummary{std::filesystem::path(script.source).filename().string(),
                        target.scene,
                        target.renderer,
                        {},
                        0,
                        0};
  report.removePreviousRun();
  Progress bar;
  const auto observe = [&](protocol::StepOutcome& outcome,
                           const protocol::ScriptProgress& progress) {
    if (isInterrupted()) throw Interrupted{};
    report.add(outcome);
    showProgress(bar, outcome, progress);
    if (outcome.tick % kTicksPerSample == 0) {
      runSummary.maxPairs = std::max(runSummary.maxPairs, target.metrics().pairs());
    }
  };
  const protocol::ScriptResult result = protocol::runScript(script, target.driver, observe);
  bar.clear();
  runSummary.metrics = target.metrics();
  runSummary.maxPairs = std::max(runSummary.maxPairs, runSummary.metrics.pairs());
  report.writePictures(runSummary, {makePlanRenderer(target), target.findFloorPlan});
  report.writeContacts(target.endContacts());
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  runSummary.wallSeconds = elapsed.count();
  const std::string summary = report.writeSummary(runSummary, result);
  writeToStdout(summary + "\n", "the summary is in " + report.folder().string() + "/summary.json");
  printSummary(report, runSummary, result);
  return computeExitCode(result, runSummary.metrics, strict);
}

constexpr const char* kAbortNote = "no more files are written";

/// Removes the run's avatars from the server's world in one more tick, which the report does not
/// count.
std::vector<v1::ContactEvent> leaveWorld(protocol::ScriptDriver& driver,
                                         const std::set<std::string>& avatars) {
  for (const std::string& avatar : avatars) {
    v1::Command leave;
    leave.set_avatar(avatar);
    leave.mutable_leave();
    driver.submit(leave);
  }
  return avatars.empty() ? std::vector<v1::ContactEvent>() : driver.step().contacts;
}

/// Restores the world after a recorded tick. Its avatars continue their orders.
scene::World restoreWorld(Playback& playback, std::uint64_t tick,
                          const std::shared_ptr<const scene::Scene>& scene) {
  Progress bar;
  try {
    return playback.restoreWorldAfter(tick, scene, [&](std::uint64_t ticksDone) {
      if (isInterrupted()) throw Interrupted{};
      bar.show(
          static_cast<double>(ticksDone) / static_cast<double>(std::max<std::uint64_t>(tick, 1)),
          "tick " + std::to_string(ticksDone) + " of the recording");
    });
  } catch (const Divergence& diverged) {
    throw protocol::mcap::RecordingError(playback.file().string() +
                                         ": it cannot be continued: " + formatDivergence(diverged));
  }
}

BranchPoint makeBranchPoint(const ReplayCommand& command, const scene::World& world) {
  BranchPoint branch;
  branch.parent.set_file(std::filesystem::absolute(command.recording).string());
  branch.parent.set_tick(command.from);
  branch.parent.set_run(command.run);
  branch.activeContacts =
      ContactHistory(command.recording, command.run, command.from).findActiveContactsAt(world);
  return branch;
}

}  // namespace

std::unique_ptr<render::RendererSelector> tryMakeRenderer(
    const std::shared_ptr<const scene::Scene>& scene, const DrawingOptions& drawing) {
  try {
    return std::make_unique<render::RendererSelector>(scene, drawing.renderer, drawing.device);
  } catch (const render::RenderError& error) {
    if (drawing.isRequested()) throw;
    logWarning("no pictures: {}", error.what());
    return nullptr;
  }
}

ExitCode computeExitCode(const protocol::ScriptResult& result, const v1::Metrics& metrics,
                         bool strict) {
  const bool auditClean = metrics.audit().missed() == 0 && metrics.audit().extra() == 0;
  const bool succeeded = !strict || result.outcomes.empty();
  return auditClean && succeeded ? ExitCode::success : ExitCode::violations;
}

ExitCode replay(const ReplayCommand& command) {
  return runInterruptible(
      [&] {
        const protocol::Script script = protocol::readScript(command.script);
        RunReport report(command.out);
        std::optional<Playback> playback;
        if (!command.recording.empty()) {
          requireDifferentFiles(command.record.file, command.recording);
          playback.emplace(command.recording, command.run);
        }
        const ModelOptions model =
            playback ? makeRecordedModelOptions(playback->start(), command.model.file,
                                                command.model.cache)
                     : command.model;
        const std::shared_ptr<const scene::Scene> scene = loadScene(model);
        if (isInterrupted()) throw Interrupted{};
        const std::unique_ptr<render::RendererSelector> renderer =
            tryMakeRenderer(scene, command.drawing);
        scene::World initialWorld = playback ? restoreWorld(*playback, command.from, scene)
                                             : scene::World(scene, command.settings);
        scene::setAuditInterval(initialWorld, command.auditEvery);
        RecordableWorld world(std::move(initialWorld));
        if (!command.record.file.empty()) {
          const auto branch =
              playback ? std::optional(makeBranchPoint(command, world)) : std::nullopt;
          world.record({command.record, model}, branch ? &*branch : nullptr);
        }
        InProcessDriver driver(world, renderer.get(), makeCaptureFormat(command.samples));
        ScriptTarget target{driver,
                            [&](const v1::FrameRequest& request) { return driver.frame(request); },
                            [&] { return driver.metrics(); },
                            [&] { return driver.endContacts(); },
                            toProto(*scene),
                            renderer ? renderer->deviceName() : std::string(),
                            makeFloorPlanSource(scene)};
        const ExitCode code = runAndReport(script, report, command.strict, std::move(target));
        const bool recordingComplete = !world.recorder() || !world.recorder()->close();
        return recordingComplete ? code : ExitCode::runtimeError;
      },
      kAbortNote);
}

/// The plan from the server; nullopt, with a warning, if it has none.
std::optional<FloorPlan> requestFloorPlan(protocol::Client& client, double floor) {
  try {
    return floorPlanFromProto(client.floorPlan(floor));
  } catch (const protocol::ProtocolError& problem) {
    logWarning("the map has no walls: {}", problem.what());
    return std::nullopt;
  }
}

ExitCode walk(const WalkCommand& command) {
  return runInterruptible(
      [&] {
        const protocol::Script script = protocol::readScript(command.script);
        RunReport report(command.out);
        protocol::ClientOptions options;
        options.name = "enfilade walk";
        options.world = command.world;
        options.token = command.token;
        protocol::Client client(command.connect.host, command.connect.port, options);
        protocol::SocketDriver driver(client, makeCaptureFormat(command.samples));
        ScriptTarget target{driver,
                            [&](const v1::FrameRequest& request) { return client.frame(request); },
                            [&] { return client.metrics(); },
                            [&] { return leaveWorld(driver, report.presentAvatars()); },
                            client.welcome().scene(),
                            client.welcome().renderer(),
                            [&](double floor) { return requestFloorPlan(client, floor); }};
        return runAndReport(script, report, command.strict, std::move(target));
      },
      kAbortNote);
}

}  // namespace enfilade::server
