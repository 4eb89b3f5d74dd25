#include "server/recording/replay_check.hpp"

namespace enfilade::server {

using protocol::mcap::RecordingError;

Replay::Replay(const std::filesystem::path& recording, std::uint32_t run,
               std::shared_ptr<const scene::Scene> scene, std::uint32_t auditEvery)
    : playback_(recording, run),
      contacts_(recording, run),
      scene_(std::move(scene)),
      auditEvery_(auditEvery),
      at_(playback_.firstTick()) {}

scene::World Replay::seek(std::uint64_t tick, const Playback::Tell& tell) {
  try {
    scene::World world = playback_.worldAfter(tick, scene_, tell);
    scene::auditBroadPhase(world, auditEvery_);
    at_ = tick;
    branchedAt_.reset();
    stopped_.clear();
    return world;
  } catch (...) {
    playback_.resume(at_);
    throw;
  }
}

void Replay::branch() {
  branchedAt_ = at_;
  stopped_.clear();
}

v1::RecordingParent Replay::parent() const {
  v1::RecordingParent parent;
  parent.set_file(std::filesystem::absolute(file()).string());
  parent.set_tick(at_);
  parent.set_run(playback_.run());
  return parent;
}

std::optional<RecordedWorld::Ticked> Replay::tick(RecordedWorld& world) {
  if (branchedAt_) return world.tick();
  if (atEnd() || !stopped_.empty()) return std::nullopt;
  std::string why;
  try {
    if (auto ticked = recordedTick(world)) return ticked;
    why = "the recording ends before tick " + std::to_string(at_ + 1);
  } catch (const Diverged& diverged) {
    why = textOf(diverged);
    // Whether a tick is as recorded is known when it is made: the world before it is made again.
    world.goOnWith(madeAgain());
  } catch (const RecordingError& error) {
    why = error.what();
  }
  stopped_ = why;
  return std::nullopt;
}

scene::World Replay::madeAgain() {
  try {
    return seek(at_);
  } catch (const Diverged& diverged) {
    throw RecordingError(file().string() + ": " + textOf(diverged));
  }
}

/// nullopt: none is there to be read. Throws Diverged, the tick being made or not.
std::optional<RecordedWorld::Ticked> Replay::recordedTick(RecordedWorld& world) {
  const auto submit = [&world](const v1::RecordedCommands::One& one) {
    return one.has_body() ? world.submit(one.body()) : world.submit(one.avatar());
  };
  if (!playback_.feed(at_ + 1, submit)) return std::nullopt;
  RecordedWorld::Ticked ticked = world.tick();
  if (auto difference = playback_.judge(world)) throw Diverged{at_ + 1, std::move(*difference)};
  ++at_;
  return ticked;
}

}  // namespace enfilade::server
