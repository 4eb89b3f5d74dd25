// `enfilade export SCENE --glb FILE`: writes a scene as binary glTF for other programs.
#pragma once

#include <filesystem>

#include "server/base/exit_code.hpp"
#include "server/base/load_scene.hpp"

namespace enfilade::server {

struct ExportSceneCommand {
  ModelOptions model;
  std::filesystem::path glb;
};

/// Throws scene::ImportError, and std::runtime_error for a file that is not writable.
ExitCode exportScene(const ExportSceneCommand& command);

}  // namespace enfilade::server
