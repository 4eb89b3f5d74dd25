#include "server/recording/playback.hpp"

#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {

using protocol::mcap::RecordingError;

Playback::Playback(const std::filesystem::path& recording, std::uint32_t run)
    : file_(recording), run_(run), recording_(recording, run), startTick_(recording_.firstTick()) {
  if (recording_.runs() > 1)
    logInfo("{}: the file has {} runs; playing run {}", recording.string(), recording_.runs(), run);
}

/// Restores the last checkpoint before `tick`; if it is unreadable, the start of the recording.
scene::World Playback::restoreNearest(std::uint64_t tick,
                                      const std::shared_ptr<const scene::Scene>& scene) {
  const auto checkpoint = recording_.checkpointBefore(tick);
  if (!checkpoint) {
    if (firstTick() > 0)
      throw RecordingError(file_.string() + ": the branch lacks its initial checkpoint");
    return makeWorldAtStart(scene, start());
  }
  try {
    startTick_ = checkpoint->tick();
    return makeWorldFromCheckpoint(scene, *checkpoint);
  } catch (const scene::CheckpointError& error) {
    if (scene->hash() != start().scene().hash() || firstTick() > 0)
      throw RecordingError(file_.string() + ": " + error.what());
    logWarning("{}: {}; playing from the beginning instead", file_.string(), error.what());
    startTick_ = firstTick();
    return makeWorldAtStart(scene, start());
  }
}

scene::World Playback::restoreWorldAfter(std::uint64_t tick,
                                         std::shared_ptr<const scene::Scene> scene,
                                         const ProgressHandler& onProgress) {
  if (tick < firstTick() || tick > lastTick())
    throw RecordingError(file_.string() + ": tick " + std::to_string(tick) +
                         " is not in it; give one from " + std::to_string(firstTick()) + " to " +
                         std::to_string(lastTick()) +
                         (recording_.runs() > 1 ? ", or another run than " + std::to_string(run_) +
                                                      " of " + std::to_string(recording_.runs())
                                                : ""));
  startTick_ = firstTick();
  scene::World world = restoreNearest(tick, scene);
  recording_.seek(startTick_);
  while (world.snapshot()->tick < tick) {
    if (!step(world))
      throw RecordingError(file_.string() + ": it ends before tick " + std::to_string(tick));
    if (onProgress) onProgress(world.snapshot()->tick);
  }
  return world;
}

bool Playback::readTick() {
  commands_.clear();
  while (auto item = recording_.next()) {
    if (auto* commands = std::get_if<v1::RecordedCommands>(&*item))
      commands_.push_back(std::move(*commands));
    if (auto* state = std::get_if<v1::State>(&*item)) {
      recordedState_ = std::move(*state);
      return true;
    }
  }
  return false;
}

bool Playback::applyCommands(std::uint64_t next, const SubmitCommand& submit) {
  if (!readTick()) return false;
  for (const v1::RecordedCommands& commands : commands_)
    submitRecordedCommands(next, commands, submit);
  return true;
}

std::optional<protocol::StateDifference> Playback::verifyTick(const scene::World& world) const {
  return compareState(world, recordedState_);
}

bool Playback::step(scene::World& world) {
  if (!readTick()) return false;
  for (const v1::RecordedCommands& commands : commands_) applyRecordedCommands(world, commands);
  scene::tickWorld(world);
  if (auto difference = verifyTick(world)) throw Divergence{world.snapshot()->tick, *difference};
  return true;
}

}  // namespace enfilade::server
