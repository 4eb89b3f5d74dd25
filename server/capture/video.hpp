// Video of a capture's frames, made by ffmpeg if installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

struct VideoResult {
  bool created = false;
  std::string reason;  ///< reason for a missing video
};

/// Makes FOLDER/video.mp4 (H.264) from the rgb/ frames at the mean frame rate of the path. The
/// file is written atomically. Failures of ffmpeg are returned, not thrown.
VideoResult makeVideo(const std::filesystem::path& folder,
                      const std::vector<CaptureFrame>& captureFrames,
                      const PictureOptions& options);

}  // namespace enfilade::server
