// A world with a single entry point for all commands. If the world is recorded, every command that
// reaches it is in the recording.
#pragma once

#include <memory>

#include "server/recording/world_recorder.hpp"

namespace enfilade::server {

/// A scene::World with an optional recorder.
class RecordableWorld {
 public:
  explicit RecordableWorld(scene::World world);

  /// Starts recording. Call it before the first command and tick, or, with `branch`, where the
  /// world leaves another recording. Throws protocol::mcap::RecordingError.
  void record(const RecordingOptions& options, const BranchPoint* branch = nullptr);

  /// Read access; changes go through the functions below.
  operator const scene::World&() const { return world_; }
  const scene::Scene& scene() const { return world_.scene(); }
  const scene::WorldSettings& settings() const { return world_.settings(); }
  std::shared_ptr<const scene::Snapshot> snapshot() const { return world_.snapshot(); }

  /// Submits a command for the next tick. Returns the refusal; nullopt: accepted.
  std::optional<v1::Error> submit(const v1::Command& command);
  std::optional<v1::Error> submit(const v1::BodyCommand& command);

  struct TickResult {
    scene::TickReport report;
    v1::TickEvents events;  ///< the report's contacts and notices
  };
  TickResult tick();

  /// Ends all contacts with `reason`. If `leaveReason` is not empty, all avatars leave for that
  /// reason. Returns these events. Do not tick the world afterwards.
  v1::TickEvents endContacts(v1::ContactEvent::Reason reason, const std::string& leaveReason = {});
  /// Replaces the world by one at tick 0 of the same scene; the recording continues with a new run.
  void reset(scene::World world);
  /// Replaces the world by another one of the same scene; the recording continues with a new run,
  /// which begins with a checkpoint. `activeContacts`: as begin and enter events.
  void restore(scene::World world, const v1::TickEvents& activeContacts);
  /// Replaces the world by another one of the same scene and ends the recording.
  void switchTo(scene::World world);

  /// Null if the world is not recorded.
  WorldRecorder* recorder() { return recorder_.get(); }
  const WorldRecorder* recorder() const { return recorder_.get(); }
  /// Whether no recording has failed so far.
  bool isRecordingComplete() const {
    return !recordingFailed_ && !(recorder_ && recorder_->isBroken());
  }

 private:
  scene::TickReport tickOrSaveCommands();

  scene::World world_;
  std::unique_ptr<WorldRecorder> recorder_;
  bool recordingFailed_ = false;  ///< an earlier recording is incomplete
};

}  // namespace enfilade::server
