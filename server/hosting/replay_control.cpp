#include "server/hosting/replay_control.hpp"

#include <spdlog/spdlog.h>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// Thrown by a seek that gives up because the server ends.
struct Ending {};

std::optional<v1::Error> noReplay(const ServedWorld& served) {
  if (served.replay) return std::nullopt;
  return errorOf(v1::ERROR_NOT_ALLOWED,
                 "this world plays no recording: `enfilade serve RECORDING` begins with one that "
                 "does");
}

/// "branch.mcap", or "branch-2.mcap" and so on where that is there.
std::filesystem::path freeFileOf(const std::filesystem::path& first) {
  std::filesystem::path file = first;
  for (int number = 2; std::filesystem::exists(file); ++number) {
    file = first;
    file.replace_filename(first.stem().string() + "-" + std::to_string(number) +
                          first.extension().string());
  }
  return file;
}

/// The recording of a branch begins, if branches are recorded.
void recordBranch(ServedWorld& served) {
  if (!served.branchRecording) return;
  RecordingOptions options = *served.branchRecording;
  options.choice.file = freeFileOf(options.choice.file);
  const BranchPoint branch{served.replay->parent(), served.replay->livingIn(served.world)};
  served.world.record(options, &branch);
  ++served.branches;
  spdlog::info("the branch after tick {} is recorded to {}", branch.parent.tick(),
               options.choice.file.string());
}

/// The world after `tick`, what lives in it being told by the replay.
void goTo(ServedWorld& served, std::uint64_t tick) {
  scene::World world = served.replay->seek(tick, [&served](std::uint64_t) {
    if (served.ending()) throw Ending{};
  });
  const v1::TickEvents living = served.replay->livingIn(world);
  goTo(served, std::move(world), living);
}

}  // namespace

v1::Replay replayOf(const ServedWorld& served) {
  const Replay& replay = *served.replay;
  v1::Replay message;
  message.set_file(replay.file().filename().string());
  message.set_first_tick(replay.firstTick());
  message.set_last_tick(replay.lastTick());
  message.set_tick(served.world.snapshot()->tick);
  message.set_at_end(replay.atEnd());
  message.set_branched(replay.branchedAt().has_value());
  message.set_branched_at(replay.branchedAt().value_or(0));
  *message.mutable_clock() = messageOf(served.clock);
  message.set_diverged(replay.whyStopped());
  return message;
}

void tellReplay(ServedWorld& served) {
  if (!served.replay) return;
  v1::ServerMessage message;
  *message.mutable_replay() = replayOf(served);
  const Buffer shared = encodeShared(message);
  for (auto& [id, client] : served.clients) client.out->push(shared);
}

std::optional<v1::Error> replayEnded(const ServedWorld& served) {
  const Replay* replay = served.replay.get();
  if (!replay || (!replay->atEnd() && replay->whyStopped().empty())) return std::nullopt;
  const std::string tick = std::to_string(served.world.snapshot()->tick);
  const std::string why =
      replay->atEnd() ? "the recording ends with tick " + tick
                      : "the replay stops after tick " + tick + " (" + replay->whyStopped() + ")";
  return errorOf(v1::ERROR_REPLAY_ENDED, why + ": Seek goes elsewhere, TakeOver goes on from here");
}

std::optional<v1::Error> onlyReplayed(const ServedWorld& served) {
  if (!served.replay || served.replay->branchedAt()) return std::nullopt;
  return errorOf(v1::ERROR_NOT_ALLOWED,
                 "the world plays a recording: TakeOver leaves it and goes on from here");
}

std::optional<v1::Error> seekProblem(const ServedWorld& served, const v1::Seek& wanted) {
  if (auto problem = noReplay(served)) return problem;
  const std::uint64_t first = served.replay->firstTick(), last = served.replay->lastTick();
  if (wanted.tick() >= first && wanted.tick() <= last) return std::nullopt;
  return errorOf(v1::ERROR_BAD_MESSAGE,
                 "seek.tick = " + std::to_string(wanted.tick()) + ": the recording has " +
                     std::to_string(first) + " to " + std::to_string(last),
                 "seek.tick");
}

std::optional<v1::Error> seek(ServedWorld& served, const v1::Seek& wanted) {
  const std::string where = "the replay cannot go to tick " + std::to_string(wanted.tick()) + ": ";
  try {
    goTo(served, wanted.tick());
  } catch (const Diverged& diverged) {
    return errorOf(v1::ERROR_REPLAY_ENDED, where + textOf(diverged), "seek.tick");
  } catch (const RecordingError& error) {
    return errorOf(v1::ERROR_REPLAY_ENDED, where + error.what(), "seek.tick");
  } catch (const Ending&) {
    return errorOf(v1::ERROR_SHUTTING_DOWN, "the server ends");
  }
  served.clock.nextTick = std::chrono::steady_clock::now();
  tellReplay(served);
  return std::nullopt;
}

std::optional<v1::Error> takeOverProblem(const ServedWorld& served, ClientId id,
                                         const v1::TakeOver& wanted) {
  if (auto problem = noReplay(served)) return problem;
  const std::string& name = wanted.avatar();
  if (name.empty()) return std::nullopt;
  if (!avatarNamed(*served.world.snapshot(), name))
    return errorOf(v1::ERROR_UNKNOWN_AVATAR,
                   "no avatar '" + name + "' is in the world after this tick", "take_over.avatar");
  const auto owner = served.owners.find(name);
  if (owner == served.owners.end() || owner->second == id) return std::nullopt;
  return errorOf(v1::ERROR_NOT_ALLOWED,
                 "avatar '" + name + "' belongs to another client: take another one over",
                 "take_over.avatar");
}

std::optional<v1::Error> takeOver(ServedWorld& served, ClientId id, const v1::TakeOver& wanted) {
  if (!served.replay->branchedAt()) {
    try {
      recordBranch(served);
    } catch (const RecordingError& error) {
      spdlog::error("no branch: {}", error.what());
      return errorOf(v1::ERROR_INTERNAL,
                     std::string("the branch cannot be recorded: ") + error.what());
    }
    served.replay->branch();
    tellReplay(served);
  }
  if (wanted.avatar().empty()) return std::nullopt;
  haltAvatar(served, wanted.avatar());
  served.owners[wanted.avatar()] = id;
  return std::nullopt;
}

}  // namespace enfilade::server
