// Parser of camera paths in the text format of the TUM RGB-D benchmark.
#pragma once

#include <string>
#include <string_view>

#include "server/capture/path/camera_path.hpp"

namespace enfilade::server {

/// Parses lines `t tx ty tz qx qy qz qw` of the TUM RGB-D benchmark with ascending times. Blank
/// lines and comments after '#' are skipped. `source` names the text in errors. Throws
/// CameraPathError.
CameraPath parseTumPath(std::string_view text, const std::string& source, CameraAxes axes);

}  // namespace enfilade::server
