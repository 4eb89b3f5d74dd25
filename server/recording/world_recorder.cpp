#include "server/recording/world_recorder.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <utility>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/base/version.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

constexpr std::array<std::pair<scene::IfcReader, const char*>, 4> kReaders{
    {{scene::IfcReader::automatic, "auto"},
     {scene::IfcReader::webIfc, "web-ifc"},
     {scene::IfcReader::ifcPlusPlus, "ifcplusplus"},
     {scene::IfcReader::assimp, "assimp"}}};

// When a recording gets its next checkpoint: RECORDING.md tells people the same.
constexpr double kCheckpointEvery = 10;          // seconds of simulated time, at least
constexpr std::uint64_t kRestPerCheckpoint = 8;  // times as many bytes as it took lie between

constexpr int kNamesAMessage = 4096;

v1::RecordingStart startOf(const scene::World& world, const ModelOptions& model) {
  v1::RecordingStart start;
  start.set_server_version(kServerVersion);
  start.set_scene_file(std::filesystem::absolute(model.file).string());
  *start.mutable_scene() = messageOf(world.scene());
  *start.mutable_choices() = messageOf(model);
  *start.mutable_lengths() = exactMessageOf(world.lengths());
  start.set_state_hash(world.snapshot()->stateHash);
  return start;
}

}  // namespace

WorldRecorder::WorldRecorder(const RecordingOptions& options, const scene::World& world,
                             const BranchPoint* branch)
    : file_(options.choice.file, std::string("enfilade ") + kServerVersion, options.replace),
      model_(options.model),
      picturesEvery_(options.choice.pictures) {
  v1::RecordingStart start = startOf(world, model_);
  if (branch) *start.mutable_parent() = branch->parent;
  file_.write(start, world.snapshot()->time);
  writeNames(world.scene().model());
  if (branch) writeCheckpoint(world);
  if (options.choice.viewers) viewers_.emplace(file_).begin(world);
  if (branch) told(branch->living);
}

bool WorldRecorder::checkpointIsDue(const scene::World& world) const {
  const double seconds =
      static_cast<double>(world.snapshot()->tick - last_.tick) * world.lengths().tick;
  return seconds >= kCheckpointEvery &&
         file_.bytesWritten() - last_.end >= kRestPerCheckpoint * last_.bytes;
}

void WorldRecorder::writeCheckpoint(const scene::World& world) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const std::vector<std::uint8_t> bytes = scene::checkpointOf(world);
  v1::RecordedCheckpoint checkpoint;
  checkpoint.set_tick(snapshot.tick);
  checkpoint.set_state_hash(snapshot.stateHash);
  checkpoint.set_world(bytes.data(), bytes.size());
  const std::uint64_t took = file_.write(checkpoint, snapshot.time);
  last_ = {snapshot.tick, took, file_.bytesWritten()};
}

/// Its GlobalId; of a piece that of what it is a piece of, with the piece's name behind it.
std::string lastingIdOf(const scene::Model& model, const scene::Object& object) {
  if (!object.globalId.empty() || !object.pieceOf) return object.globalId;
  const scene::Object& whole = model.objects[*object.pieceOf];
  if (whole.globalId.empty() || !object.path.starts_with(whole.path)) return {};
  return whole.globalId + object.path.substr(whole.path.size());
}

/// In messages of a size that readers can be asked to hold.
void WorldRecorder::writeNames(const scene::Model& model) {
  const auto& objects = model.objects;
  const bool global = std::any_of(objects.begin(), objects.end(),
                                  [](const auto& object) { return !object.globalId.empty(); });
  v1::RecordedNames names;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (names.paths().empty()) names.set_first_id(static_cast<std::uint32_t>(i + 1));
    names.add_paths(objects[i].path);
    if (global) names.add_global_ids(lastingIdOf(model, objects[i]));
    if (names.paths_size() < kNamesAMessage && i + 1 < objects.size()) continue;
    file_.write(names);
    names.Clear();
  }
}

void WorldRecorder::took(const v1::Command& command) {
  *commands_.add_commands()->mutable_avatar() = command;
}

void WorldRecorder::took(const v1::BodyCommand& command) {
  *commands_.add_commands()->mutable_body() = command;
}

template <class Work>
void WorldRecorder::unlessBroken(const Work& work) {
  if (broken_) return;
  try {
    work();
  } catch (const RecordingError& error) {
    broken_ = error.what();
    spdlog::error("the recording ends: {}", error.what());
  }
}

void WorldRecorder::ticked(const scene::World& world, const v1::TickEvents& events) {
  unlessBroken([&] {
    fill(state_, world);
    writeCommands(state_.tick(), state_.time());
    if (!events.contacts().empty() || !events.notices().empty()) file_.write(events);
    file_.write(state_);
    if (viewers_) viewers_->ticked(world, events);
    if (checkpointIsDue(world)) writeCheckpoint(world);
    ++ticks_;
  });
  commands_.clear_commands();
}

void WorldRecorder::tickFailed(const scene::World& world) {
  const std::uint64_t tick = world.snapshot()->tick + 1;
  unlessBroken([&] {
    writeCommands(tick, static_cast<double>(tick) * world.lengths().tick);
    file_.flush();
  });
}

