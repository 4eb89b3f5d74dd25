#include "server/capture/capture.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "render/service/renderer.hpp"
#include "scene/world/queries/point_in_solid.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/capture/capture_folder.hpp"
#include "server/capture/capture_progress.hpp"
#include "server/capture/depth_reports.hpp"
#include "server/capture/encode_queue.hpp"
#include "server/capture/frame_files.hpp"
#include "server/capture/metadata_files.hpp"
#include "server/capture/overlay.hpp"
#include "server/capture/video.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kEncoders = 2;    // threads
constexpr std::size_t kMostInHand = 6;  // frames between drawing and the disk

/// What a run did, for its summary.
struct CaptureCounts {
  std::size_t frames = 0;   ///< of the whole path
  std::size_t mine = 0;     ///< of those, the shard's
  std::size_t already = 0;  ///< of those, there before
  std::atomic<std::size_t> written{0};
  std::atomic<std::size_t> clamped{0};  ///< pixels
  std::vector<std::size_t> blind;       ///< of the drawn frames, those that show no object
  std::vector<std::size_t> within;      ///< and those whose camera stands in a still solid ...
  std::string firstAround;              ///< ... the first of them in this one: its path
  double seconds = 0;                   ///< of drawing and writing
};

/// A frame whose report is missing is drawn again to be measured; its files come out the same.
bool isDone(const CaptureCommand& command, std::size_t index) {
  const bool reported = !command.run.reportDepth ||
                        std::filesystem::is_regular_file(command.out / depthReportOf(index));
  return reported && isThere(command.out, command.pictures, index);
}

std::vector<std::size_t> missingFrames(const CaptureCommand& command, const ShotList& list,
                                       CaptureCounts& counts) {
  std::vector<std::size_t> missing;
  counts.frames = list.shots.size();
  for (std::size_t i = 0; i < list.shots.size(); ++i) {
    if (!takes(command.run.shard, i)) continue;
    ++counts.mine;
    if (isDone(command, i)) {
      ++counts.already;
    } else {
      missing.push_back(i);
    }
  }
  return missing;
}

render::FrameOptions frameOptions(const Shot& shot, const PictureOptions& options) {
  const CaptureChannels& wanted = options.channels;
  render::FrameOptions frame;
  frame.hidden = shot.hidden;
  const bool marked = options.overlay.any();
  frame.channels = {wanted.rgb || marked, wanted.ids || marked,
                    wanted.depth || wanted.range || marked, wanted.normals};
  frame.glass = options.glass;
  frame.shadows = options.shadows;
  return frame;
}

/// Of pictures with these channels: `automatic` chooses by them, and the manifest must say it
/// before the first frame is drawn.
std::string whoDraws(render::Renderer& renderer, const PictureOptions& options) {
  render::Camera smallest;
  smallest.width = smallest.height = 1;
  return renderer.render({}, smallest, frameOptions({}, options)).renderer;
}

/// As from within a wall, below the ground or beside the scene. False where neither ids nor depth
/// are drawn: then nobody can say.
bool showsNothing(const render::Frame& frame) {
  const auto noId = [](std::uint32_t id) { return id == 0; };
  const auto noDepth = [](float depth) { return std::isnan(depth); };
  if (!frame.ids.empty()) return std::all_of(frame.ids.begin(), frame.ids.end(), noId);
  return !frame.depth.empty() && std::all_of(frame.depth.begin(), frame.depth.end(), noDepth);
}

/// From within a solid its back faces are seen, and what lies behind them: a picture like others.
void notice(const scene::Scene& scene, const Shot& shot, std::size_t index,
            const render::Frame& frame, CaptureCounts& counts) {
  if (showsNothing(frame)) counts.blind.push_back(index);
  const scene::EntityId around = solidAround(scene, shot.camera.eye);
  if (around == 0) return;
  if (counts.within.empty()) counts.firstAround = scene.model().objects[around - 1].path;
  counts.within.push_back(index);
}

/// Draws on this thread; others encode and write meanwhile.
void takePictures(const CaptureCommand& command, const scene::Scene& scene, const ShotList& list,
                  const std::vector<std::size_t>& missing, render::Renderer& renderer,
                  DepthReports* reports, CaptureCounts& counts) {
  CaptureMeter meter(command.run.progress, missing.size());
  EncodeQueue queue(kEncoders, kMostInHand);
  for (const std::size_t index : missing) {
    if (interrupted()) break;
    const Shot& shot = list.shots[index];
    render::FrameOptions options = frameOptions(shot, command.pictures);
    options.channels.depth |= reports != nullptr;
    auto frame = std::make_shared<const render::Frame>(
        renderer.render(*shot.snapshot, shot.camera, options));
    if (reports) reports->measure(index, *frame, *shot.snapshot, options);
    notice(scene, shot, index, *frame, counts);
    queue.post([&, index, frame = std::move(frame)] {
      const auto overlay = [&](const render::Frame& drawn) {
        return drawOverlay(drawn, command.pictures.overlay, scene.model(), list, list.shots[index]);
      };
      counts.clamped += writeFrame(command.out, command.pictures, index, *frame, overlay).clamped;
      ++counts.written;
    });
    meter.show(counts.written);
  }
  queue.finish();
  meter.finish(counts.written);
  if (reports) reports->finish(command.run.shard);
  if (interrupted()) throw Interrupted{};
}

