#include "server/recording/world_recorder.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "collision/assert.hpp"
#include "scene/world/checkpoint/checkpoint.hpp"
#include "scene/world/data/validation.hpp"
#include "server/base/version.hpp"
#include "server/log/log.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;

constexpr std::array<std::pair<scene::IfcReader, const char*>, 4> kIfcReaders{
    {{scene::IfcReader::automatic, "auto"},
     {scene::IfcReader::webIfc, "web-ifc"},
     {scene::IfcReader::ifcPlusPlus, "ifcplusplus"},
     {scene::IfcReader::assimp, "assimp"}}};

// Spacing of checkpoints, as documented in RECORDING.md.
constexpr double kMinCheckpointInterval = 10;          // seconds of simulated time, at least
constexpr std::uint64_t kCheckpointSpacingFactor = 8;  // times the checkpoint's own bytes, at least

constexpr int kNamesPerMessage = 4096;

v1::RecordingStart makeRecordingStart(const scene::World& world, const ModelOptions& model) {
  v1::RecordingStart start;
  start.set_server_version(kServerVersion);
  start.set_scene_file(std::filesystem::absolute(model.file).string());
  *start.mutable_scene() = toProto(world.scene());
  *start.mutable_choices() = toProto(model);
  *start.mutable_lengths() = toRecordedProto(world.settings());
  start.set_state_hash(world.snapshot()->stateHash);
  return start;
}

ViewerSink makeFileSink(protocol::RecordingWriter& file) {
  return {[&file](const std::string& topic, double time, const google::protobuf::Message& message) {
            file.write(topic, time, message);
          },
          [&file](double time) { return file.fileTime(time); }};
}

/// The object's GlobalId. A part has the GlobalId of its whole, followed by the part's name.
std::string findPersistentId(const scene::Model& model, const scene::Object& object) {
  if (!object.globalId.empty() || !object.partOf) return object.globalId;
  const scene::Object& whole = model.objects[*object.partOf];
  if (whole.globalId.empty() || !object.path.starts_with(whole.path)) return {};
  return whole.globalId + object.path.substr(whole.path.size());
}

}  // namespace

WorldRecorder::WorldRecorder(const RecordingOptions& options, const scene::World& world,
                             const BranchPoint* branch)
    : file_(options.choice.file, std::string("enfilade ") + kServerVersion, options.overwrite),
      model_(options.model),
      imagePeriod_(options.choice.pictureInterval) {
  ENFILADE_ASSERT(!recordsImages() || options.choice.forViewers);
  v1::RecordingStart start = makeRecordingStart(world, model_);
  if (branch) *start.mutable_parent() = branch->parent;
  file_.write(start, world.snapshot()->time);
  writeNames(world.scene().model());
  if (branch) writeCheckpoint(world);
  if (options.choice.forViewers)
    viewerChannels_.emplace(makeFileSink(file_), StaticObjects::asPrimitives).writeScene(world);
  if (branch) onEvents(branch->activeContacts);
}

bool WorldRecorder::isCheckpointDue(const scene::World& world) const {
  const double seconds = static_cast<double>(world.snapshot()->tick - lastCheckpoint_.tick) *
                         world.settings().tickDuration;
  return seconds >= kMinCheckpointInterval && file_.bytesWritten() - lastCheckpoint_.end >=
                                                  kCheckpointSpacingFactor * lastCheckpoint_.bytes;
}

void WorldRecorder::writeCheckpoint(const scene::World& world) {
  const scene::Snapshot& snapshot = *world.snapshot();
  const std::vector<std::uint8_t> bytes = scene::makeCheckpoint(world);
  v1::RecordedCheckpoint checkpoint;
  checkpoint.set_tick(snapshot.tick);
  checkpoint.set_state_hash(snapshot.stateHash);
  checkpoint.set_world(bytes.data(), bytes.size());
  const std::uint64_t writtenBytes = file_.write(checkpoint, snapshot.time);
  lastCheckpoint_ = {snapshot.tick, writtenBytes, file_.bytesWritten()};
}

