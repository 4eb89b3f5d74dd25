// A recording that clients replay tick by tick, with seeking and branching. Each tick is verified.
#pragma once

#include "server/recording/contact_history.hpp"
#include "server/recording/playback.hpp"
#include "server/recording/recordable_world.hpp"

namespace enfilade::server {

class Replay {
 public:
  /// Reads the whole run once to collect its contacts. Throws protocol::mcap::RecordingError.
  Replay(const std::filesystem::path& recording, std::uint32_t run,
         std::shared_ptr<const scene::Scene> scene, std::uint32_t auditEvery);

  const std::filesystem::path& file() const { return playback_.file(); }
  std::uint64_t firstTick() const { return playback_.firstTick(); }
  std::uint64_t lastTick() const { return playback_.lastTick(); }

  /// Returns the world after a recorded tick and continues there, unbranched. Throws Divergence,
  /// RecordingError, and exceptions of `onProgress`; the replay is unchanged then.
  scene::World seek(std::uint64_t tick, const Playback::ProgressHandler& onProgress = {});
  /// Like ContactHistory::findActiveContactsAt(). `world` must not be branched.
  v1::TickEvents findActiveContactsAt(const scene::World& world) const {
    return contacts_.findActiveContactsAt(world);
  }

  /// As ContactHistory::findEventsAfter().
  v1::RecordedEvents findEventsAfter(std::uint64_t tick, std::size_t maxBytes) const {
    return contacts_.findEventsAfter(tick, maxBytes);
  }

  /// Runs the next tick of `world`, which seek() returned: the recorded tick, or a free one after
  /// branch(). nullopt: the replay has stopped (stopReason()), and the world is after the last tick
  /// that matched. Throws RecordingError if that world cannot be restored.
  std::optional<RecordableWorld::TickResult> tick(RecordableWorld& world);
  /// Whether the last recorded tick was replayed.
  bool atEnd() const { return !branchTick_ && tick_ == lastTick(); }
  /// The error in the next tick; empty: no error.
  const std::string& stopReason() const { return stopReason_; }

  /// Leaves the recording: later ticks are free.
  void branch();
  /// The last recorded tick before the branch; nullopt: not branched.
  std::optional<std::uint64_t> branchTick() const { return branchTick_; }
  /// The branch point, for the recording of the branch.
  v1::RecordingParent parent() const;

 private:
  std::optional<RecordableWorld::TickResult> replayTick(RecordableWorld& world);
  scene::World restoreWorld();

  Playback playback_;
  ContactHistory contacts_;
  std::shared_ptr<const scene::Scene> scene_;
  std::uint32_t auditEvery_;  ///< ticks; 0: never
  std::uint64_t tick_ = 0;    ///< the last recorded tick that was replayed
  std::optional<std::uint64_t> branchTick_;
  std::string stopReason_;
};

}  // namespace enfilade::server
