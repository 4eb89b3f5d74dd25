// A recorded world that is made again, tick by tick, and compared with what was recorded.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "protocol/recording/recording.hpp"
#include "scene/world/world.hpp"
#include "server/app/command_line.hpp"

namespace enfilade::server {

/// StateDifference::who where it is the scene that is another one.
inline constexpr const char* kTheScene = "the scene";

/// Thrown at the first tick that ends otherwise than it was recorded.
struct Diverged {
  std::uint64_t tick = 0;
  protocol::StateDifference difference;
};

/// How the recorded scene is loaded; `scene`: in the place of the file that the recording names, if
/// it is not empty. Throws protocol::mcap::RecordingError when there is no such file.
ModelOptions recordedModel(const v1::RecordingStart& start, const std::filesystem::path& scene,
                           bool cache);

/// The world before its first tick. Throws Diverged where the scene or the lengths make another
/// one, RecordingError where no world can be so. Not for the start of a branch.
scene::World worldAtStart(std::shared_ptr<const scene::Scene> scene,
                          const v1::RecordingStart& start);
/// The world of a checkpoint. Throws scene::CheckpointError, or Diverged where it is not of the
/// recorded tick and hash.
scene::World worldAt(std::shared_ptr<const scene::Scene> scene,
                     const v1::RecordedCheckpoint& checkpoint);

/// Hands a recorded command to a world; why that does not take it.
using Submit = std::function<std::optional<v1::Error>(const v1::RecordedCommands::One&)>;

/// Gives `submit` what the world was told before tick `next`. Throws Diverged where it is refused.
void take(std::uint64_t next, const v1::RecordedCommands& commands, const Submit& submit);
/// The same for the next tick of `world`.
void take(scene::World& world, const v1::RecordedCommands& commands);

/// How the last tick's state differs from the recorded one; nullopt: not.
std::optional<protocol::StateDifference> differenceFrom(const scene::World& world,
                                                        const v1::State& recorded);

/// For people: "tick 17: ann: feet.x: recorded 1, replayed 2".
std::string textOf(const Diverged& diverged);

}  // namespace enfilade::server
