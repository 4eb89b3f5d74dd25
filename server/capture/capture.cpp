#include "server/capture/capture.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "render/service/renderer_selector.hpp"
#include "scene/world/queries/point_in_solid.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/prepare_folder.hpp"
#include "server/base/signal_handling.hpp"
#include "server/base/standard_output.hpp"
#include "server/capture/capture_folder.hpp"
#include "server/capture/capture_plan.hpp"
#include "server/capture/capture_progress.hpp"
#include "server/capture/depth_reports.hpp"
#include "server/capture/encode_queue.hpp"
#include "server/capture/frame_files.hpp"
#include "server/capture/metadata_files.hpp"
#include "server/capture/overlay.hpp"
#include "server/capture/video.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kEncoderThreads = 2;    // threads
constexpr std::size_t kMaxPendingFrames = 6;  // frames between the renderer and the disk

/// Counters of a capture run for its summary.
struct CaptureCounts {
  std::size_t frames = 0;    ///< frames of the whole path
  std::size_t inShard = 0;   ///< frames of this shard
  std::size_t existing = 0;  ///< frames of this shard that existed before
  std::atomic<std::size_t> written{0};
  std::atomic<std::size_t> clampedPixels{0};    ///< pixels of depth beyond 16 bits
  std::vector<std::size_t> blankFrames;         ///< rendered frames that show no object
  std::vector<std::size_t> framesInsideSolids;  ///< frames whose camera is inside a static solid
  std::string firstSolid;                       ///< path of the solid of the first such frame
  double seconds = 0;                           ///< rendering and writing
};

/// True if the frame's files exist. A frame without its depth report is rendered and measured
/// again.
bool isFrameDone(const CaptureCommand& command, std::size_t index) {
  const bool reported = !command.run.reportDepth ||
                        std::filesystem::is_regular_file(command.out / makeDepthReportPath(index));
  return reported && isFrameComplete(command.out, command.pictures, index);
}

std::vector<std::size_t> findMissingFrames(const CaptureCommand& command, const CapturePlan& plan,
                                           CaptureCounts& counts) {
  std::vector<std::size_t> missing;
  counts.frames = plan.frames.size();
  for (std::size_t i = 0; i < plan.frames.size(); ++i) {
    if (!isInShard(command.run.shard, i)) continue;
    ++counts.inShard;
    if (isFrameDone(command, i)) {
      ++counts.existing;
    } else {
      missing.push_back(i);
    }
  }
  return missing;
}

render::FrameOptions makeFrameOptions(const CaptureFrame& captureFrame,
                                      const PictureOptions& options) {
  const CaptureChannels& wanted = options.channels;
  render::FrameOptions frame;
  frame.hiddenEntity = captureFrame.hiddenAvatar;
  const bool marked = options.overlay.any();
  frame.channels = {wanted.rgb || marked, wanted.ids || wanted.classes || wanted.things || marked,
                    wanted.depth || wanted.range || marked, wanted.normals};
  frame.transparency = options.glass;
  frame.avatars = options.avatars;
  frame.shadows = options.shadows;
  frame.samples = options.samples;
  return frame;
}

/// True if the frame shows no object, for example from inside a wall or outside the scene. False if
/// neither ids nor depth are rendered, because the state is then unknown.
bool isBlank(const render::Frame& frame) {
  const auto noId = [](std::uint32_t id) { return id == 0; };
  const auto noDepth = [](float depth) { return std::isnan(depth); };
  if (!frame.ids.empty()) return std::all_of(frame.ids.begin(), frame.ids.end(), noId);
  return !frame.depth.empty() && std::all_of(frame.depth.begin(), frame.depth.end(), noDepth);
}

/// Records blank frames and cameras inside solids. Inside a solid the frame shows its back faces,
/// so that it looks valid.
void checkFrame(const scene::Scene& scene, const CaptureFrame& captureFrame, std::size_t index,
                const render::Frame& frame, CaptureCounts& counts) {
  if (isBlank(frame)) counts.blankFrames.push_back(index);
  const scene::EntityId solid = findObjectContaining(scene, captureFrame.camera.eye);
  if (solid == 0) return;
  if (counts.framesInsideSolids.empty()) counts.firstSolid = scene.model().objects[solid - 1].path;
  counts.framesInsideSolids.push_back(index);
}

