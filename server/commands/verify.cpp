#include "server/commands/verify.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/progress.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/recording/playback.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// A recording that is read from front to back: every byte of it.
class Replayed {
 public:
  explicit Replayed(const VerifyCommand& command)
      : command_(command), recording_(command.recording, command.run) {}

  /// Throws Diverged.
  void all() {
    while (const auto item = recording_.next()) {
      if (interrupted()) throw Interrupted{};
      std::visit([this](const auto& message) { take(message); }, *item);
    }
    if (!scene_)
      throw RecordingError(command_.recording.string() + ": no recording of Enfilade begins in it");
  }

  std::uint64_t ticks() const { return ticks_; }
  std::uint64_t hash() const { return world_ ? world_->snapshot()->stateHash : 0; }
  const protocol::RecordingReader& recording() const { return recording_; }

 private:
  void take(const v1::RecordingStart& start) {
    if (!scene_) scene_ = loadScene(recordedModel(start, command_.scene, command_.cache));
    world_.reset();
    if (!start.has_parent()) world_.emplace(worldAtStart(scene_, start));
  }
  /// A branch begins with one; all others must be what is made again.
  void take(const v1::RecordedCheckpoint& checkpoint) {
    if (!scene_) throw RecordingError("the recording does not begin with its scene");
    if (!world_) {
      world_.emplace(worldAt(scene_, checkpoint));
      return;
    }
    const std::uint32_t version = scene::checkpointVersion(bytesOf(checkpoint));
    if (version != scene::kCheckpointVersion) return;  // of another program; it is not read here
    const auto made = scene::checkpointOf(*world_);
    const auto recorded = bytesOf(checkpoint);
    if (!std::equal(made.begin(), made.end(), recorded.begin(), recorded.end()))
      throw Diverged{checkpoint.tick(),
                     {"the world", "checkpoint", std::to_string(recorded.size()) + " bytes",
                      std::to_string(made.size()) + " bytes"}};
  }
  void take(const v1::RecordedCommands& commands) { server::take(world(), commands); }
  void take(const v1::State& recorded) {
    scene::tick(world());
    ++ticks_;
    if (auto difference = differenceFrom(*world_, recorded))
      throw Diverged{world_->snapshot()->tick, *difference};
  }
  template <class Other>
  void take(const Other&) {}

  static std::span<const std::uint8_t> bytesOf(const v1::RecordedCheckpoint& checkpoint) {
    return {reinterpret_cast<const std::uint8_t*>(checkpoint.world().data()),
            checkpoint.world().size()};
  }
  scene::World& world() {
    if (!world_) throw RecordingError("the recording does not begin with its scene");
    return *world_;
  }

  const VerifyCommand& command_;
  protocol::RecordingReader recording_;
  std::shared_ptr<const scene::Scene> scene_;
  std::optional<scene::World> world_;
  std::uint64_t ticks_ = 0;
};

nlohmann::ordered_json verifyAll(const VerifyCommand& command) {
  Replayed replayed(command);
  replayed.all();
  const protocol::RecordingReader& recording = replayed.recording();
  nlohmann::ordered_json told{{"ticks", replayed.ticks()},
                              {"state_hash", protocol::hexadecimal(replayed.hash())},
                              {"closed", recording.closed()}};
  if (!recording.complete()) {
    told["whole_bytes"] = recording.wholeBytes();
    spdlog::warn("{}: it was cut off after byte {}; what comes before was verified",
                 command.recording.string(), recording.wholeBytes());
  }
  return told;
}

/// From a tick on; what was recorded before is not read.
nlohmann::ordered_json verifyFrom(const VerifyCommand& command, std::uint64_t from) {
  Playback playback(command.recording, command.run.value_or(1));
  const auto scene = loadScene(recordedModel(playback.start(), command.scene, command.cache));
  Progress bar;
  const auto tell = [&](std::uint64_t tick) {
    if (interrupted()) throw Interrupted{};
    bar.show(static_cast<double>(tick) / static_cast<double>(playback.lastTick()),
             "tick " + std::to_string(tick));
  };
  scene::World world = playback.worldAfter(from, scene, tell);
  while (playback.step(world)) tell(world.snapshot()->tick);
  bar.clear();
  return {{"from_tick", from},
          {"from_checkpoint", playback.beganAt()},
          {"ticks", world.snapshot()->tick - playback.beganAt()},
          {"state_hash", protocol::hexadecimal(world.snapshot()->stateHash)},
          {"closed", playback.closed()}};
}

ExitCode tell(const Diverged& diverged) {
  const protocol::StateDifference& what = diverged.difference;
  nlohmann::ordered_json told;
  told["diverged"] = {{"tick", diverged.tick},
                      {"who", what.who},
                      {"field", what.field},
                      {"recorded", what.recorded},
                      {"replayed", what.replayed}};
  std::fprintf(stderr, "enfilade: %s\n", textOf(diverged).c_str());
  if (what.who == kTheScene)
    std::fprintf(stderr,
                 "  what became of the walk in another model: replay SCENE RECORDING "
                 "--out DIR, without --verify\n");
  writeToStdout(told.dump() + "\n");
  return ExitCode::diverged;
}

ExitCode verified(const VerifyCommand& command) {
  try {
    const auto told = command.from ? verifyFrom(command, *command.from) : verifyAll(command);
    writeToStdout(told.dump() + "\n");
    return ExitCode::done;
  } catch (const Diverged& diverged) {
    return tell(diverged);
  }
}

}  // namespace

ExitCode verify(const VerifyCommand& command) {
  return interruptible([&] { return verified(command); }, "nothing was written");
}

}  // namespace enfilade::server
