#include "server/commands/verify.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/progress.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/log/log.hpp"
#include "server/recording/playback.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// Re-runs a recording, reads all of it, and compares the state after every tick.
class RecordingVerifier {
 public:
  explicit RecordingVerifier(const VerifyCommand& command)
      : command_(command), recording_(command.recording, command.run) {}

  /// Throws Divergence.
  void verifyRuns() {
    while (const auto item = recording_.next()) {
      if (isInterrupted()) throw Interrupted{};
      std::visit([this](const auto& message) { apply(message); }, *item);
    }
    if (!scene_)
      throw RecordingError(command_.recording.string() + ": not a recording of Enfilade");
  }

  std::uint64_t ticks() const { return ticks_; }
  std::uint64_t hash() const { return world_ ? world_->snapshot()->stateHash : 0; }
  const protocol::RecordingReader& recording() const { return recording_; }

 private:
  void apply(const v1::RecordingStart& start) {
    if (!scene_)
      scene_ = loadScene(makeRecordedModelOptions(start, command_.scene, command_.cache));
    world_.reset();
    if (!start.has_parent()) world_.emplace(makeWorldAtStart(scene_, start));
  }
  /// A branch starts from its first checkpoint. All others must match the replay.
  void apply(const v1::RecordedCheckpoint& checkpoint) {
    if (!scene_) throw RecordingError("the recording does not start with its scene");
    if (!world_) {
      world_.emplace(makeWorldFromCheckpoint(scene_, checkpoint));
      return;
    }
    const std::uint32_t version = scene::readCheckpointVersion(getCheckpointBytes(checkpoint));
    if (version != scene::kCheckpointVersion) return;  // other version: not comparable
    const auto actual = scene::makeCheckpoint(*world_);
    const auto recorded = getCheckpointBytes(checkpoint);
    if (!std::equal(actual.begin(), actual.end(), recorded.begin(), recorded.end()))
      throw Divergence{checkpoint.tick(),
                       {"the world", "checkpoint", std::to_string(recorded.size()) + " bytes",
                        std::to_string(actual.size()) + " bytes"}};
  }
  void apply(const v1::RecordedCommands& commands) {
    server::applyRecordedCommands(world(), commands);
  }
  void apply(const v1::State& recorded) {
    scene::tickWorld(world());
    ++ticks_;
    if (auto difference = compareState(*world_, recorded))
      throw Divergence{world_->snapshot()->tick, *difference};
  }
  template <class Other>
  void apply(const Other&) {}

  static std::span<const std::uint8_t> getCheckpointBytes(
      const v1::RecordedCheckpoint& checkpoint) {
    return {reinterpret_cast<const std::uint8_t*>(checkpoint.world().data()),
            checkpoint.world().size()};
  }
  scene::World& world() {
    if (!world_) throw RecordingError("the recording does not start with its scene");
    return *world_;
  }

  const VerifyCommand& command_;
  protocol::RecordingReader recording_;
  std::shared_ptr<const scene::Scene> scene_;
  std::optional<scene::World> world_;
  std::uint64_t ticks_ = 0;
};

nlohmann::ordered_json verifyAll(const VerifyCommand& command) {
  RecordingVerifier verifier(command);
  verifier.verifyRuns();
  const protocol::RecordingReader& recording = verifier.recording();
  nlohmann::ordered_json report{{"ticks", verifier.ticks()},
                                {"state_hash", protocol::toHex(verifier.hash())},
                                {"closed", recording.closed()}};
  if (!recording.complete()) {
    report["whole_bytes"] = recording.wholeBytes();
    logWarning("{}: truncated after byte {}; the data before that was verified",
               command.recording.string(), recording.wholeBytes());
  }
  return report;
}

/// Verifies from a tick onwards. Earlier data is not read.
nlohmann::ordered_json verifyFromTick(const VerifyCommand& command, std::uint64_t from) {
  Playback playback(command.recording, command.run.value_or(1));
  const auto scene =
      loadScene(makeRecordedModelOptions(playback.start(), command.scene, command.cache));
  Progress bar;
  const auto showProgress = [&](std::uint64_t tick) {
    if (isInterrupted()) throw Interrupted{};
    bar.show(static_cast<double>(tick) / static_cast<double>(playback.lastTick()),
             "tick " + std::to_string(tick));
  };
  scene::World world = playback.restoreWorldAfter(from, scene, showProgress);
  while (playback.step(world)) showProgress(world.snapshot()->tick);
  bar.clear();
  return {{"from_tick", from},
          {"from_checkpoint", playback.startTick()},
          {"ticks", world.snapshot()->tick - playback.startTick()},
          {"state_hash", protocol::toHex(world.snapshot()->stateHash)},
          {"closed", playback.closed()}};
}

ExitCode reportDivergence(const Divergence& diverged) {
  const protocol::StateDifference& difference = diverged.difference;
  nlohmann::ordered_json report;
  report["diverged"] = {{"tick", diverged.tick},
                        {"who", difference.entity},
                        {"field", difference.field},
                        {"recorded", difference.recorded},
                        {"replayed", difference.replayed}};
  std::fprintf(stderr, "enfilade: %s\n", formatDivergence(diverged).c_str());
  if (difference.entity == kSceneSubject)
    std::fprintf(stderr,
                 "  to run the walk in another model: replay SCENE RECORDING "
                 "--out DIR, without --verify\n");
  writeToStdout(report.dump() + "\n");
  return ExitCode::diverged;
}

ExitCode runVerification(const VerifyCommand& command) {
  try {
    const auto report = command.from ? verifyFromTick(command, *command.from) : verifyAll(command);
    writeToStdout(report.dump() + "\n");
    return ExitCode::success;
  } catch (const Divergence& diverged) {
    return reportDivergence(diverged);
  }
}

}  // namespace

ExitCode verify(const VerifyCommand& command) {
  return runInterruptible([&] { return runVerification(command); }, "no file was written");
}

}  // namespace enfilade::server
