// `enfilade inspect`: what is in a scene, what is wrong with it, and plans of its storeys.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// Throws scene::ImportError, render::RenderError for plans that cannot be drawn.
ExitCode inspect(const InspectCommand& command);

}  // namespace enfilade::server
