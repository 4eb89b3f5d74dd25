#include "server/hosting/scene_file_service.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include "scene/model/hasher.hpp"
#include "server/export/gzip.hpp"
#include "server/export/scene_glb.hpp"
#include "server/log/log.hpp"
#include "server/recording/foxglove/primitives.hpp"

namespace enfilade::server {
namespace {

using FileBytes = std::vector<std::uint8_t>;

constexpr std::size_t kMaxViewerModelBytes = std::size_t{1} << 30;  // protobuf ends at 2 GiB

std::uint64_t hashContent(const FileBytes& bytes) {
  scene::Hasher hasher;
  hasher.add(std::uint64_t{bytes.size()});
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min(sizeof word, bytes.size() - i));
    hasher.add(word);
  }
  return hasher.value();
}

SceneFile makeSceneFile(const scene::Scene& scene, const GlbContent& content) {
  const auto start = std::chrono::steady_clock::now();
  SceneGlb glb = writeSceneGlb(scene, content);
  SceneFile file;
  file.bytes = std::make_shared<const FileBytes>(std::move(glb.bytes));
  file.tag = fmt::format("{:016x}-{:016x}", scene.hash(), hashContent(*file.bytes));
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  logInfo("scene.glb: {} entities, {} triangles, {} draw calls, {:.1f} MB in {:.2f} s",
          glb.entities, glb.triangles, glb.drawGroups,
          static_cast<double>(file.bytes->size()) / 1e6, seconds.count());
  return file;
}

SceneFile makeViewerScene(const scene::Scene& scene) {
  const SceneFile file = makeSceneFile(scene, {.bodies = false});
  if (file.bytes->size() > kMaxViewerModelBytes)
    throw std::runtime_error("it has more than 1 GiB, the limit of viewers' messages");
  foxglove::SceneUpdate update;
  *update.add_entities() = makeModelEntity(*file.bytes);
  FileBytes bytes(update.ByteSizeLong());
  update.SerializeWithCachedSizesToArray(bytes.data());
  return {std::make_shared<const FileBytes>(std::move(bytes)), "", ""};
}

}  // namespace

SceneFileService::SceneFileService(std::shared_ptr<const scene::Scene> scene)
    : scene_(std::move(scene)) {}

void SceneFileService::request(SceneFileKind kind, std::function<void(const SceneFile&)> done) {
  thread_.post([this, kind, done = std::move(done)] {
    try {
      done(provide(kind));
    } catch (const std::exception& error) {  // too large, or no memory
      logError("scene.glb: {}", error.what());
      done({nullptr, "", error.what()});
    }
  });
}

const SceneFile& SceneFileService::provide(SceneFileKind kind) {
  if (kind == SceneFileKind::viewerScene) {
    if (!viewerScene_.bytes) viewerScene_ = makeViewerScene(*scene_);
    return viewerScene_;
  }
  if (!plain_.bytes) plain_ = makeSceneFile(*scene_, {});
  if (kind == SceneFileKind::glb) return plain_;
  if (!compressed_.bytes)
    compressed_ = {std::make_shared<const FileBytes>(gzip(*plain_.bytes)), plain_.tag, ""};
  return compressed_;
}

}  // namespace enfilade::server