/// The end of the frames from `from` on that are rendered together.
std::size_t findGroupEnd(const CapturePlan& plan, const std::vector<std::size_t>& missing,
                         std::size_t from) {
  std::size_t pixels = 0, end = from;
  for (; end < missing.size(); ++end) {
    pixels += render::countPixels(plan.frames[missing[end]].camera);
    if (end > from && pixels > render::kMaxPixelsTogether) break;
  }
  return end;
}

/// Renders on this thread; worker threads encode and write.
void renderFrames(const CaptureCommand& command, const scene::Scene& scene, const CapturePlan& plan,
                  const std::vector<std::size_t>& missing, render::RendererSelector& renderer,
                  DepthReports* reports, CaptureCounts& counts) {
  CaptureProgress progress(command.run.progress, missing.size());
  EncodeQueue queue(kEncoderThreads, kMaxPendingFrames);
  for (std::size_t from = 0; from < missing.size() && !isInterrupted();) {
    const std::size_t to = findGroupEnd(plan, missing, from);
    std::vector<render::RenderRequest> requests;
    for (std::size_t i = from; i < to; ++i) {
      const CaptureFrame& captureFrame = plan.frames[missing[i]];
      render::FrameOptions options = makeFrameOptions(captureFrame, command.pictures);
      options.channels.depth |= reports != nullptr;
      requests.push_back({captureFrame.snapshot, {captureFrame.camera, options}});
    }
    std::vector<render::Frame> frames = renderer.render(requests);
    for (std::size_t i = from; i < to; ++i) {
      const std::size_t index = missing[i];
      const CaptureFrame& captureFrame = plan.frames[index];
      const auto frame = std::make_shared<const render::Frame>(std::move(frames[i - from]));
      if (reports)
        reports->measure(index, *frame, *captureFrame.snapshot, requests[i - from].view.options);
      checkFrame(scene, captureFrame, index, *frame, counts);
      queue.post([&, index, frame] {
        const auto overlay = [&](const render::Frame& drawn) {
          return drawOverlay(drawn, command.pictures.overlay, scene.model(), scene.objectClasses(),
                             plan, plan.frames[index]);
        };
        counts.clampedPixels +=
            writeFrame(command.out, command.pictures, index, *frame, scene.objectClasses(), overlay)
                .clamped;
        ++counts.written;
      });
      progress.update(counts.written);
    }
    from = to;
  }
  queue.finish();
  progress.finish(counts.written);
  if (reports) reports->finish(command.run.shard);
  if (isInterrupted()) throw Interrupted{};
}

bool isCaptureComplete(const CaptureCommand& command, const CapturePlan& plan) {
  for (std::size_t i = 0; i < plan.frames.size(); ++i)
    if (!isFrameComplete(command.out, command.pictures, i)) return false;
  return true;
}

/// Makes the video; returns its file name, or the reason for a missing video.
Json makeVideoReport(const CaptureCommand& command, const CapturePlan& plan) {
  if (!command.run.mp4 || !command.pictures.channels.rgb || plan.frames.size() < 2) return nullptr;
  if (!isCaptureComplete(command, plan)) {
    logInfo("no video: frames of other shards are missing in this folder");
    return nullptr;
  }
  const VideoResult video = makeVideo(command.out, plan.frames, command.pictures);
  if (video.created) return "video.mp4";
  logInfo("no video: {}", video.reason);
  return nullptr;
}

void printSummary(const CaptureCommand& command, const CaptureCounts& counts,
                  std::size_t failedOrders, const std::string& renderer, const Json& video) {
  Json summary;
  summary["out"] = command.out.string();
  summary["frames"] = counts.frames;
  summary["shard"] =
      std::to_string(command.run.shard.index) + "/" + std::to_string(command.run.shard.count);
  summary["written"] = counts.written.load();
  summary["already_there"] = counts.existing;
  summary["clamped_pixels"] = counts.clampedPixels.load();
  summary["blind_frames"] = counts.blankFrames;
  summary["frames_within_solids"] = counts.framesInsideSolids;
  summary["went_wrong"] = failedOrders;
  summary["seconds"] = counts.seconds;
  summary["frames_per_s"] =
      counts.seconds > 0 ? static_cast<double>(counts.written) / counts.seconds : 0.0;
  summary["renderer"] = renderer;
  summary["video"] = video;
  writeToStdout(summary.dump() + "\n", "the pictures are complete");
}

