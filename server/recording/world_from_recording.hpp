// Restores worlds from recordings, applies recorded commands, and compares states.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "protocol/recording/recording.hpp"
#include "scene/world/world.hpp"
#include "server/base/load_scene.hpp"

namespace enfilade::server {

/// StateDifference::entity if the scene differs.
inline constexpr const char* kSceneSubject = "the scene";

/// Thrown at the first tick whose state differs from the recording.
struct Divergence {
  std::uint64_t tick = 0;
  protocol::StateDifference difference;
};

/// The options to load the recorded scene. `scene`, if not empty, replaces the file that the
/// recording names. Throws protocol::mcap::RecordingError if the file does not exist.
ModelOptions makeRecordedModelOptions(const v1::RecordingStart& start,
                                      const std::filesystem::path& scene, bool cache);

/// The world before its first tick. Throws Divergence if the scene or the settings give another
/// state, RecordingError if the settings are invalid. Not for the start of a branch.
scene::World makeWorldAtStart(std::shared_ptr<const scene::Scene> scene,
                              const v1::RecordingStart& start);
/// The world of a checkpoint. Throws scene::CheckpointError; throws Divergence if tick or hash
/// differ from the recorded ones.
scene::World makeWorldFromCheckpoint(std::shared_ptr<const scene::Scene> scene,
                                     const v1::RecordedCheckpoint& checkpoint);

/// Submits a recorded command to a world and returns its refusal; nullopt: accepted.
using SubmitCommand = std::function<std::optional<v1::Error>(const v1::RecordedCommands::One&)>;

/// Passes the commands of tick `next` to `submit`. Throws Divergence if one is refused.
void submitRecordedCommands(std::uint64_t next, const v1::RecordedCommands& commands,
                            const SubmitCommand& submit);
/// Submits the commands to `world` for its next tick. Throws Divergence if one is refused.
void applyRecordedCommands(scene::World& world, const v1::RecordedCommands& commands);

/// Compares the last tick's state with the recorded one; nullopt: equal.
std::optional<protocol::StateDifference> compareState(const scene::World& world,
                                                      const v1::State& recorded);

/// Readable text: "tick 17: ann: feet.x: recorded 1, replayed 2".
std::string formatDivergence(const Divergence& divergence);

}  // namespace enfilade::server
