#include "server/hosting/scene_file_service.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "scene/model/hasher.hpp"
#include "server/export/gzip.hpp"
#include "server/export/scene_glb.hpp"

namespace enfilade::server {
namespace {

using FileBytes = std::vector<std::uint8_t>;

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

SceneFile makeSceneFile(const scene::Scene& scene) {
  const auto start = std::chrono::steady_clock::now();
  SceneGlb glb = writeSceneGlb(scene);
  SceneFile file;
  file.bytes = std::make_shared<const FileBytes>(std::move(glb.bytes));
  file.tag = fmt::format("{:016x}-{:016x}", scene.hash(), hashContent(*file.bytes));
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  spdlog::info("scene.glb: {} entities, {} triangles, {} draw calls, {:.1f} MB in {:.2f} s",
               glb.entities, glb.triangles, glb.drawGroups,
               static_cast<double>(file.bytes->size()) / 1e6, seconds.count());
  return file;
}

}  // namespace

SceneFileService::SceneFileService(std::shared_ptr<const scene::Scene> scene)
    : scene_(std::move(scene)) {}

void SceneFileService::request(bool compressed, std::function<void(const SceneFile&)> done) {
  thread_.post([this, compressed, done = std::move(done)] {
    try {
      done(provide(compressed));
    } catch (const std::exception& error) {  // too large, or no memory
      spdlog::error("scene.glb: {}", error.what());
      done({nullptr, "", error.what()});
    }
  });
}

const SceneFile& SceneFileService::provide(bool compressed) {
  if (!plain_.bytes) plain_ = makeSceneFile(*scene_);
  if (!compressed) return plain_;
  if (!compressed_.bytes)
    compressed_ = {std::make_shared<const FileBytes>(gzip(*plain_.bytes)), plain_.tag, ""};
  return compressed_;
}

}  // namespace enfilade::server
