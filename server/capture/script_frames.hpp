// A walk script as a camera path: what its avatars see, when.
#pragma once

#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

/// Runs the script in a world of its own. Cameras have the avatar's eyes and no lens yet. Throws
/// protocol::ScriptError; CameraPathError when no picture comes of it or more are kept than fit.
ShotList walkShots(const std::shared_ptr<const scene::Scene>& scene,
                   const std::filesystem::path& script, const PictureOptions& options,
                   const Shard& shard);

}  // namespace enfilade::server
