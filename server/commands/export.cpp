#include "server/commands/export.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "protocol/recording/recording.hpp"
#include "scene/model/names.hpp"
#include "server/base/camera_rotation.hpp"
#include "server/base/prepare_folder.hpp"
#include "server/base/standard_output.hpp"
#include "server/commands/camera_track.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/run_report.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kFlushBytes = std::size_t{64} << 10;  // buffered bytes per file

/// A text file that is written to a part file and renamed when complete. It keeps no file open,
/// because a scene may have more bodies than a process may open files.
class TextFileWriter {
 public:
  TextFileWriter(std::filesystem::path file, std::string head)
      : file_(std::move(file)), part_(file_), text_(std::move(head)) {
    part_ += ".part";
    std::filesystem::remove(part_);
  }
  void add(std::string_view text) {
    text_ += text;
    if (text_.size() >= kFlushBytes) flush();
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
                               ": cannot be written; is the disk full, or the folder read-only?");
    text_.clear();
  }
  std::filesystem::path file_, part_;
  std::string text_;
};

std::string formatTumLine(double time, const Vec3& at, const std::array<double, 4>& xyzw) {
  char line[256];
  const int length =
      std::snprintf(line, sizeof line, "%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", time,
                    at.x(), at.y(), at.z(), xyzw[0], xyzw[1], xyzw[2], xyzw[3]);
  return {line, static_cast<std::size_t>(length)};
}

/// Makes the camera of the avatar's eyes.
render::Camera makeEyeCamera(const v1::AvatarState& avatar) {
  scene::AvatarSnapshot view;
  view.footPosition = vectorFromProto(avatar.feet());
  view.viewDirection = vectorFromProto(avatar.gaze());
  view.eyeHeight = avatar.eye_height();
  return render::makeFirstPersonCamera(view, 1, 1);
}

/// Writes the files of one run.
class RunExport {
 public:
  RunExport(std::filesystem::path folder, const v1::RecordingStart& start)
      : folder_(std::move(folder)), offset_(vectorFromProto(start.scene().offset())) {
    prepareFolder(folder_);
    contacts_.emplace(folder_ / "contacts.jsonl", "");
  }

  void add(const v1::TickEvents& events) {
    for (const v1::ContactEvent& event : events.contacts())
      contacts_->add(formatContactLine(event) + "\n");
  }

  void add(const v1::State& state) {
    for (const v1::AvatarState& avatar : state.avatars()) {
      const render::Camera eyes = makeEyeCamera(avatar);
      findText(avatar.name(), folder_, avatars_, "eyes of avatar ")
          .add(formatTumLine(state.time(), eyes.eye, toQuaternion(computeCameraRotation(eyes))));
      findTrack(avatar.name()).add(state.time(), eyes);
    }
    for (const v1::BodyState& body : state.bodies()) {
      const v1::Quaternion& q = body.orientation();
      findText(body.name(), folder_ / "bodies", bodies_, "body ")
          .add(formatTumLine(state.time(), vectorFromProto(body.position()),
                             {q.x(), q.y(), q.z(), q.w()}));
    }
  }

  /// Completes all files and renames them.
  nlohmann::ordered_json finish() {
    contacts_->finish();
    for (auto* texts : {&avatars_, &bodies_})
      for (auto& [name, text] : *texts) text.finish();
    const render::Camera defaultCamera;
    if (!tracks_.empty())
      writeCameras(folder_ / "cameras.glb", tracks_, offset_, defaultCamera.fovY);
    return {{"folder", folder_.string()}, {"avatars", avatars_.size()}, {"bodies", bodies_.size()}};
  }

 private:
  using Texts = std::map<std::string, TextFileWriter>;

  TextFileWriter& findText(const std::string& name, const std::filesystem::path& folder,
                           Texts& texts, const char* what) {
    const auto found = texts.find(name);
    if (found != texts.end()) return found->second;
    std::filesystem::create_directories(folder);
    std::string comment = name;
    std::replace(comment.begin(), comment.end(), '\n', ' ');
    return texts
        .try_emplace(name, folder / (makeFileName(name, folder) + ".tum"),
                     std::string("# ") + what + comment + "\n# time tx ty tz qx qy qz qw\n")
        .first->second;
  }

  /// Makes a file name of letters, digits, '.', '_' and '-'; duplicates get a number.
  std::string makeFileName(const std::string& name, const std::filesystem::path& folder) {
    std::string stem;
    for (const char c : name) stem.push_back(scene::isNameCharacter(c) ? c : '_');
    stem.resize(std::min<std::size_t>(stem.size(), 128));
    std::string uniqueStem = stem;
    for (int number = 2; !taken_.insert(folder / uniqueStem).second; ++number)
      uniqueStem = stem + "-" + std::to_string(number);
    return uniqueStem;
  }

  CameraTrack& findTrack(const std::string& name) {
    const auto [at, isNew] = trackAt_.try_emplace(name, tracks_.size());
    if (isNew) tracks_.emplace_back(name);
    return tracks_[at->second];
  }

  std::filesystem::path folder_;
  Vec3 offset_;
  std::optional<TextFileWriter> contacts_;
  Texts avatars_, bodies_;
  std::set<std::filesystem::path> taken_;
  std::vector<CameraTrack> tracks_;
  std::map<std::string, std::size_t> trackAt_;
};

}  // namespace

ExitCode exportRecording(const ExportCommand& command) {
  protocol::RecordingReader reader(command.recording);
  std::optional<RunExport> files;
  nlohmann::ordered_json report = nlohmann::ordered_json::array();
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (files) report.push_back(files->finish());
      const std::size_t run = report.size() + 1;
      files.emplace(run == 1 ? command.out : command.out / ("run-" + std::to_string(run)), *start);
    }
    if (!files) continue;
    if (const auto* events = std::get_if<v1::TickEvents>(&*item)) files->add(*events);
    if (const auto* state = std::get_if<v1::State>(&*item)) files->add(*state);
  }
  if (!files)
    throw protocol::mcap::RecordingError(command.recording.string() +
                                         ": not a recording of Enfilade");
  report.push_back(files->finish());
  if (!reader.closed())
    logWarning("{}: truncated after byte {}; the data before that is exported",
               command.recording.string(), reader.wholeBytes());
  writeToStdout(report.dump() + "\n", "the files are complete");
  return ExitCode::success;
}

}  // namespace enfilade::server
