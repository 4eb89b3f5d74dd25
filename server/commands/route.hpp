// `enfilade route SCENE FROM TO`: a proved path, its length, its steps and its narrowest place.
#pragma once

#include <filesystem>
#include <string>

#include "scene/navigation/links.hpp"
#include "scene/world/data/world_settings.hpp"
#include "server/base/exit_code.hpp"
#include "server/base/load_scene.hpp"

namespace enfilade::server {

struct RouteCommand {
  ModelOptions model;
  std::string from, to;  ///< "x,y,z" in metres, or the name of a room, storey, object or body
  scene::NavigationAgent agent;
  scene::WorldSettings settings;
  scene::PathOptions links;
  bool doorsAsTheyAre = false;  ///< else all doors that move are open
  bool json = false;
  std::filesystem::path plan;  ///< picture of the path; empty: none
};

/// Returns ExitCode::violations if there is no path. Throws scene::ImportError and
/// std::runtime_error.
ExitCode route(const RouteCommand& command);

}  // namespace enfilade::server
