// Runs a walk script from its file to its report; the world is in this process (replay) or behind a
// socket (walk).
#pragma once

#include <memory>

#include "protocol/script/script.hpp"
#include "server/app/command_line.hpp"

namespace enfilade::server {

ExitCode replay(const ReplayCommand& command);
ExitCode walk(const WalkCommand& command);

/// How a walk ends that came to its end: a violation is what an audit found, and, if `strict`, a
/// line of the script that did not go as it says.
ExitCode judge(const protocol::ScriptResult& result, const v1::Metrics& metrics, bool strict);

/// Null, and told, where nothing draws and nothing was asked for. Throws render::RenderError.
std::unique_ptr<render::Renderer> rendererOf(const std::shared_ptr<const scene::Scene>& scene,
                                             const DrawingOptions& drawing);

}  // namespace enfilade::server
