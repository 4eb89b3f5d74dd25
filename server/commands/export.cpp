#include "server/commands/export.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "protocol/recording/recording.hpp"
#include "server/base/standard_output.hpp"
#include "server/capture/path/camera_path.hpp"
#include "server/capture/path/camera_track.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/run_report.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kKept = std::size_t{64} << 10;  // bytes of a file before they are written

/// A text that grows beside its place and takes it when it is whole. Holds no file open: a scene
/// may have more bodies than a process may have files.
class GrowingText {
 public:
  GrowingText(std::filesystem::path file, std::string head)
      : file_(std::move(file)), part_(file_), text_(std::move(head)) {
    part_ += ".part";
    std::filesystem::remove(part_);
  }
  void add(std::string_view text) {
    text_ += text;
    if (text_.size() >= kKept) flush();
  }
  void finish() {
    flush();
    std::filesystem::rename(part_, file_);
  }

 private:
  void flush() {
    std::ofstream stream(part_, std::ios::binary | std::ios::app);
    stream.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    stream.close();
    if (!stream)
      throw std::runtime_error(part_.string() +
                               ": cannot be written; is the disk full, or the folder another's?");
    text_.clear();
  }
  std::filesystem::path file_, part_;
  std::string text_;
};

std::string tumLine(double time, const Vec3& at, const std::array<double, 4>& xyzw) {
  char line[256];
  const int length =
      std::snprintf(line, sizeof line, "%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", time,
                    at.x(), at.y(), at.z(), xyzw[0], xyzw[1], xyzw[2], xyzw[3]);
  return {line, static_cast<std::size_t>(length)};
}

/// As pictures from the avatar's eyes are taken.
render::Camera eyesOf(const v1::AvatarState& avatar) {
  scene::AvatarView view;
  view.feet = vectorFrom(avatar.feet());
  view.gaze = vectorFrom(avatar.gaze());
  view.eyeHeight = avatar.eye_height();
  return render::firstPerson(view, 1, 1);
}

/// The files of one run.
class RunFiles {
 public:
  RunFiles(std::filesystem::path folder, const v1::RecordingStart& start)
      : folder_(std::move(folder)), offset_(vectorFrom(start.scene().offset())) {
    std::filesystem::create_directories(folder_);
    contacts_.emplace(folder_ / "contacts.jsonl", "");
  }

  void add(const v1::TickEvents& events) {
    for (const v1::ContactEvent& event : events.contacts())
      contacts_->add(contactLine(event) + "\n");
  }

  void add(const v1::State& state) {
    for (const v1::AvatarState& avatar : state.avatars()) {
      const render::Camera eyes = eyesOf(avatar);
      textOf(avatar.name(), folder_, avatars_, "eyes of avatar ")
          .add(tumLine(state.time(), eyes.eye, quaternionOf(turnedOf(eyes))));
      trackOf(avatar.name()).add(state.time(), eyes);
    }
    for (const v1::BodyState& body : state.bodies()) {
      const v1::Quaternion& q = body.orientation();
      textOf(body.name(), folder_ / "bodies", bodies_, "body ")
          .add(tumLine(state.time(), vectorFrom(body.position()), {q.x(), q.y(), q.z(), q.w()}));
    }
  }

  /// Every file takes its place.
  nlohmann::ordered_json finish() {
    contacts_->finish();
    for (auto* texts : {&avatars_, &bodies_})
      for (auto& [name, text] : *texts) text.finish();
    const render::Camera usual;
    if (!tracks_.empty()) writeCameras(folder_ / "cameras.glb", tracks_, offset_, usual.fovY);
    return {{"folder", folder_.string()}, {"avatars", avatars_.size()}, {"bodies", bodies_.size()}};
  }

 private:
  using Texts = std::map<std::string, GrowingText>;

  GrowingText& textOf(const std::string& name, const std::filesystem::path& folder, Texts& texts,
                      const char* what) {
    const auto found = texts.find(name);
    if (found != texts.end()) return found->second;
    std::filesystem::create_directories(folder);
    std::string comment = name;
    std::replace(comment.begin(), comment.end(), '\n', ' ');
    return texts
        .try_emplace(name, folder / (fileNameOf(name, folder) + ".tum"),
                     std::string("# ") + what + comment + "\n# time tx ty tz qx qy qz qw\n")
        .first->second;
  }

  /// Letters, digits, '.', '_' and '-' as they are; a name that is taken gets a number.
  std::string fileNameOf(const std::string& name, const std::filesystem::path& folder) {
    std::string stem;
    for (const char c : name) {
      const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                         (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
      stem.push_back(plain ? c : '_');
    }
    stem.resize(std::min<std::size_t>(stem.size(), 128));
    std::string free = stem;
    for (int number = 2; !taken_.insert(folder / free).second; ++number)
      free = stem + "-" + std::to_string(number);
    return free;
  }

  CameraTrack& trackOf(const std::string& name) {
    const auto [at, isNew] = trackAt_.try_emplace(name, tracks_.size());
    if (isNew) tracks_.emplace_back(name);
    return tracks_[at->second];
  }

  std::filesystem::path folder_;
  Vec3 offset_;
  std::optional<GrowingText> contacts_;
  Texts avatars_, bodies_;
  std::set<std::filesystem::path> taken_;
  std::vector<CameraTrack> tracks_;
  std::map<std::string, std::size_t> trackAt_;
};

}  // namespace

ExitCode exportRecording(const ExportCommand& command) {
  protocol::RecordingReader reader(command.recording);
  std::optional<RunFiles> files;
  nlohmann::ordered_json told = nlohmann::ordered_json::array();
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (files) told.push_back(files->finish());
      const std::size_t run = told.size() + 1;
      files.emplace(run == 1 ? command.out : command.out / ("run-" + std::to_string(run)), *start);
    }
    if (!files) continue;
    if (const auto* events = std::get_if<v1::TickEvents>(&*item)) files->add(*events);
    if (const auto* state = std::get_if<v1::State>(&*item)) files->add(*state);
  }
  if (!files)
    throw protocol::mcap::RecordingError(command.recording.string() +
                                         ": no recording of Enfilade begins in it");
  told.push_back(files->finish());
  if (!reader.closed())
    spdlog::warn("{}: it was cut off after byte {}; what comes before is exported",
                 command.recording.string(), reader.wholeBytes());
  writeToStdout(told.dump() + "\n", "the files are whole");
  return ExitCode::done;
}

}  // namespace enfilade::server
