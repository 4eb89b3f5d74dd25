// Parser of camera paths in JSON: a list of poses, or nerfstudio's transforms.json (CAPTURE.md).
#pragma once

#include <string>
#include <string_view>

#include "server/capture/path/camera_path.hpp"

namespace enfilade::server {

/// Parses a list of poses, or an object with `frames` (nerfstudio's transforms.json); see
/// CAPTURE.md. Poses without times are spaced by 1/`fps` s. Throws CameraPathError.
CameraPath parseJsonPath(std::string_view text, const std::string& source, CameraAxes axes,
                         double fps);

}  // namespace enfilade::server