void WorldRecorder::writeCommands(std::uint64_t tick, double time) {
  if (commands_.commands().empty()) return;
  commands_.set_tick(tick);
  file_.write(commands_, time);
}

void WorldRecorder::told(const v1::TickEvents& events) {
  if (events.contacts().empty() && events.notices().empty()) return;
  unlessBroken([&] {
    file_.write(events);
    if (viewers_) viewers_->told(events);
  });
}

void WorldRecorder::beganAnew(const scene::World& world) {
  commands_.clear_commands();
  nextPictures_ = 0;
  if (ticks_ == ticksBefore_) return;  // it has not left its beginning
  ticksBefore_ = ticks_;
  unlessBroken([&] {
    file_.write(startOf(world, model_));
    last_ = {0, 0, file_.bytesWritten()};
    if (viewers_) viewers_->begin(world);
  });
}

bool WorldRecorder::picturesDue(const scene::World& world) {
  const double time = world.snapshot()->time;
  if (broken_ || picturesEvery_.value_or(0) <= 0) return false;
  if (time + world.lengths().tick / 2 < nextPictures_) return false;
  nextPictures_ = time + *picturesEvery_;
  return true;
}

void WorldRecorder::picture(const std::string& avatar, const v1::Frame& description,
                            const EncodedPicture& picture) {
  unlessBroken([&] { viewers_->picture(avatar, description, picture); });
}

void WorldRecorder::flush() {
  unlessBroken([&] { file_.flush(); });
}

std::optional<std::string> WorldRecorder::close() {
  unlessBroken([&] { file_.close(); });
  return broken_;
}

void fill(v1::State& state, const scene::World& world) {
  const scene::Snapshot& snapshot = *world.snapshot();
  state.Clear();
  state.set_tick(snapshot.tick);
  state.set_time(snapshot.time);
  state.set_hash(snapshot.stateHash);
  for (const scene::AvatarView& avatar : snapshot.avatars)
    *state.add_avatars() = messageOf(world, avatar);
  for (const scene::BodyView& body : *snapshot.bodies)
    if (body.displaced || body.moving) *state.add_bodies() = messageOf(world, body);
}

v1::Lengths exactMessageOf(const scene::Lengths& lengths) {
  v1::Lengths message;
  message.set_epsilon(lengths.epsilon);
  message.set_step_height(lengths.stepHeight);
  message.set_near_miss(lengths.nearMiss);
  message.set_walkable_normal_y(lengths.walkableNormalY);
  message.set_gravity(lengths.gravity);
  message.set_speed_limit(lengths.speedLimit);
  message.set_push_force(lengths.pushForce);
  message.set_tick(lengths.tick);
  message.set_patience(lengths.patience);
  message.set_jump_limit(lengths.jumpLimit);
  message.set_joint_speed_limit(lengths.jointSpeedLimit);
  message.set_sliding(lengths.sliding == scene::Sliding::stop ? "stop" : "slide");
  return message;
}

std::optional<scene::Lengths> lengthsFrom(const v1::Lengths& message) {
  scene::Lengths lengths;
  lengths.epsilon = message.epsilon();
  lengths.stepHeight = message.step_height();
  lengths.nearMiss = message.near_miss();
  lengths.walkableNormalY = message.walkable_normal_y();
  lengths.gravity = message.gravity();
  lengths.speedLimit = message.speed_limit();
  lengths.pushForce = message.push_force();
  lengths.tick = message.tick();
  lengths.patience = message.patience();
  lengths.jumpLimit = message.jump_limit();
  lengths.jointSpeedLimit = message.joint_speed_limit();
  lengths.sliding = message.sliding() == "stop" ? scene::Sliding::stop : scene::Sliding::slide;
  if (scene::lengthsProblem(lengths)) return std::nullopt;
  return lengths;
}

v1::ModelChoices messageOf(const ModelOptions& model) {
  v1::ModelChoices message;
  if (model.metresPerUnit) message.set_metres_per_unit(*model.metresPerUnit);
  if (model.up) message.set_up(std::string(1, *model.up));
  if (model.offset) *message.mutable_offset() = messageOf(*model.offset);
  for (const auto& [reader, name] : kReaders)
    if (reader == model.ifcReader) message.set_ifc_reader(name);
  message.set_ifc_doors(model.doors == scene::IfcDoors::still ? "still" : "move");
  return message;
}

ModelOptions modelOptionsFrom(const v1::ModelChoices& message) {
  ModelOptions model;
  if (message.has_metres_per_unit()) model.metresPerUnit = message.metres_per_unit();
  if (!message.up().empty()) model.up = message.up().front();
  if (message.has_offset()) model.offset = vectorFrom(message.offset());
  model.ifcReader =
      scene::ifcReaderFrom(message.ifc_reader()).value_or(scene::IfcReader::automatic);
  model.doors = message.ifc_doors() == "still" ? scene::IfcDoors::still : scene::IfcDoors::move;
  return model;
}

void requireAnotherFile(const std::filesystem::path& written, const std::filesystem::path& read) {
  std::error_code none;
  if (std::filesystem::equivalent(written, read, none))
    throw RecordingError(written.string() +
                         ": is the recording that is read; give another --record");
}

}  // namespace enfilade::server
