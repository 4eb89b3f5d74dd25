#include "server/hosting/replay_control.hpp"

#include "collision/assert.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// Thrown to abort a seek because the server stops.
struct ServerStopping {};

/// Returns "branch.mcap", or "branch-2.mcap" and so on if the file exists.
std::filesystem::path findFreeFile(const std::filesystem::path& first) {
  std::filesystem::path file = first;
  for (int number = 2; std::filesystem::exists(file); ++number) {
    file = first;
    file.replace_filename(first.stem().string() + "-" + std::to_string(number) +
                          first.extension().string());
  }
  return file;
}

/// Starts recording the branch, if branches are recorded.
void startBranchRecording(HostedWorld& hosted) {
  ENFILADE_ASSERT(!hosted.world.recorder());
  if (!hosted.branchRecording) return;
  RecordingOptions options = *hosted.branchRecording;
  options.choice.file = findFreeFile(options.choice.file);
  const BranchPoint branch{hosted.replay->parent(),
                           hosted.replay->findActiveContactsAt(hosted.world)};
  hosted.world.record(options, &branch);
  ++hosted.branchCount;
  logInfo("recording the branch after tick {} to {}", branch.parent.tick(),
          options.choice.file.string());
}

/// Replaces the world by the one after `tick`, with the active contacts of the replay.
void seekTo(HostedWorld& hosted, std::uint64_t tick) {
  scene::World world = hosted.replay->seek(tick, [&hosted](std::uint64_t) {
    if (hosted.isEnding()) throw ServerStopping{};
  });
  const v1::TickEvents activeContacts = hosted.replay->findActiveContactsAt(world);
  replaceWorld(hosted, std::move(world), activeContacts, "the recording was sought");
}

}  // namespace

std::optional<v1::Error> validateHasReplay(const HostedWorld& hosted) {
  if (hosted.replay) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "this world does not replay a recording: start the server with "
                   "`enfilade serve RECORDING`");
}

v1::Replay makeReplayStatus(const HostedWorld& hosted) {
  ENFILADE_ASSERT(hosted.replay);
  const Replay& replay = *hosted.replay;
  v1::Replay message;
  message.set_file(replay.file().filename().string());
  message.set_first_tick(replay.firstTick());
  message.set_last_tick(replay.lastTick());
  message.set_tick(hosted.world.snapshot()->tick);
  message.set_at_end(replay.atEnd());
  message.set_branched(replay.branchTick().has_value());
  message.set_branched_at(replay.branchTick().value_or(0));
  *message.mutable_clock() = toProto(hosted.clock);
  message.set_diverged(replay.stopReason());
  return message;
}

void broadcastReplay(HostedWorld& hosted) {
  if (!hosted.replay) return;
  v1::ServerMessage message;
  *message.mutable_replay() = makeReplayStatus(hosted);
  const Buffer shared = encodeShared(message);
  for (auto& [id, client] : hosted.clients) client.out->push(shared);
}

std::optional<v1::Error> validateReplayRunning(const HostedWorld& hosted) {
  const Replay* replay = hosted.replay.get();
  if (!replay || (!replay->atEnd() && replay->stopReason().empty())) return std::nullopt;
  const std::string tick = std::to_string(hosted.world.snapshot()->tick);
  const std::string reason =
      replay->atEnd() ? "the recording ends with tick " + tick
                      : "the replay stops after tick " + tick + " (" + replay->stopReason() + ")";
  return makeError(v1::ERROR_REPLAY_ENDED, reason + ": use Seek, or TakeOver to continue here");
}

std::optional<v1::Error> validateAcceptsCommands(const HostedWorld& hosted) {
  if (!hosted.replay || hosted.replay->branchTick()) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "the world replays a recording: TakeOver to continue from here");
}

std::optional<v1::Error> validateSeek(const HostedWorld& hosted, const v1::Seek& request) {
  if (auto error = validateHasReplay(hosted)) return error;
  const std::uint64_t first = hosted.replay->firstTick(), last = hosted.replay->lastTick();
  if (request.tick() >= first && request.tick() <= last) return std::nullopt;
  return makeError(v1::ERROR_BAD_MESSAGE,
                   "seek.tick = " + std::to_string(request.tick()) + ": the recording has " +
                       std::to_string(first) + " to " + std::to_string(last),
                   "seek.tick");
}

std::optional<v1::Error> seekReplay(HostedWorld& hosted, const v1::Seek& request) {
  ENFILADE_ASSERT(!validateSeek(hosted, request));
  const std::string prefix = "cannot seek to tick " + std::to_string(request.tick()) + ": ";
  try {
    seekTo(hosted, request.tick());
  } catch (const Divergence& divergence) {
    return makeError(v1::ERROR_REPLAY_ENDED, prefix + formatDivergence(divergence), "seek.tick");
  } catch (const RecordingError& error) {
    return makeError(v1::ERROR_REPLAY_ENDED, prefix + error.what(), "seek.tick");
  } catch (const ServerStopping&) {
    return makeError(v1::ERROR_SHUTTING_DOWN, "the server is stopping");
  }
  hosted.clock.nextTick = std::chrono::steady_clock::now();
  broadcastReplay(hosted);
  return std::nullopt;
}

std::optional<v1::Error> validateTakeOver(const HostedWorld& hosted, ClientId id,
                                          const v1::TakeOver& request) {
  if (auto error = validateHasReplay(hosted)) return error;
  const std::string& name = request.avatar();
  if (name.empty()) return std::nullopt;
  if (!findAvatar(*hosted.world.snapshot(), name))
    return makeError(v1::ERROR_UNKNOWN_AVATAR,
                     "no avatar '" + name + "' is in the world after this tick",
                     "take_over.avatar");
  const auto owner = hosted.owners.find(name);
  if (owner == hosted.owners.end() || owner->second == id) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "avatar '" + name + "' belongs to another client: take over another one",
                   "take_over.avatar");
}

std::optional<v1::Error> takeOverReplay(HostedWorld& hosted, ClientId id,
                                        const v1::TakeOver& request) {
  ENFILADE_ASSERT(!validateTakeOver(hosted, id, request));
  if (!hosted.replay->branchTick()) {
    try {
      startBranchRecording(hosted);
    } catch (const RecordingError& error) {
      logError("cannot record the branch: {}", error.what());
      return makeError(v1::ERROR_INTERNAL,
                       std::string("the branch cannot be recorded: ") + error.what());
    }
    hosted.replay->branch();
    broadcastReplay(hosted);
  }
  if (request.avatar().empty()) return std::nullopt;
  stopAvatar(hosted, request.avatar());
  hosted.takenOver.insert(request.avatar());
  hosted.owners[request.avatar()] = id;
  return std::nullopt;
}

}  // namespace enfilade::server
