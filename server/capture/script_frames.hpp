// A walk script as a camera path: the views of its avatars.
#pragma once

#include <filesystem>
#include <memory>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Runs the script in a new world. Cameras get the pose of the avatar's eyes, without a lens.
/// Throws protocol::ScriptError, and CameraPathError for no frames or too many frames.
CapturePlan planScriptFrames(const std::shared_ptr<const scene::Scene>& scene,
                             const std::filesystem::path& script, const PictureOptions& options,
                             const Shard& shard);

}  // namespace enfilade::server