/// Writes the names in several messages, so that each stays small for readers.
void WorldRecorder::writeNames(const scene::Model& model) {
  const auto& objects = model.objects;
  const bool hasGlobalIds = std::any_of(
      objects.begin(), objects.end(), [](const auto& object) { return !object.globalId.empty(); });
  v1::RecordedNames names;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (names.paths().empty()) names.set_first_id(static_cast<std::uint32_t>(i + 1));
    names.add_paths(objects[i].path);
    if (hasGlobalIds) names.add_global_ids(findPersistentId(model, objects[i]));
    if (names.paths_size() < kNamesPerMessage && i + 1 < objects.size()) continue;
    file_.write(names);
    names.Clear();
  }
}

void WorldRecorder::onCommand(const v1::Command& command) {
  *commands_.add_commands()->mutable_avatar() = command;
}

void WorldRecorder::onBodyCommand(const v1::BodyCommand& command) {
  *commands_.add_commands()->mutable_body() = command;
}

template <class Work>
void WorldRecorder::writeUnlessBroken(const Work& work) {
  if (error_) return;
  try {
    work();
  } catch (const RecordingError& error) {
    error_ = error.what();
    logError("the recording ends here: {}", error.what());
  }
}

void WorldRecorder::onTick(const scene::World& world, const v1::TickEvents& events) {
  writeUnlessBroken([&] {
    fillState(state_, world);
    writeCommands(state_.tick(), state_.time());
    if (!events.contacts().empty() || !events.notices().empty()) file_.write(events);
    file_.write(state_);
    if (viewerChannels_) viewerChannels_->writeTick(world, events);
    if (isCheckpointDue(world)) writeCheckpoint(world);
    ++ticks_;
  });
  commands_.clear_commands();
}

void WorldRecorder::onTickFailed(const scene::World& world) {
  const std::uint64_t tick = world.snapshot()->tick + 1;
  writeUnlessBroken([&] {
    writeCommands(tick, static_cast<double>(tick) * world.settings().tickDuration);
    file_.flush();
  });
}

void WorldRecorder::writeCommands(std::uint64_t tick, double time) {
  if (commands_.commands().empty()) return;
  commands_.set_tick(tick);
  file_.write(commands_, time);
}

void WorldRecorder::onEvents(const v1::TickEvents& events) {
  if (events.contacts().empty() && events.notices().empty()) return;
  writeUnlessBroken([&] {
    file_.write(events);
    if (viewerChannels_) viewerChannels_->writeEvents(events);
  });
}

void WorldRecorder::onReset(const scene::World& world) {
  commands_.clear_commands();
  nextImageTime_ = 0;
  // Without a tick since a start at tick 0, that start still holds. A branch starts later.
  if (ticks_ == previousTicks_ && lastCheckpoint_.tick == 0) return;
  previousTicks_ = ticks_;
  writeUnlessBroken([&] {
    file_.write(makeRecordingStart(world, model_));
    lastCheckpoint_ = {0, 0, file_.bytesWritten()};
    if (viewerChannels_) viewerChannels_->writeScene(world);
  });
}

void WorldRecorder::onRestore(const scene::World& world, const v1::TickEvents& activeContacts) {
  commands_.clear_commands();
  nextImageTime_ = 0;
  previousTicks_ = ticks_;
  writeUnlessBroken([&] {
    v1::RecordingStart start = makeRecordingStart(world, model_);
    start.mutable_parent()->set_tick(world.snapshot()->tick);
    file_.write(start, world.snapshot()->time);
    writeCheckpoint(world);
    if (viewerChannels_) viewerChannels_->writeScene(world);
  });
  onEvents(activeContacts);
}

bool WorldRecorder::areImagesDue(const scene::World& world) {
  const double time = world.snapshot()->time;
  if (error_ || imagePeriod_.value_or(0) <= 0) return false;
  if (time + world.settings().tickDuration / 2 < nextImageTime_) return false;
  nextImageTime_ = time + *imagePeriod_;
  return true;
}

