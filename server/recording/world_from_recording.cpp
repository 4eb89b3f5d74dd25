#include "server/recording/world_from_recording.hpp"

#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/order_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/recording/world_recorder.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

[[noreturn]] void throwHashDivergence(std::uint64_t tick, const char* subject,
                                      std::uint64_t recorded, std::uint64_t replayed) {
  throw Divergence{tick,
                   {subject, std::string(subject) == kSceneSubject ? "hash" : "state hash",
                    protocol::toHex(recorded), protocol::toHex(replayed)}};
}

std::optional<v1::Error> submitRecorded(scene::World& world,
                                        const v1::RecordedCommands::One& recordedCommand) {
  if (recordedCommand.has_body()) return server::submitBodyCommand(world, recordedCommand.body());
  auto command = commandFromProto(recordedCommand.avatar());
  if (auto* error = std::get_if<v1::Error>(&command)) return *error;
  if (auto reason = scene::submitAvatarCommand(world, std::get<scene::Command>(std::move(command))))
    return makeRefusalError(recordedCommand.avatar(), *reason);
  return std::nullopt;
}

}  // namespace

ModelOptions makeRecordedModelOptions(const v1::RecordingStart& start,
                                      const std::filesystem::path& scene, bool cache) {
  ModelOptions model = modelOptionsFromProto(start.choices());
  model.file = scene.empty() ? std::filesystem::path(start.scene_file()) : scene;
  model.cache = cache;
  if (!std::filesystem::exists(model.file))
    throw RecordingError(model.file.string() +
                         ": the recorded scene does not exist; give it before the recording: "
                         "SCENE RECORDING");
  return model;
}

scene::World makeWorldAtStart(std::shared_ptr<const scene::Scene> scene,
                              const v1::RecordingStart& start) {
  const auto settings = settingsFromProto(start.lengths());
  if (!settings) throw RecordingError("the recording has invalid world settings");
  const std::uint64_t hash = toProto(*scene).hash();
  if (hash != start.scene().hash())
    throwHashDivergence(0, kSceneSubject, start.scene().hash(), hash);
  scene::World world(std::move(scene), *settings);
  const std::uint64_t state = world.snapshot()->stateHash;
  if (state != start.state_hash()) throwHashDivergence(0, "the world", start.state_hash(), state);
  return world;
}

scene::World makeWorldFromCheckpoint(std::shared_ptr<const scene::Scene> scene,
                                     const v1::RecordedCheckpoint& checkpoint) {
  const std::string& bytes = checkpoint.world();
  scene::World world = scene::restoreWorld(
      std::move(scene), {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  const scene::Snapshot& snapshot = *world.snapshot();
  if (snapshot.tick != checkpoint.tick() || snapshot.stateHash != checkpoint.state_hash())
    throwHashDivergence(checkpoint.tick(), "the checkpoint", checkpoint.state_hash(),
                        snapshot.stateHash);
  return world;
}

void submitRecordedCommands(std::uint64_t next, const v1::RecordedCommands& commands,
                            const SubmitCommand& submit) {
  if (commands.tick() != next)
    throw RecordingError("commands of tick " + std::to_string(commands.tick()) +
                         " found before tick " + std::to_string(next));
  for (const auto& recordedCommand : commands.commands())
    if (const auto refusal = submit(recordedCommand))
      throw Divergence{next,
                       {recordedCommand.has_body() ? recordedCommand.body().body()
                                                   : recordedCommand.avatar().avatar(),
                        "command", "accepted", "refused: " + refusal->message()}};
}

void applyRecordedCommands(scene::World& world, const v1::RecordedCommands& commands) {
  submitRecordedCommands(world.snapshot()->tick + 1, commands,
                         [&](const v1::RecordedCommands::One& recordedCommand) {
                           return submitRecorded(world, recordedCommand);
                         });
}

std::optional<protocol::StateDifference> compareState(const scene::World& world,
                                                      const v1::State& recorded) {
  // Equal hashes: skip building the message.
  const scene::Snapshot& snapshot = *world.snapshot();
  if (snapshot.stateHash == recorded.hash() && snapshot.tick == recorded.tick())
    return std::nullopt;
  v1::State replayed;
  fillState(replayed, world);
  auto found = protocol::findFirstDifference(recorded, replayed);
  if (!found) found = {"the world", "tick", std::to_string(recorded.tick()), ""};
  return found;
}

std::string formatDivergence(const Divergence& divergence) {
  const protocol::StateDifference& difference = divergence.difference;
  return "tick " + std::to_string(divergence.tick) + ": " + difference.entity + ": " +
         difference.field + ": recorded " + difference.recorded + ", replayed " +
         difference.replayed;
}

}  // namespace enfilade::server