void printPlan(const CaptureCommand& command, const CapturePlan& plan,
               const CaptureCounts& counts) {
  const render::Camera& camera = plan.frames.front().camera;
  Json planJson;
  planJson["frames"] = counts.frames;
  planJson["shard_frames"] = counts.inShard;
  planJson["already_there"] = counts.existing;
  planJson["width"] = camera.width;
  planJson["height"] = camera.height;
  planJson["seconds_of_path"] = plan.frames.back().time - plan.frames.front().time;
  planJson["files_a_frame"] = listFrameFiles(command.pictures, 0).size();
  writeToStdout(planJson.dump() + "\n");
}

ExitCode runCapture(const CaptureCommand& command) {
  // A file beyond the shell's limit then causes a write error and does not kill the process.
  std::signal(SIGXFSZ, SIG_IGN);
  if (!command.run.dryRun) prepareFolder(command.out);
  readPathFile(command.path);  // a wrong path is reported before the model is read
  const std::shared_ptr<const scene::Scene> scene = loadScene(command.model);
  if (isInterrupted()) throw Interrupted{};
  const CapturePlan plan = planCapture(scene, command.path, command.pictures, command.run.shard);
  for (const std::string& note : plan.notes) logWarning("path: {}", note);
  CaptureCounts counts;
  if (command.run.dryRun) {
    findMissingFrames(command, plan, counts);
    printPlan(command, plan, counts);
    return ExitCode::success;
  }
  render::RendererSelector renderer(scene, command.pictures.renderer, command.device);
  const std::string rendererName = renderer.deviceNameFor(
      plan.frames.front().camera, makeFrameOptions(plan.frames.front(), command.pictures));
  claimFolder(command.out, command.pictures,
              makeManifest(*scene, command.path, command.pictures, rendererName));
  writeMetadataFiles(command.out, *scene, plan, command.pictures);
  const std::vector<std::size_t> missing = findMissingFrames(command, plan, counts);
  if (counts.existing > 0)
    logInfo("{} of {} frames exist already", counts.existing, counts.inShard);
  const auto start = Clock::now();
  std::optional<DepthReports> reports;
  if (command.run.reportDepth && !missing.empty()) reports.emplace(command.out, scene);
  try {
    renderFrames(command, *scene, plan, missing, renderer, reports ? &*reports : nullptr, counts);
  } catch (...) {
    releaseFolder(command.out);
    throw;
  }
  counts.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  if (counts.clampedPixels > 0)
    logWarning("{} depth pixels exceed the 16-bit range and were written as 65535",
               counts.clampedPixels.load());
  if (!counts.blankFrames.empty())
    logWarning(
        "{} frames show no object, the first is frame {}: is the camera inside a wall, below "
        "the floor or outside the scene?",
        counts.blankFrames.size(), counts.blankFrames.front());
  if (!counts.framesInsideSolids.empty())
    logWarning(
        "{} frames are taken from inside a solid, the first is frame {}: its camera is inside "
        "\"{}\"",
        counts.framesInsideSolids.size(), counts.framesInsideSolids.front(), counts.firstSolid);
  printSummary(command, counts, plan.failedOrders, rendererName, makeVideoReport(command, plan));
  const bool succeeded =
      counts.blankFrames.empty() && counts.framesInsideSolids.empty() && plan.failedOrders == 0;
  return succeeded || !command.run.strict ? ExitCode::success : ExitCode::violations;
}

}  // namespace

ExitCode capture(const CaptureCommand& command) {
  return runInterruptible(
      [&] { return runCapture(command); },
      "the existing frames are complete; the same command continues from there");
}

}  // namespace enfilade::server