void WorldRecorder::writeImage(const std::string& avatar, const v1::Frame& description,
                               const EncodedImage& image) {
  ENFILADE_ASSERT(recordsImages());
  writeUnlessBroken([&] { viewerChannels_->writeImage(avatar, description, image); });
}

void WorldRecorder::flush() {
  writeUnlessBroken([&] { file_.flush(); });
}

std::optional<std::string> WorldRecorder::close() {
  writeUnlessBroken([&] { file_.close(); });
  return error_;
}

void fillState(v1::State& state, const scene::World& world) {
  const scene::Snapshot& snapshot = *world.snapshot();
  state.Clear();
  state.set_tick(snapshot.tick);
  state.set_time(snapshot.time);
  state.set_hash(snapshot.stateHash);
  for (const scene::AvatarSnapshot& avatar : snapshot.avatars)
    *state.add_avatars() = toProto(world, avatar);
  for (const scene::BodySnapshot& body : *snapshot.bodies)
    if (body.displaced || body.moving) *state.add_bodies() = toProto(world, body);
}

v1::Lengths toRecordedProto(const scene::WorldSettings& settings) {
  v1::Lengths message;
  setWorldSettings(settings, message);
  message.set_walkable_normal_y(settings.walkableNormalY);
  return message;
}

std::optional<scene::WorldSettings> settingsFromProto(const v1::Lengths& message) {
  scene::WorldSettings settings;
  settings.contactOffset = message.epsilon();
  settings.stepHeight = message.step_height();
  settings.nearMissDistance = message.near_miss();
  settings.walkableNormalY = message.walkable_normal_y();
  settings.gravity = message.gravity();
  settings.maxSpeed = message.speed_limit();
  settings.maxPushForce = message.push_force();
  settings.tickDuration = message.tick();
  settings.stuckTimeout = message.patience();
  settings.maxJumpHeight = message.jump_limit();
  settings.maxJointSpeed = message.joint_speed_limit();
  settings.sliding = message.sliding() == "stop" ? scene::Sliding::stop : scene::Sliding::slide;
  if (scene::validateWorldSettings(settings)) return std::nullopt;
  return settings;
}

v1::ModelChoices toProto(const ModelOptions& model) {
  v1::ModelChoices message;
  if (model.import.metresPerUnit) message.set_metres_per_unit(*model.import.metresPerUnit);
  if (model.import.up) message.set_up(toString(*model.import.up));
  if (model.import.offset) *message.mutable_offset() = toProto(*model.import.offset);
  for (const auto& [reader, name] : kIfcReaders)
    if (reader == model.import.ifcReader) message.set_ifc_reader(name);
  message.set_ifc_doors(toString(model.doors));
  message.set_georeference(model.import.georeference);
  message.set_gltf_scene(model.import.gltfScene);
  message.set_ignore_appearance(model.import.ignoreAppearance);
  return message;
}

ModelOptions modelOptionsFromProto(const v1::ModelChoices& message) {
  ModelOptions model;
  if (message.has_metres_per_unit()) model.import.metresPerUnit = message.metres_per_unit();
  model.import.up = scene::parseUpAxis(message.up());
  if (!model.import.up && !message.up().empty())
    throw protocol::mcap::RecordingError("the recording names an unknown up axis: " + message.up());
  if (message.has_offset()) model.import.offset = vectorFromProto(message.offset());
  model.import.ifcReader =
      scene::parseIfcReader(message.ifc_reader()).value_or(scene::IfcReader::automatic);
  model.doors = scene::parseIfcDoors(message.ifc_doors());
  model.import.georeference = message.georeference();
  model.import.gltfScene = message.gltf_scene();
  model.import.ignoreAppearance = !message.has_ignore_appearance() || message.ignore_appearance();
  return model;
}

void requireDifferentFiles(const std::filesystem::path& written,
                           const std::filesystem::path& read) {
  std::error_code ignored;
  if (std::filesystem::equivalent(written, read, ignored))
    throw RecordingError(written.string() +
                         ": this recording is being read; give another file to --record");
}

}  // namespace enfilade::server
