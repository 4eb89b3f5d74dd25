// A model file as a scene, with its progress told.
#pragma once

#include <memory>

#include "scene/scene.hpp"
#include "server/command_line.hpp"

namespace enfilade::server {

/// Throws scene::ImportError.
std::shared_ptr<const scene::Scene> loadScene(const ModelOptions& options);

}  // namespace enfilade::server
