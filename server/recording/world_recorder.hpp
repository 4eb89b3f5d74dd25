// Records the commands, events and states of a world, so that it can be replayed.
#pragma once

#include <optional>

#include "protocol/recording/recording.hpp"
#include "scene/world/world.hpp"
#include "server/recording/foxglove/viewer_channels.hpp"
#include "server/recording/recording_options.hpp"

namespace enfilade::server {

/// The point at which a branch leaves its parent recording.
struct BranchPoint {
  v1::RecordingParent parent;
  v1::TickEvents activeContacts;  ///< as begin and enter events
};

class WorldRecorder {
 public:
  /// Starts the file with the current state of `world`: before its first tick, or at a branch
  /// point. Throws protocol::mcap::RecordingError.
  WorldRecorder(const RecordingOptions& options, const scene::World& world,
                const BranchPoint* branch = nullptr);

  /// Records a command that the world accepted for its next tick.
  void onCommand(const v1::Command& command);
  void onBodyCommand(const v1::BodyCommand& command);
  /// Records a completed tick and its events. A write error (a full disk) is logged and ends the
  /// recording; the world continues.
  void onTick(const scene::World& world, const v1::TickEvents& events);

  /// Records only the commands of a tick that threw.
  void onTickFailed(const scene::World& world);
  /// Records events without a tick: contacts that end with the world, or that are active at the
  /// start of a branch.
  void onEvents(const v1::TickEvents& events);
  /// Starts a new run after a reset of the world. Commands since the last tick are discarded.
  void onReset(const scene::World& world);
  /// Starts a new run with a checkpoint, after the world was replaced by an earlier state or one of
  /// another server. Commands since the last tick are discarded.
  void onRestore(const scene::World& world, const v1::TickEvents& activeContacts);
  /// Writes buffered data to the file. Call it when no tick is expected soon.
  void flush();

  bool recordsImages() const { return imagePeriod_.has_value(); }
  /// Whether images of all avatars' views are due. Call it once per tick: it advances the schedule.
  bool areImagesDue(const scene::World& world);
  void writeImage(const std::string& avatar, const v1::Frame& description,
                  const EncodedImage& image);

  std::uint64_t ticks() const { return ticks_; }
  std::uint64_t bytes() const { return file_.bytesWritten(); }
  bool isBroken() const { return error_.has_value(); }
  /// Closes the file. Returns why the recording is incomplete; nullopt: complete.
  std::optional<std::string> close();

 private:
  void writeNames(const scene::Model& model);
  void writeCommands(std::uint64_t tick, double time);
  template <class Work>
  void writeUnlessBroken(const Work& work);

  void writeCheckpoint(const scene::World& world);
  bool isCheckpointDue(const scene::World& world) const;

  /// The last checkpoint, or the start of the run.
  struct LastCheckpoint {
    std::uint64_t tick = 0;
    std::uint64_t bytes = 0;  ///< size of the checkpoint in the file
    std::uint64_t end = 0;    ///< file size after the checkpoint
  };

  protocol::RecordingWriter file_;
  LastCheckpoint lastCheckpoint_;
  v1::RecordedCommands commands_;
  v1::State state_;  // reused, to avoid allocations per tick
  ModelOptions model_;
  std::optional<ViewerChannels> viewerChannels_;
  std::optional<double> imagePeriod_;  ///< seconds; 0: only images that clients request
  double nextImageTime_ = 0;           ///< seconds of simulated time
  std::uint64_t ticks_ = 0;
  std::uint64_t previousTicks_ = 0;  ///< of earlier runs
  std::optional<std::string> error_;
};

/// Fills in the state of the last tick: all avatars, and the bodies that move or are displaced.
void fillState(v1::State& state, const scene::World& world);

/// Converts world settings exactly, and back; nullopt: invalid settings.
v1::Lengths toRecordedProto(const scene::WorldSettings& settings);
std::optional<scene::WorldSettings> settingsFromProto(const v1::Lengths& message);

/// Converts import options, and back; the caller sets `file`.
v1::ModelChoices toProto(const ModelOptions& model);
ModelOptions modelOptionsFromProto(const v1::ModelChoices& message);

/// Throws protocol::mcap::RecordingError if both are the same file: writing would destroy it.
void requireDifferentFiles(const std::filesystem::path& written, const std::filesystem::path& read);

}  // namespace enfilade::server
