#include "server/commands/export_scene.hpp"

#include <nlohmann/json.hpp>

#include "render/image/atomic_file.hpp"
#include "server/base/standard_output.hpp"
#include "server/export/scene_glb.hpp"

namespace enfilade::server {

ExitCode exportScene(const ExportSceneCommand& command) {
  const auto scene = loadScene(command.model);
  const SceneGlb glb = writeSceneGlb(*scene);
  render::writeFileAtomically(command.glb, glb.bytes.data(), glb.bytes.size());
  const nlohmann::ordered_json report{{"file", command.glb.string()},
                                      {"bytes", glb.bytes.size()},
                                      {"objects", glb.entities},
                                      {"triangles", glb.triangles},
                                      {"draw_calls", glb.drawGroups}};
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  writeToStdout(report.dump(-1, ' ', false, replace) + "\n", "the file is complete");
  return ExitCode::success;
}

}  // namespace enfilade::server
