// Writes down what a world is told and what becomes of it, so that it can be made again.
#pragma once

#include <optional>

#include "protocol/recording/recording.hpp"
#include "scene/world/world.hpp"
#include "server/recording/foxglove/viewer_channels.hpp"
#include "server/recording/recording_options.hpp"

namespace enfilade::server {

/// Where a branch leaves the recording that it comes of.
struct BranchPoint {
  v1::RecordingParent parent;
  v1::TickEvents living;  ///< what lives there, as it began
};

class WorldRecorder {
 public:
  /// Begins the file with the world as it is: before its first tick, or where a branch begins.
  /// Throws protocol::mcap::RecordingError.
  WorldRecorder(const RecordingOptions& options, const scene::World& world,
                const BranchPoint* branch = nullptr);

  /// What the world has taken for its next tick.
  void took(const v1::Command& command);
  void took(const v1::BodyCommand& command);
  /// A tick that was made, with what it told. A file that takes no more (the disk is full) ends the
  /// recording, which is logged; the world goes on.
  void ticked(const scene::World& world, const v1::TickEvents& events);

  /// A tick that could not be made: what `world` was told before it is written, and no more.
  void tickFailed(const scene::World& world);
  /// What was told without a tick: contacts that end with the world, or that a branch begins with.
  void told(const v1::TickEvents& events);
  /// The world is at its beginning again; what it was told since its last tick is void.
  void beganAnew(const scene::World& world);
  /// Sends to the file what waits for more; for when no tick will come soon.
  void flush();

  bool takesPictures() const { return picturesEvery_.has_value(); }
  /// Whether everyone's view of the last tick is due; asked once a tick.
  bool picturesDue(const scene::World& world);
  void picture(const std::string& avatar, const v1::Frame& description,
               const EncodedPicture& picture);

  std::uint64_t ticks() const { return ticks_; }
  std::uint64_t bytes() const { return file_.bytesWritten(); }
  bool broken() const { return broken_.has_value(); }
  /// Writes what is left. Why the recording is not whole; nullopt when it is.
  std::optional<std::string> close();

 private:
  void writeNames(const scene::Model& model);
  void writeCommands(std::uint64_t tick, double time);
  template <class Work>
  void unlessBroken(const Work& work);

  void writeCheckpoint(const scene::World& world);
  bool checkpointIsDue(const scene::World& world) const;

  /// The last checkpoint, or the beginning.
  struct Checkpointed {
    std::uint64_t tick = 0;
    std::uint64_t bytes = 0;  ///< of the file that it took
    std::uint64_t end = 0;    ///< of the file after it
  };

  protocol::RecordingWriter file_;
  Checkpointed last_;
  v1::RecordedCommands commands_;
  v1::State state_;  // kept, so that a tick allocates little
  ModelOptions model_;
  std::optional<ViewerChannels> viewers_;
  std::optional<double> picturesEvery_;  ///< seconds; 0: only those that are taken anyway
  double nextPictures_ = 0;              ///< seconds of the world's time
  std::uint64_t ticks_ = 0;
  std::uint64_t ticksBefore_ = 0;  ///< those of earlier runs
  std::optional<std::string> broken_;
};

/// The state of the last tick as a message: everyone, and the bodies that move or were moved.
void fill(v1::State& state, const scene::World& world);

/// The lengths in a message, and back; nullopt where a world cannot have them.
v1::Lengths exactMessageOf(const scene::Lengths& lengths);
std::optional<scene::Lengths> lengthsFrom(const v1::Lengths& message);

/// What the importer was asked for, and back; `file` is left to the caller.
v1::ModelChoices messageOf(const ModelOptions& model);
ModelOptions modelOptionsFrom(const v1::ModelChoices& message);

/// Throws protocol::mcap::RecordingError where `written` is the recording that is `read`: it would
/// be gone.
void requireAnotherFile(const std::filesystem::path& written, const std::filesystem::path& read);

}  // namespace enfilade::server
