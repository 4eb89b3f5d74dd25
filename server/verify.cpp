#include "server/verify.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocol/recording.hpp"
#include "server/body_messages.hpp"
#include "server/load_scene.hpp"
#include "server/tick_statistics.hpp"
#include "server/world_messages.hpp"
#include "server/world_recorder.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

/// Thrown at the first tick that ends otherwise than it was recorded.
struct Diverged {
  std::uint64_t tick = 0;
  protocol::StateDifference difference;
};

/// A recording under way: the world that it tells of, made again.
class Replayed {
 public:
  Replayed(const VerifyCommand& command, const v1::RecordingStart& start)
      : scene_(loadScene(modelOf(command, start))) {
    begin(start);
  }

  void begin(const v1::RecordingStart& start) {
    const auto lengths = lengthsFrom(start.lengths());
    if (!lengths) throw RecordingError("the recording has lengths that no world can have");
    world_.emplace(scene_, *lengths);
    if (messageOf(*scene_).hash() != start.scene().hash())
      throw Diverged{0,
                     {"the scene", "hash", protocol::hexadecimal(start.scene().hash()),
                      protocol::hexadecimal(messageOf(*scene_).hash())}};
    if (world_->snapshot()->stateHash != start.state_hash())
      throw Diverged{0,
                     {"the world", "state hash", protocol::hexadecimal(start.state_hash()),
                      protocol::hexadecimal(world_->snapshot()->stateHash)}};
  }

  void take(const v1::RecordedCommands& commands) {
    if (commands.tick() != tick() + 1)
      throw RecordingError("commands of tick " + std::to_string(commands.tick()) +
                           " stand before tick " + std::to_string(tick() + 1));
    for (const auto& one : commands.commands()) submit(one);
  }

  void make(const v1::State& recorded) {
    const scene::TickReport report = scene::tick(*world_);
    // Only what differs is worth a message.
    if (report.snapshot->stateHash == recorded.hash() && report.snapshot->tick == recorded.tick())
      return;
    v1::State made;
    fill(made, *world_);
    auto found = protocol::firstDifference(recorded, made);
    if (!found) found = {"the world", "tick", std::to_string(recorded.tick()), ""};
    throw Diverged{report.snapshot->tick, *found};
  }

  std::uint64_t tick() const { return world_->snapshot()->tick; }
  std::uint64_t hash() const { return world_->snapshot()->stateHash; }

 private:
  static ModelOptions modelOf(const VerifyCommand& command, const v1::RecordingStart& start) {
    ModelOptions model = modelOptionsFrom(start.choices());
    model.file = command.scene.empty() ? std::filesystem::path(start.scene_file()) : command.scene;
    model.cache = command.cache;
    if (!std::filesystem::exists(model.file))
      throw RecordingError(model.file.string() +
                           ": the recorded scene is not there; name it: "
                           "enfilade replay SCENE " +
                           command.recording.string() + " --verify");
    return model;
  }

  void submit(const v1::RecordedCommands::One& one) {
    std::optional<v1::Error> refused;
    if (one.has_body()) {
      refused = server::submit(*world_, one.body());
    } else {
      auto command = commandFrom(one.avatar());
      if (auto* error = std::get_if<v1::Error>(&command)) {
        refused = *error;
      } else if (auto why = scene::submit(*world_, std::get<scene::Command>(std::move(command)))) {
        refused = refusalOf(one.avatar(), *why);
      }
    }
    if (refused)
      throw Diverged{tick() + 1,
                     {one.has_body() ? one.body().body() : one.avatar().avatar(), "command",
                      "taken", "refused: " + refused->message()}};
  }

  std::shared_ptr<const scene::Scene> scene_;
  std::optional<scene::World> world_;
};

/// Replays all of it; throws Diverged.
std::optional<Replayed> replayAll(const VerifyCommand& command,
                                  protocol::RecordingReader& recording, std::uint64_t& ticks) {
  std::optional<Replayed> replayed;
  while (const auto item = recording.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (replayed) {
        replayed->begin(*start);
      } else {
        replayed.emplace(command, *start);
      }
      continue;
    }
    if (!replayed) throw RecordingError("the recording does not begin with its scene");
    if (const auto* commands = std::get_if<v1::RecordedCommands>(&*item)) replayed->take(*commands);
    if (const auto* state = std::get_if<v1::State>(&*item)) {
      replayed->make(*state);
      ++ticks;
    }
  }
  return replayed;
}

}  // namespace

ExitCode verify(const VerifyCommand& command) {
  protocol::RecordingReader recording(command.recording);
  nlohmann::ordered_json told;
  std::uint64_t ticks = 0;
  ExitCode code = ExitCode::done;
  try {
    const auto replayed = replayAll(command, recording, ticks);
    if (!replayed)
      throw RecordingError(command.recording.string() + ": no recording of Enfilade begins in it");
    told["ticks"] = ticks;
    told["state_hash"] = protocol::hexadecimal(replayed->hash());
    told["closed"] = recording.closed();
    if (!recording.closed()) {
      told["whole_bytes"] = recording.wholeBytes();
      spdlog::warn("{}: it was cut off after byte {}; what comes before was verified",
                   command.recording.string(), recording.wholeBytes());
    }
  } catch (const Diverged& diverged) {
    const protocol::StateDifference& what = diverged.difference;
    told["diverged"] = {{"tick", diverged.tick},
                        {"who", what.who},
                        {"field", what.field},
                        {"recorded", what.recorded},
                        {"replayed", what.replayed}};
    std::fprintf(stderr, "enfilade: tick %llu: %s: %s: recorded %s, replayed %s\n",
                 static_cast<unsigned long long>(diverged.tick), what.who.c_str(),
                 what.field.c_str(), what.recorded.c_str(), what.replayed.c_str());
    code = ExitCode::diverged;
  }
  std::printf("%s\n", told.dump().c_str());
  return code;
}

}  // namespace enfilade::server