bool wholeSetIsThere(const CaptureCommand& command, const ShotList& list) {
  for (std::size_t i = 0; i < list.shots.size(); ++i)
    if (!isThere(command.out, command.pictures, i)) return false;
  return true;
}

/// The film's file, or why there is none.
Json videoOf(const CaptureCommand& command, const ShotList& list) {
  if (!command.run.mp4 || !command.pictures.channels.rgb || list.shots.size() < 2) return nullptr;
  if (!wholeSetIsThere(command, list)) {
    spdlog::info("no video: the other shards' frames are not in this folder yet");
    return nullptr;
  }
  const VideoResult video = makeVideo(command.out, list.shots, command.pictures);
  if (video.made) return "video.mp4";
  spdlog::info("no video: {}", video.why);
  return nullptr;
}

void tellSummary(const CaptureCommand& command, const CaptureCounts& counts, std::size_t wentWrong,
                 const std::string& renderer, const Json& video) {
  Json summary;
  summary["out"] = command.out.string();
  summary["frames"] = counts.frames;
  summary["shard"] =
      std::to_string(command.run.shard.index) + "/" + std::to_string(command.run.shard.count);
  summary["written"] = counts.written.load();
  summary["already_there"] = counts.already;
  summary["clamped_pixels"] = counts.clamped.load();
  summary["blind_frames"] = counts.blind;
  summary["frames_within_solids"] = counts.within;
  summary["went_wrong"] = wentWrong;
  summary["seconds"] = counts.seconds;
  summary["frames_per_s"] =
      counts.seconds > 0 ? static_cast<double>(counts.written) / counts.seconds : 0.0;
  summary["renderer"] = renderer;
  summary["video"] = video;
  writeToStdout(summary.dump() + "\n", "the pictures are whole");
}

void tellPlan(const CaptureCommand& command, const ShotList& list, const CaptureCounts& counts) {
  const render::Camera& camera = list.shots.front().camera;
  Json plan;
  plan["frames"] = counts.frames;
  plan["shard_frames"] = counts.mine;
  plan["already_there"] = counts.already;
  plan["width"] = camera.width;
  plan["height"] = camera.height;
  plan["seconds_of_path"] = list.shots.back().time - list.shots.front().time;
  plan["files_a_frame"] = filesOfFrame(command.pictures, 0).size();
  writeToStdout(plan.dump() + "\n");
}

ExitCode run(const CaptureCommand& command) {
  // A file beyond the shell's limit is then an error of write(), not the end of the process.
  std::signal(SIGXFSZ, SIG_IGN);
  if (!command.run.dryRun) prepareFolder(command.out);
  const std::shared_ptr<const scene::Scene> scene = loadScene(command.model);
  if (interrupted()) throw Interrupted{};
  const ShotList list = planShots(scene, command.path, command.pictures, command.run.shard);
  for (const std::string& note : list.notes) spdlog::warn("path: {}", note);
  CaptureCounts counts;
  if (command.run.dryRun) {
    missingFrames(command, list, counts);
    tellPlan(command, list, counts);
    return ExitCode::done;
  }
  render::Renderer renderer(scene, command.pictures.renderer, command.device);
  const std::string drawnBy = whoDraws(renderer, command.pictures);
  claimFolder(command.out, command.pictures,
              manifestJson(*scene, command.path, command.pictures, renderer.deviceName()));
  writeDocuments(command.out, *scene, list, command.pictures);
  const std::vector<std::size_t> missing = missingFrames(command, list, counts);
  if (counts.already > 0)
    spdlog::info("{} of {} frames are there already", counts.already, counts.mine);
  const auto start = Clock::now();
  std::optional<DepthReports> reports;
  if (command.run.reportDepth && !missing.empty()) reports.emplace(command.out, scene);
  try {
    takePictures(command, *scene, list, missing, renderer, reports ? &*reports : nullptr, counts);
  } catch (...) {
    disclaimFolder(command.out);
    throw;
  }
  counts.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  if (counts.clamped > 0)
    spdlog::warn("{} pixels of depth are farther than 16 bits hold, and were written as 65535",
                 counts.clamped.load());
  if (!counts.blind.empty())
    spdlog::warn(
        "{} frames show nothing at all, the first of them frame {}: does the camera stand "
        "in a wall, below the floor or beside the scene?",
        counts.blind.size(), counts.blind.front());
  if (!counts.within.empty())
    spdlog::warn(
        "{} frames are seen from within a solid, the first of them frame {}: its camera stands in "
        "\"{}\"",
        counts.within.size(), counts.within.front(), counts.firstAround);
  tellSummary(command, counts, list.wentWrong, drawnBy, videoOf(command, list));
  const bool asTold = counts.blind.empty() && counts.within.empty() && list.wentWrong == 0;
  return asTold || !command.run.strict ? ExitCode::done : ExitCode::violations;
}

}  // namespace

ExitCode capture(const CaptureCommand& command) {
  return interruptible([&] { return run(command); },
                       "the frames that are there are whole; the same command goes on from there");
}

}  // namespace enfilade::server
