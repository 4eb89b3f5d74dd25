// Plays one run of a recording from any tick.
#pragma once

#include <vector>

#include "protocol/recording/seekable_recording.hpp"
#include "server/recording/world_from_recording.hpp"

namespace enfilade::server {

class Playback {
 public:
  /// Throws protocol::mcap::RecordingError.
  explicit Playback(const std::filesystem::path& recording, std::uint32_t run = 1);

  const v1::RecordingStart& start() const { return recording_.start(); }
  const std::filesystem::path& file() const { return file_; }
  std::uint32_t run() const { return run_; }
  std::uint64_t firstTick() const { return recording_.firstTick(); }
  std::uint64_t lastTick() const { return recording_.lastTick(); }
  bool closed() const { return recording_.closed(); }

  /// Receives each tick that a long restore has computed.
  using ProgressHandler = std::function<void(std::uint64_t)>;
  /// Restores the world after `tick`, from the nearest checkpoint; applyCommands() continues there.
  /// Throws RecordingError if the recording lacks that tick, and Divergence.
  scene::World restoreWorldAfter(std::uint64_t tick, std::shared_ptr<const scene::Scene> scene,
                                 const ProgressHandler& onProgress = {});
  /// The tick from which restoreWorldAfter() started: a checkpoint's tick, or firstTick().
  std::uint64_t startTick() const { return startTick_; }

  /// applyCommands() continues with the tick after `tick`.
  void resume(std::uint64_t tick) { recording_.seek(tick); }
  /// Passes the recorded commands of tick `next` to `submit`. Returns false at the end of the
  /// recording. Throws Divergence if the world refuses a command. Throws RecordingError before the
  /// first command is passed.
  bool applyCommands(std::uint64_t next, const SubmitCommand& submit);
  /// Compares `world` with the recorded state of that tick; nullopt: equal.
  std::optional<protocol::StateDifference> verifyTick(const scene::World& world) const;
  /// Applies the commands, runs the tick and verifies it. Throws Divergence. Returns false at the
  /// end of the recording.
  bool step(scene::World& world);

 private:
  scene::World restoreNearest(std::uint64_t tick, const std::shared_ptr<const scene::Scene>& scene);
  bool readTick();

  std::filesystem::path file_;
  std::uint32_t run_;
  protocol::SeekableRecording recording_;
  std::uint64_t startTick_ = 0;
  std::vector<v1::RecordedCommands> commands_;  ///< of the current tick
  v1::State recordedState_;                     ///< after the current tick
};

}  // namespace enfilade::server
