// A recording that clients play tick by tick, seek in, and leave for a branch.
#pragma once

#include "server/recording/contact_history.hpp"
#include "server/recording/playback.hpp"
#include "server/recording/recordable_world.hpp"

namespace enfilade::server {

class Replay {
 public:
  /// Reads all of the recording's run once, for its contacts. Throws
  /// protocol::mcap::RecordingError.
  Replay(const std::filesystem::path& recording, std::uint32_t run,
         std::shared_ptr<const scene::Scene> scene, std::uint32_t auditEvery);

  const std::filesystem::path& file() const { return playback_.file(); }
  std::uint64_t firstTick() const { return playback_.firstTick(); }
  std::uint64_t lastTick() const { return playback_.lastTick(); }

  /// The world after a recorded tick, with which it goes on: no longer branched. Throws Diverged,
  /// RecordingError, and what `tell` throws: then it stands as before.
  scene::World seek(std::uint64_t tick, const Playback::Tell& tell = {});
  /// As ContactHistory's, of a world that is not branched.
  v1::TickEvents livingIn(const scene::World& world) const { return contacts_.livingIn(world); }

  /// The next tick of `world`, which seek() gave: the recorded one, or, once it is branched, its
  /// own. nullopt: there is none; whyStopped() tells, and the world stands after the last that was
  /// as recorded. Throws RecordingError where it cannot be brought back there.
  std::optional<RecordedWorld::Ticked> tick(RecordedWorld& world);
  /// Nothing more is recorded.
  bool atEnd() const { return !branchedAt_ && at_ == lastTick(); }
  /// What is wrong with the next tick; empty: nothing.
  const std::string& whyStopped() const { return stopped_; }

  /// From now on the world goes its own way.
  void branch();
  std::optional<std::uint64_t> branchedAt() const {
    return branchedAt_;
  }  ///< the last recorded tick
  /// Where a branch left, for its recording.
  v1::RecordingParent parent() const;

 private:
  std::optional<RecordedWorld::Ticked> recordedTick(RecordedWorld& world);
  scene::World madeAgain();

  Playback playback_;
  ContactHistory contacts_;
  std::shared_ptr<const scene::Scene> scene_;
  std::uint32_t auditEvery_;  ///< ticks; 0: never
  std::uint64_t at_ = 0;      ///< the last recorded tick that was made
  std::optional<std::uint64_t> branchedAt_;
  std::string stopped_;
};

}  // namespace enfilade::server
