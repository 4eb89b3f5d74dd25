#include "server/commands/export_replay.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocol/foxglove.pb.h"
#include "protocol/framing.hpp"
#include "protocol/recording/recording.hpp"
#include "render/image/atomic_file.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/standard_output.hpp"
#include "server/base/version.hpp"
#include "server/commands/replay_html.hpp"
#include "server/export/base64.hpp"
#include "server/export/gzip.hpp"
#include "server/export/scene_glb.hpp"
#include "server/log/log.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/net/page_files.hpp"
#include "server/recording/world_from_recording.hpp"
#include "server/recording/world_recorder.hpp"

namespace enfilade::server {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Json = nlohmann::ordered_json;
using protocol::mcap::RecordingError;

constexpr double kMegabyte = 1e6;  // bytes

/// One run of a recording as a server would send it.
struct ExportedRun {
  v1::RecordingStart start;
  std::uint64_t firstTick = 0, lastTick = 0;
  std::size_t contacts = 0;
  Bytes messages;  ///< events and states, in the protocol's framing
};

void append(Bytes& bytes, const v1::ServerMessage& message) {
  const Bytes encoded = protocol::encode(message);
  bytes.insert(bytes.end(), encoded.begin(), encoded.end());
}

/// The state without what the page does not show.
v1::State reduceState(const v1::State& state) {
  v1::State reduced = state;
  for (v1::AvatarState& avatar : *reduced.mutable_avatars()) {
    v1::MoveResult move;
    *move.mutable_made() = avatar.move().made();
    move.set_stopped_by_name(avatar.move().stopped_by_name());
    *avatar.mutable_move() = std::move(move);
  }
  return reduced;
}

void addItem(const protocol::RecordedItem& item, ExportedRun& run) {
  v1::ServerMessage message;
  if (const auto* start = std::get_if<v1::RecordingStart>(&item)) {
    run.start = *start;
    run.firstTick = run.lastTick = start->parent().tick();
  } else if (const auto* events = std::get_if<v1::TickEvents>(&item)) {
    *message.mutable_events() = *events;
    for (const v1::ContactEvent& event : events->contacts())
      run.contacts += event.kind() == v1::ContactEvent::KIND_BEGIN ? 1 : 0;
    append(run.messages, message);
  } else if (const auto* state = std::get_if<v1::State>(&item)) {
    *message.mutable_state() = reduceState(*state);
    run.lastTick = state->tick();
    append(run.messages, message);
  }
}

ExportedRun readRun(const ExportReplayCommand& command) {
  protocol::RecordingReader reader(command.recording, command.run);
  ExportedRun run;
  bool found = false;
  while (const auto item = reader.next()) {
    found = true;
    addItem(*item, run);
  }
  if (!found) throw RecordingError(command.recording.string() + ": not a recording of Enfilade");
  if (!reader.complete())
    logWarning("{}: truncated after byte {}; the data before that is exported",
               command.recording.string(), reader.wholeBytes());
  return run;
}

v1::ServerMessage makeWelcome(const ExportedRun& run, const scene::Scene& scene,
                              const std::string& file) {
  const auto settings = settingsFromProto(run.start.lengths());
  if (!settings) throw RecordingError(file + ": the recorded settings are not valid");
  v1::ServerMessage message;
  v1::Welcome& welcome = *message.mutable_welcome();
  welcome.set_protocol_version(protocol::kVersion);
  welcome.set_server_version(kServerVersion);
  *welcome.mutable_scene() = toProto(scene);
  *welcome.mutable_policies() = toProto(*settings);
  welcome.set_role(v1::ROLE_DRIVE);  // of the recording's clock
  welcome.set_world(file);
  welcome.set_tick(run.firstTick);
  v1::Clock& clock = *welcome.mutable_clock();
  clock.set_mode(v1::Clock::MODE_PAUSED);
  v1::Replay& replay = *welcome.mutable_replay();
  replay.set_file(file);
  replay.set_first_tick(run.firstTick);
  replay.set_last_tick(run.lastTick);
  replay.set_tick(run.firstTick);
  *replay.mutable_clock() = clock;
  return message;
}

/// The pictures of the run from the channels for viewers. Times continue from run to run there.
Json readPictures(const ExportReplayCommand& command, double tickSeconds) {
  protocol::mcap::Reader reader(command.recording);
  Json pictures = Json::array();
  std::uint32_t run = 0;
  double runStart = 0;
  while (const auto message = reader.next()) {
    const std::string& topic = message->channel->topic;
    const double time = static_cast<double>(message->time) * 1e-9;
    if (topic == protocol::kStartTopic) {
      ++run;
      runStart = run == 1 ? 0 : time;
    }
    const std::string prefix = "/frames/", suffix = "/image";
    if (run != command.run || !topic.starts_with(prefix) || !topic.ends_with(suffix)) continue;
    foxglove::CompressedImage image;
    if (!image.ParseFromArray(message->data.data(), static_cast<int>(message->data.size())))
      throw RecordingError(command.recording.string() + ": an image cannot be read");
    const auto* data = reinterpret_cast<const std::uint8_t*>(image.data().data());
    pictures.push_back(
        {{"avatar", topic.substr(prefix.size(), topic.size() - prefix.size() - suffix.size())},
         {"tick", std::llround((time - runStart) / tickSeconds)},
         {"time", time - runStart},
         {"format", image.format()},
         {"data", encodeBase64({data, image.data().size()})}});
  }
  return pictures;
}

std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string makeNonce() {
  std::random_device random;
  Bytes bytes(18);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return encodeBase64(bytes);
}

class ReplayExport {
 public:
  explicit ReplayExport(const ExportReplayCommand& command)
      : command_(command), page_(readReplayPage(findPageFolder())), run_(readRun(command)) {
    scene_ = loadScene(makeRecordedModelOptions(run_.start, command.scene, command.cache));
    if (scene_->hash() != run_.start.scene().hash())
      throw std::runtime_error(scene_->model().source +
                               ": not the recorded model, or changed since: the walk would pass "
                               "through walls; give the recorded one as `export SCENE RECORDING`");
    Bytes all;
    append(all, makeWelcome(run_, *scene_, command.recording.filename().string()));
    all.insert(all.end(), run_.messages.begin(), run_.messages.end());
    messages_ = gzip(all);
    pictures_ = readPictures(command, settingsFromProto(run_.start.lengths())->tickDuration);
  }

