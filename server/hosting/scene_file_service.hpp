// Makes the GLB file of a scene at its first request, on a thread of its own, and keeps it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/base/work_thread.hpp"

namespace enfilade::server {

/// A file that is complete in memory. Shared by all its receivers.
struct SceneFile {
  /// Null: the file could not be made, and `error` says why.
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  /// "HASH-CONTENT" in hexadecimal digits: the scene's hash, which covers what decides contact, and
  /// a hash of the bytes, which also covers names and colours.
  std::string tag;
  std::string error;
};

enum class SceneFileKind : std::uint8_t {
  glb,
  gzip,        ///< the GLB file, compressed
  viewerScene  ///< a foxglove.SceneUpdate with the GLB file without bodies
};

class SceneFileService {
 public:
  explicit SceneFileService(std::shared_ptr<const scene::Scene> scene);

  /// `done` receives the file on the service's thread. Requests during the making wait for the same
  /// file.
  void request(SceneFileKind kind, std::function<void(const SceneFile&)> done);
  /// Waits for all requests. Make no requests afterwards.
  void finish() { thread_.finish(); }

 private:
  const SceneFile& provide(SceneFileKind kind);

  const std::shared_ptr<const scene::Scene> scene_;
  // Only on the thread.
  SceneFile plain_, compressed_, viewerScene_;
  WorkThread thread_;  // last member: it uses the others
};

}  // namespace enfilade::server
