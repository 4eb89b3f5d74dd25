#include "server/capture/video.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>

extern char** environ;

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

constexpr double kMinFps = 1, kMaxFps = 120;  // frames per second

double computeFps(const std::vector<CaptureFrame>& captureFrames, double fallback) {
  const double seconds = captureFrames.back().time - captureFrames.front().time;
  if (!(seconds > 0)) return fallback;
  return std::clamp(static_cast<double>(captureFrames.size() - 1) / seconds, kMinFps, kMaxFps);
}

std::vector<std::string> makeCommand(const fs::path& folder, const fs::path& into, double fps,
                                     const PictureOptions& options) {
  std::array<char, 32> rate{};
  std::snprintf(rate.data(), rate.size(), "%.6g", fps);
  const std::string frames = options.rgb == RgbFile::jpeg ? "%06d.jpg" : "%06d.png";
  return {"ffmpeg",
          "-nostdin",
          "-loglevel",
          "error",
          "-y",
          "-framerate",
          rate.data(),
          "-start_number",
          "0",
          "-i",
          (folder / "rgb" / frames).string(),
          "-vf",
          "pad=ceil(iw/2)*2:ceil(ih/2)*2",  // H.264 in yuv420p needs even sizes
          "-c:v",
          "libx264",
          "-crf",
          "18",
          "-pix_fmt",
          "yuv420p",
          "-movflags",
          "+faststart",
          "-f",
          "mp4",
          into.string()};
}

/// Runs a command without output. Returns its exit status; 127: not found; -1: killed.
int runQuietly(std::vector<std::string> command) {
  std::vector<char*> argv;
  for (std::string& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  pid_t child = -1;
  const int failed = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return 127;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

VideoResult makeVideo(const fs::path& folder, const std::vector<CaptureFrame>& captureFrames,
                      const PictureOptions& options) {
  const fs::path file = folder / "video.mp4";
  const fs::path part = folder / ("video.mp4.part-" + std::to_string(::getpid()) + "-0");
  const int status =
      runQuietly(makeCommand(folder, part, computeFps(captureFrames, options.fps), options));
  std::error_code error;
  if (status == 0) fs::rename(part, file, error);
  if (status == 0 && !error) return {true, ""};
  std::error_code ignored;
  fs::remove(part, ignored);
  if (status == 127) return {false, "ffmpeg is missing; install it and run the same command again"};
  if (status != 0) return {false, "ffmpeg failed (" + std::to_string(status) + ")"};
  return {false, "cannot write " + file.string() + ": " + error.message()};
}

}  // namespace enfilade::server
