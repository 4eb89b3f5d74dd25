// The frames of a capture as a film, by ffmpeg where there is one.
#pragma once

#include <filesystem>
#include <string>

#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

struct VideoResult {
  bool made = false;
  std::string why;  ///< there is none, for a person
};

/// Makes FOLDER/video.mp4 (H.264) of its rgb/ frames at the path's own mean speed; the file appears
/// whole. Never throws for what ffmpeg cannot: that is told.
VideoResult makeVideo(const std::filesystem::path& folder, const std::vector<Shot>& shots,
                      const PictureOptions& options);

}  // namespace enfilade::server
