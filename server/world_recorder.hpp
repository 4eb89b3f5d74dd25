// Writes down what a world is told and what becomes of it, so that it can be made again.
#pragma once

#include <optional>

#include "protocol/recording.hpp"
#include "scene/world.hpp"
#include "server/command_line.hpp"

namespace enfilade::server {

class WorldRecorder {
 public:
  /// Begins `file` with the world as it is before its first tick. Throws protocol::mcap::
  /// RecordingError.
  WorldRecorder(const std::filesystem::path& file, const scene::World& world,
                const ModelOptions& model);

  /// What the world has taken for its next tick.
  void took(const v1::Command& command);
  void took(const v1::BodyCommand& command);
  /// A tick that was made, with what it told. A file that takes no more (the disk is full) ends the
  /// recording, which is logged; the world goes on.
  void ticked(const scene::World& world, const v1::TickEvents& events);

  /// Writes what is left. Why the recording is not whole; nullopt when it is.
  std::optional<std::string> close();

 private:
  void writeNames(const scene::Model& model);
  template <class Work>
  void unlessBroken(const Work& work);

  protocol::RecordingWriter file_;
  v1::RecordedCommands commands_;
  v1::State state_;  // kept, so that a tick allocates little
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

}  // namespace enfilade::server
