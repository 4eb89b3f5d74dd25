#include "server/runs/script_run.hpp"

#include <spdlog/spdlog.h>

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
#include "server/messages/frame_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/recording/contact_history.hpp"
#include "server/recording/playback.hpp"
#include "server/runs/in_process_driver.hpp"
#include "server/runs/run_report.hpp"

namespace enfilade::server {

namespace {

constexpr std::uint32_t kWidth = 960, kHeight = 540;  // pixels of a capture
constexpr std::uint64_t kTicksPerSample = 16;         // of the broad phase's pairs

/// The world that a script runs in, as far as the report asks for it.
struct WalkedWorld {
  protocol::ScriptDriver& driver;
  std::function<protocol::ReceivedFrame(const v1::FrameRequest&)> frame;
  std::function<v1::Metrics()> metrics;
  /// Ends what contacts live after the walk, and tells how.
  std::function<std::vector<v1::ContactEvent>()> endContacts;
  v1::Scene scene;
  std::string renderer;
};

protocol::CaptureFormat captureFormat() {
  protocol::CaptureFormat format;
  format.width = kWidth;
  format.height = kHeight;
  return format;
}

TakePicture pictureOf(const WalkedWorld& world) {
  return [&world](const render::Camera& camera) -> std::optional<PlanPicture> {
    v1::FrameRequest request;
    *request.mutable_free() = messageOf(camera);
    request.set_width(static_cast<std::uint32_t>(camera.width));
    request.set_height(static_cast<std::uint32_t>(camera.height));
    request.add_channels(v1::CHANNEL_RGB);
    request.add_channels(v1::CHANNEL_IDS);
    try {
      const protocol::ReceivedFrame frame = world.frame(request);
      const auto rgb = frame.plane(v1::CHANNEL_RGB), ids = frame.plane(v1::CHANNEL_IDS);
      PlanPicture plan{{camera.width, camera.height, {rgb.begin(), rgb.end()}}, {}};
      plan.ids.resize(ids.size() / sizeof(std::uint32_t));
      std::memcpy(plan.ids.data(), ids.data(), plan.ids.size() * sizeof(std::uint32_t));
      return plan;
    } catch (const protocol::ProtocolError& problem) {
      spdlog::warn("no map: {}", problem.what());
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

void tellPerson(const WalkReport& report, const WalkFacts& facts,
                const protocol::ScriptResult& result) {
  std::fprintf(stderr, "%s in %s (%u objects)\n", facts.script.c_str(),
               facts.scene.source().c_str(), facts.scene.objects());
  std::fprintf(stderr, "  %llu ticks = %.1f s walked in %.1f s; a tick takes %.0f us (median)\n",
               static_cast<unsigned long long>(result.ticks), result.time, facts.wallSeconds,
               facts.metrics.tick().median_us());
  std::fprintf(stderr, "  walks: %u arrived, %u blocked; orders refused: %u\n", result.arrived,
               result.blocked, result.refused);
  std::fprintf(stderr, "  contacts: %llu begun in this world; worst penetration %g m\n",
               static_cast<unsigned long long>(facts.metrics.contacts()),
               facts.metrics.worst_penetration());
  if (const v1::Audit& audit = facts.metrics.audit(); audit.ticks() > 0) {
    std::fprintf(stderr,
                 "  audit: %llu ticks, %llu pairs by brute force, %llu missed, %llu extra\n",
                 static_cast<unsigned long long>(audit.ticks()),
                 static_cast<unsigned long long>(audit.pairs()),
                 static_cast<unsigned long long>(audit.missed()),
                 static_cast<unsigned long long>(audit.extra()));
  }
  std::fprintf(stderr, "  pictures: %u by %s\n", result.captured,
               facts.renderer.empty() ? "no renderer" : facts.renderer.c_str());
  for (const v1::Notice& notice : report.walks()) {
    // Nobody told it to leave, as when it fell out of the scene.
    if (notice.kind() != v1::Notice::KIND_LEFT || notice.text().empty()) continue;
    std::fprintf(stderr, "  %s left: %s\n", notice.avatar().c_str(), notice.text().c_str());
  }
  for (const protocol::LineOutcome& outcome : result.outcomes) {
    std::fprintf(stderr, "  %s\n", outcome.text.c_str());
  }
  std::fprintf(stderr, "  written to %s/\n", report.folder().string().c_str());
}

ExitCode run(const protocol::Script& script, WalkReport& report, bool strict, WalkedWorld world) {
  const auto start = std::chrono::steady_clock::now();
  WalkFacts facts{std::filesystem::path(script.source).filename().string(),
                  world.scene,
                  world.renderer,
                  {},
                  0,
                  0};
  report.removeEarlier();
  Progress bar;
  const auto observe = [&](protocol::StepOutcome& outcome,
                           const protocol::ScriptProgress& progress) {
    if (interrupted()) throw Interrupted{};
    report.add(outcome);
    showProgress(bar, outcome, progress);
    if (outcome.tick % kTicksPerSample == 0) {
      facts.mostPairs = std::max(facts.mostPairs, world.metrics().pairs());
    }
  };
  const protocol::ScriptResult result = protocol::runScript(script, world.driver, observe);
  bar.clear();
  facts.metrics = world.metrics();
  facts.mostPairs = std::max(facts.mostPairs, facts.metrics.pairs());
  report.writePictures(facts, {pictureOf(world)});
  report.writeContacts(world.endContacts());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  facts.wallSeconds = took.count();
  const std::string summary = report.writeSummary(facts, result);
  writeToStdout(summary + "\n",
                "the summary stands in " + report.folder().string() + "/summary.json");
  tellPerson(report, facts, result);
  return judge(result, facts.metrics, strict);
}

constexpr const char* kNoMore = "nothing more is written";

/// The server outlives the walk: those who still stand there leave in one tick more, which the
/// walk's report does not count.
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

/// The world after a recorded tick, whose avatars go on with what they were told.
scene::World recordedWorld(Playback& playback, std::uint64_t tick,
                           const std::shared_ptr<const scene::Scene>& scene) {
  Progress bar;
  try {
    return playback.worldAfter(tick, scene, [&](std::uint64_t made) {
      if (interrupted()) throw Interrupted{};
      bar.show(static_cast<double>(made) / static_cast<double>(std::max<std::uint64_t>(tick, 1)),
               "tick " + std::to_string(made) + " of the recording");
    });
  } catch (const Diverged& diverged) {
    throw protocol::mcap::RecordingError(playback.file().string() +
                                         ": it cannot be gone on with: " + textOf(diverged));
  }
}

BranchPoint branchOf(const ReplayCommand& command, const scene::World& world) {
  BranchPoint branch;
  branch.parent.set_file(std::filesystem::absolute(command.recording).string());
  branch.parent.set_tick(command.from);
  branch.parent.set_run(command.run);
  branch.living = ContactHistory(command.recording, command.run, command.from).livingIn(world);
  return branch;
}

}  // namespace

std::unique_ptr<render::Renderer> rendererOf(const std::shared_ptr<const scene::Scene>& scene,
                                             const DrawingOptions& drawing) {
  try {
    return std::make_unique<render::Renderer>(scene, drawing.renderer, drawing.device);
  } catch (const render::RenderError& error) {
    if (drawing.asked()) throw;
    spdlog::warn("no pictures: {}", error.what());
    return nullptr;
  }
}

ExitCode judge(const protocol::ScriptResult& result, const v1::Metrics& metrics, bool strict) {
  const bool right = metrics.audit().missed() == 0 && metrics.audit().extra() == 0;
  const bool asTold = !strict || result.outcomes.empty();
  return right && asTold ? ExitCode::done : ExitCode::violations;
}

ExitCode replay(const ReplayCommand& command) {
  return interruptible(
      [&] {
        const protocol::Script script = protocol::readScript(command.script);
        WalkReport report(command.out);
        std::optional<Playback> playback;
        if (!command.recording.empty()) {
          requireAnotherFile(command.record.file, command.recording);
          playback.emplace(command.recording, command.run);
        }
        const ModelOptions model =
            playback ? recordedModel(playback->start(), command.model.file, command.model.cache)
                     : command.model;
        const std::shared_ptr<const scene::Scene> scene = loadScene(model);
        if (interrupted()) throw Interrupted{};
        const std::unique_ptr<render::Renderer> renderer = rendererOf(scene, command.drawing);
        scene::World beginning = playback ? recordedWorld(*playback, command.from, scene)
                                          : scene::World(scene, command.lengths);
        scene::auditBroadPhase(beginning, command.auditEvery);
        RecordedWorld world(std::move(beginning));
        if (!command.record.file.empty()) {
          const auto branch = playback ? std::optional(branchOf(command, world)) : std::nullopt;
          world.record({command.record, model}, branch ? &*branch : nullptr);
        }
        InProcessDriver driver(world, renderer.get(), captureFormat());
        WalkedWorld walked{driver,
                           [&](const v1::FrameRequest& request) { return driver.frame(request); },
                           [&] { return driver.metrics(); },
                           [&] { return driver.endContacts(); },
                           messageOf(*scene),
                           renderer ? renderer->deviceName() : std::string()};
        const ExitCode code = run(script, report, command.strict, std::move(walked));
        const bool whole = !world.recorder() || !world.recorder()->close();
        return whole ? code : ExitCode::runtimeError;
      },
      kNoMore);
}

ExitCode walk(const WalkCommand& command) {
  return interruptible(
      [&] {
        const protocol::Script script = protocol::readScript(command.script);
        WalkReport report(command.out);
        protocol::ClientOptions options;
        options.name = "enfilade walk";
        protocol::Client client(command.connect.host, command.connect.port, options);
        protocol::SocketDriver driver(client, captureFormat());
        WalkedWorld walked{driver,
                           [&](const v1::FrameRequest& request) { return client.frame(request); },
                           [&] { return client.metrics(); },
                           [&] { return leaveWorld(driver, report.present()); },
                           client.welcome().scene(),
                           client.welcome().renderer()};
        return run(script, report, command.strict, std::move(walked));
      },
      kNoMore);
}

}  // namespace enfilade::server
