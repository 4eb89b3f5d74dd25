#include "server/recording/playback.hpp"

#include <spdlog/spdlog.h>

#include "scene/world/checkpoint/checkpoint.hpp"

namespace enfilade::server {

using protocol::mcap::RecordingError;

Playback::Playback(const std::filesystem::path& recording, std::uint32_t run)
    : file_(recording), run_(run), recording_(recording, run), beganAt_(recording_.firstTick()) {
  if (recording_.runs() > 1)
    spdlog::info("{}: of the {} runs in it run {} is played", recording.string(), recording_.runs(),
                 run);
}

/// From the nearest checkpoint that can be read; else from the beginning.
scene::World Playback::nearestWorld(std::uint64_t tick,
                                    const std::shared_ptr<const scene::Scene>& scene) {
  const auto checkpoint = recording_.checkpointBefore(tick);
  if (!checkpoint) {
    if (firstTick() > 0)
      throw RecordingError(file_.string() +
                           ": a branch without the checkpoint that it begins with");
    return worldAtStart(scene, start());
  }
  try {
    beganAt_ = checkpoint->tick();
    return worldAt(scene, *checkpoint);
  } catch (const scene::CheckpointError& error) {
    if (scene->hash() != start().scene().hash() || firstTick() > 0)
      throw RecordingError(file_.string() + ": " + error.what());
    spdlog::warn("{}: {}; it is played from its beginning", file_.string(), error.what());
    beganAt_ = firstTick();
    return worldAtStart(scene, start());
  }
}

scene::World Playback::worldAfter(std::uint64_t tick, std::shared_ptr<const scene::Scene> scene,
                                  const Tell& tell) {
  if (tick < firstTick() || tick > lastTick())
    throw RecordingError(file_.string() + ": tick " + std::to_string(tick) +
                         " is not in it; give one from " + std::to_string(firstTick()) + " to " +
                         std::to_string(lastTick()) +
                         (recording_.runs() > 1 ? ", or another run than " + std::to_string(run_) +
                                                      " of " + std::to_string(recording_.runs())
                                                : ""));
  beganAt_ = firstTick();
  scene::World world = nearestWorld(tick, scene);
  recording_.seek(beganAt_);
  while (world.snapshot()->tick < tick) {
    if (!step(world))
      throw RecordingError(file_.string() + ": it ends before tick " + std::to_string(tick));
    if (tell) tell(world.snapshot()->tick);
  }
  return world;
}

bool Playback::readTick() {
  commands_.clear();
  while (auto item = recording_.next()) {
    if (auto* commands = std::get_if<v1::RecordedCommands>(&*item))
      commands_.push_back(std::move(*commands));
    if (auto* state = std::get_if<v1::State>(&*item)) {
      recorded_ = std::move(*state);
      return true;
    }
  }
  return false;
}

bool Playback::feed(std::uint64_t next, const Submit& submit) {
  if (!readTick()) return false;
  for (const v1::RecordedCommands& commands : commands_) take(next, commands, submit);
  return true;
}

std::optional<protocol::StateDifference> Playback::judge(const scene::World& world) const {
  return differenceFrom(world, recorded_);
}

bool Playback::step(scene::World& world) {
  if (!readTick()) return false;
  for (const v1::RecordedCommands& commands : commands_) take(world, commands);
  scene::tick(world);
  if (auto difference = judge(world)) throw Diverged{world.snapshot()->tick, *difference};
  return true;
}

}  // namespace enfilade::server
