#include "server/recording/replay_check.hpp"

#include "collision/assert.hpp"

namespace enfilade::server {

using protocol::mcap::RecordingError;

Replay::Replay(const std::filesystem::path& recording, std::uint32_t run,
               std::shared_ptr<const scene::Scene> scene, std::uint32_t auditEvery)
    : playback_(recording, run),
      contacts_(recording, run),
      scene_(std::move(scene)),
      auditEvery_(auditEvery),
      tick_(playback_.firstTick()) {}

scene::World Replay::seek(std::uint64_t tick, const Playback::ProgressHandler& onProgress) {
  try {
    scene::World world = playback_.restoreWorldAfter(tick, scene_, onProgress);
    scene::setAuditInterval(world, auditEvery_);
    tick_ = tick;
    branchTick_.reset();
    stopReason_.clear();
    return world;
  } catch (...) {
    playback_.resume(tick_);
    throw;
  }
}

void Replay::branch() {
  ENFILADE_ASSERT(!branchTick_);
  branchTick_ = tick_;
  stopReason_.clear();
}

v1::RecordingParent Replay::parent() const {
  v1::RecordingParent parent;
  parent.set_file(std::filesystem::absolute(file()).string());
  parent.set_tick(tick_);
  parent.set_run(playback_.run());
  return parent;
}

std::optional<RecordableWorld::TickResult> Replay::tick(RecordableWorld& world) {
  if (branchTick_) return world.tick();
  if (atEnd() || !stopReason_.empty()) return std::nullopt;
  std::string reason;
  try {
    if (auto result = replayTick(world)) return result;
    reason = "the recording ends before tick " + std::to_string(tick_ + 1);
  } catch (const Divergence& divergence) {
    reason = formatDivergence(divergence);
    // A divergence is known only after the tick: restore the world before it.
    world.switchTo(restoreWorld());
  } catch (const RecordingError& error) {
    reason = error.what();
  }
  stopReason_ = reason;
  return std::nullopt;
}

scene::World Replay::restoreWorld() {
  try {
    return seek(tick_);
  } catch (const Divergence& divergence) {
    throw RecordingError(file().string() + ": " + formatDivergence(divergence));
  }
}

/// Runs the next recorded tick; nullopt: no further tick is readable. Throws Divergence, possibly
/// after the tick.
std::optional<RecordableWorld::TickResult> Replay::replayTick(RecordableWorld& world) {
  const auto submit = [&world](const v1::RecordedCommands::One& one) {
    return one.has_body() ? world.submit(one.body()) : world.submit(one.avatar());
  };
  if (!playback_.applyCommands(tick_ + 1, submit)) return std::nullopt;
  RecordableWorld::TickResult result = world.tick();
  if (auto difference = playback_.verifyTick(world))
    throw Divergence{tick_ + 1, std::move(*difference)};
  ++tick_;
  return result;
}

}  // namespace enfilade::server
