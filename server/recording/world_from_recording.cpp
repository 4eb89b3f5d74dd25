#include "server/recording/world_from_recording.hpp"

#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/recording/world_recorder.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

[[noreturn]] void hashDiffers(std::uint64_t tick, const char* who, std::uint64_t recorded,
                              std::uint64_t replayed) {
  throw Diverged{tick,
                 {who, std::string(who) == kTheScene ? "hash" : "state hash",
                  protocol::hexadecimal(recorded), protocol::hexadecimal(replayed)}};
}

std::optional<v1::Error> submit(scene::World& world, const v1::RecordedCommands::One& one) {
  if (one.has_body()) return server::submit(world, one.body());
  auto command = commandFrom(one.avatar());
  if (auto* error = std::get_if<v1::Error>(&command)) return *error;
  if (auto why = scene::submit(world, std::get<scene::Command>(std::move(command))))
    return refusalOf(one.avatar(), *why);
  return std::nullopt;
}

}  // namespace

ModelOptions recordedModel(const v1::RecordingStart& start, const std::filesystem::path& scene,
                           bool cache) {
  ModelOptions model = modelOptionsFrom(start.choices());
  model.file = scene.empty() ? std::filesystem::path(start.scene_file()) : scene;
  model.cache = cache;
  if (!std::filesystem::exists(model.file))
    throw RecordingError(model.file.string() +
                         ": the recorded scene is not there; name it before the recording: "
                         "SCENE RECORDING");
  return model;
}

scene::World worldAtStart(std::shared_ptr<const scene::Scene> scene,
                          const v1::RecordingStart& start) {
  const auto lengths = lengthsFrom(start.lengths());
  if (!lengths) throw RecordingError("the recording has lengths that no world can have");
  const std::uint64_t hash = messageOf(*scene).hash();
  if (hash != start.scene().hash()) hashDiffers(0, kTheScene, start.scene().hash(), hash);
  scene::World world(std::move(scene), *lengths);
  const std::uint64_t state = world.snapshot()->stateHash;
  if (state != start.state_hash()) hashDiffers(0, "the world", start.state_hash(), state);
  return world;
}

scene::World worldAt(std::shared_ptr<const scene::Scene> scene,
                     const v1::RecordedCheckpoint& checkpoint) {
  const std::string& bytes = checkpoint.world();
  scene::World world = scene::worldFrom(
      std::move(scene), {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  const scene::Snapshot& snapshot = *world.snapshot();
  if (snapshot.tick != checkpoint.tick() || snapshot.stateHash != checkpoint.state_hash())
    hashDiffers(checkpoint.tick(), "the checkpoint", checkpoint.state_hash(), snapshot.stateHash);
  return world;
}

void take(std::uint64_t next, const v1::RecordedCommands& commands, const Submit& submit) {
  if (commands.tick() != next)
    throw RecordingError("commands of tick " + std::to_string(commands.tick()) +
                         " stand before tick " + std::to_string(next));
  for (const auto& one : commands.commands())
    if (const auto refused = submit(one))
      throw Diverged{next,
                     {one.has_body() ? one.body().body() : one.avatar().avatar(), "command",
                      "taken", "refused: " + refused->message()}};
}

void take(scene::World& world, const v1::RecordedCommands& commands) {
  take(world.snapshot()->tick + 1, commands,
       [&](const v1::RecordedCommands::One& one) { return submit(world, one); });
}

std::optional<protocol::StateDifference> differenceFrom(const scene::World& world,
                                                        const v1::State& recorded) {
  // Only what differs is worth a message.
  const scene::Snapshot& snapshot = *world.snapshot();
  if (snapshot.stateHash == recorded.hash() && snapshot.tick == recorded.tick())
    return std::nullopt;
  v1::State made;
  fill(made, world);
  auto found = protocol::firstDifference(recorded, made);
  if (!found) found = {"the world", "tick", std::to_string(recorded.tick()), ""};
  return found;
}

std::string textOf(const Diverged& diverged) {
  const protocol::StateDifference& what = diverged.difference;
  return "tick " + std::to_string(diverged.tick) + ": " + what.who + ": " + what.field +
         ": recorded " + what.recorded + ", replayed " + what.replayed;
}

}  // namespace enfilade::server
