// Plans the frames of a capture from the file of its path.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Reads the path and plans all frames; a walk script is run in this process. Only the snapshots of
/// `shard` are kept. Throws CameraPathError, protocol::ScriptError, scene::ImportError, and
/// std::invalid_argument for invalid cameras.
CapturePlan planCapture(const std::shared_ptr<const scene::Scene>& scene,
                        const std::filesystem::path& path, const PictureOptions& options,
                        const Shard& shard);

/// The text of a camera path's file. Throws CameraPathError.
std::string readPathFile(const std::filesystem::path& file);

}  // namespace enfilade::server
