// A run of a recording, played from any tick on.
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

  /// Told now and then on a long way: the tick that was made.
  using Tell = std::function<void(std::uint64_t)>;
  /// The world after `tick`, made from the nearest checkpoint; feed() goes on from there. Throws
  /// RecordingError where the recording does not have that tick, and Diverged.
  scene::World worldAfter(std::uint64_t tick, std::shared_ptr<const scene::Scene> scene,
                          const Tell& tell = {});
  /// What worldAfter() began with: the tick of a checkpoint, or firstTick().
  std::uint64_t beganAt() const { return beganAt_; }

  /// feed() goes on with what was recorded after `tick`.
  void resume(std::uint64_t tick) { recording_.seek(tick); }
  /// Gives `submit` what the world was told before tick `next`; false, and nothing is given, at the
  /// recording's end. Throws Diverged where the world does not take it; RecordingError before
  /// anything is given.
  bool feed(std::uint64_t next, const Submit& submit);
  /// After that tick: how it differs from the recorded one; nullopt: not.
  std::optional<protocol::StateDifference> judge(const scene::World& world) const;
  /// feed(), the tick, judge(); throws Diverged. False at the end.
  bool step(scene::World& world);

 private:
  scene::World nearestWorld(std::uint64_t tick, const std::shared_ptr<const scene::Scene>& scene);
  bool readTick();

  std::filesystem::path file_;
  std::uint32_t run_;
  protocol::SeekableRecording recording_;
  std::uint64_t beganAt_ = 0;
  std::vector<v1::RecordedCommands> commands_;  ///< before the tick that is fed
  v1::State recorded_;                          ///< after it
};

}  // namespace enfilade::server