  /// Leaves out textures, then pictures, until the file is within the limit.
  ExitCode write() {
    for (const bool withTextures : {true, false}) {
      setScene(withTextures);
      if (fits(assemble())) return finish();
    }
    if (!pictures_.empty()) {
      leftOut_.push_back(fmt::format("{} pictures", pictures_.size()));
      pictures_ = Json::array();
      if (fits(assemble())) return finish();
    }
    throw std::runtime_error(fmt::format(
        "the file would have {:.1f} MB, more than --max-size {:g}: the model has {:.1f} MB and the "
        "walk {:.1f} MB, compressed; give a larger --max-size",
        static_cast<double>(html_.size()) / kMegabyte, command_.maxMegabytes,
        static_cast<double>(sceneBytes_.size()) / kMegabyte,
        static_cast<double>(messages_.size()) / kMegabyte));
  }

 private:
  void setScene(bool withTextures) {
    const bool hasTextures = !scene_->model().textures.empty();
    if (!withTextures && !hasTextures) return;
    if (!withTextures) leftOut_.push_back("textures");
    const SceneGlb glb = writeSceneGlb(*scene_, {.textures = withTextures});
    sceneBytes_ = gzip(glb.bytes);
  }

  const std::string& assemble() {
    const std::string recording = command_.recording.filename().string();
    const auto& model = scene_->model();
    const std::string file = model.source.substr(model.source.find_last_of('/') + 1);
    const double seconds = static_cast<double>(run_.lastTick - run_.firstTick) *
                           settingsFromProto(run_.start.lengths())->tickDuration;
    Json about = Json::array();
    const auto add = [&](const char* name, const std::string& value) {
      about.push_back({name, value});
    };
    add("Recording", recording);
    add("Model", file);
    add("Objects", std::to_string(model.objects.size()));
    add("Duration",
        fmt::format("{:.1f} s, ticks {} to {}", seconds, run_.firstTick, run_.lastTick));
    add("Contacts", std::to_string(run_.contacts));
    if (!leftOut_.empty()) add("Left out", fmt::format("{}", fmt::join(leftOut_, ", ")));
    add("Made by", formatVersion());
    html_ = makeReplayHtml(
        page_, {file + " – " + recording, sceneBytes_, messages_, dump(pictures_), dump(about)},
        makeNonce());
    return html_;
  }

  bool fits(const std::string& html) const {
    return static_cast<double>(html.size()) <= command_.maxMegabytes * kMegabyte;
  }

  ExitCode finish() {
    render::writeFileAtomically(command_.html, html_);
    if (!leftOut_.empty())
      logWarning("left out to keep within {:g} MB: {}", command_.maxMegabytes,
                 fmt::join(leftOut_, ", "));
    const Json report{{"file", command_.html.string()},
                      {"bytes", html_.size()},
                      {"model_bytes", sceneBytes_.size()},
                      {"walk_bytes", messages_.size()},
                      {"page_bytes", page_.script.size() + page_.style.size()},
                      {"pictures", pictures_.size()},
                      {"ticks", run_.lastTick - run_.firstTick},
                      {"left_out", leftOut_}};
    writeToStdout(dump(report) + "\n", "the file is complete");
    return ExitCode::success;
  }

  const ExportReplayCommand& command_;
  const ReplayPage page_;
  const ExportedRun run_;
  std::shared_ptr<const scene::Scene> scene_;
  Bytes messages_, sceneBytes_;  ///< compressed
  Json pictures_;
  std::vector<std::string> leftOut_;
  std::string html_;
};

}  // namespace

ExitCode exportReplay(const ExportReplayCommand& command) {
  return ReplayExport(command).write();
}

}  // namespace enfilade::server
