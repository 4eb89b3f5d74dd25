// A world behind the one door through which it is told anything: whatever passes is written down if
// the world is recorded, so that nothing can reach it that its recording does not tell.
#pragma once

#include <memory>

#include "server/recording/world_recorder.hpp"

namespace enfilade::server {

class RecordedWorld {
 public:
  explicit RecordedWorld(scene::World world);

  /// From now on all is written down: from before the first command and tick, or, of a `branch`,
  /// from where it leaves another recording. Throws protocol::mcap::RecordingError.
  void record(const RecordingOptions& options, const BranchPoint* branch = nullptr);

  /// To look at; who tells the world something uses the functions below.
  operator const scene::World&() const { return world_; }
  const scene::Scene& scene() const { return world_.scene(); }
  const scene::Lengths& lengths() const { return world_.lengths(); }
  std::shared_ptr<const scene::Snapshot> snapshot() const { return world_.snapshot(); }

  /// Hands an order to the next tick, or says why it cannot be taken.
  std::optional<v1::Error> submit(const v1::Command& command);
  std::optional<v1::Error> submit(const v1::BodyCommand& command);

  struct Ticked {
    scene::TickReport report;
    v1::TickEvents events;  ///< the report's contacts and notices
  };
  Ticked tick();

  /// Ends all contacts, which is told for `reason`, and everyone leaves, if `left` says why. The
  /// world is not ticked after this.
  v1::TickEvents end(v1::ContactEvent::Reason reason, const std::string& left = {});
  /// Another world in its place: the same scene at its beginning.
  void beginAnew(scene::World world);
  /// Another world of the same scene in its place, which is not recorded: a recording ends here.
  void goOnWith(scene::World world);

  /// Null when it is not recorded.
  WorldRecorder* recorder() { return recorder_.get(); }
  const WorldRecorder* recorder() const { return recorder_.get(); }
  /// Whether what was to be recorded is, so far.
  bool recordedAll() const { return !broke_ && !(recorder_ && recorder_->broken()); }

 private:
  scene::TickReport tickOrKeepCommands();

  scene::World world_;
  std::unique_ptr<WorldRecorder> recorder_;
  bool broke_ = false;  ///< a recording that ended is not whole
};

}  // namespace enfilade::server
