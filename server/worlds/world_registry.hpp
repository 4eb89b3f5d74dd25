// The worlds of one server, created and dropped at run time. Each world has its own thread, clock
// and clients. Worlds of the same scene share the scene and its frame and query services.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/base/work_thread.hpp"
#include "server/hosting/frame_service.hpp"
#include "server/hosting/query_service.hpp"
#include "server/hosting/scene_file_service.hpp"
#include "server/hosting/world_directory.hpp"
#include "server/worlds/tick_loop.hpp"
#include "server/worlds/work_pool.hpp"

namespace enfilade::server {

/// The name of the first world, which lives as long as the server.
inline constexpr const char* kMainWorld = "main";

/// A scene with the services that all its worlds share.
struct HostedScene {
  HostedScene(std::string sceneName, std::shared_ptr<const scene::Scene> sceneToHost,
              const DrawingOptions& drawing);

  const std::string name;  ///< as in Welcome.scenes
  const std::shared_ptr<const scene::Scene> scene;
  FrameService frames;
  QueryService queries;
  SceneFileService file;
};

/// Creates, finds and drops worlds.
class WorldRegistry : public WorldDirectory {
 public:
  /// Creates "main" from the first scene, and one world for each other scene. Throws RenderError,
  /// like FrameService.
  WorldRegistry(const std::vector<std::shared_ptr<const scene::Scene>>& scenes,
                const WorldOptions& options, const DrawingOptions& drawing);
  ~WorldRegistry() override;  ///< calls stop()
  WorldRegistry(const WorldRegistry&) = delete;
  WorldRegistry& operator=(const WorldRegistry&) = delete;

  // Callable from any thread.

  /// Finds a world by name; "" is the main world. Null: unknown name.
  std::shared_ptr<TickLoop> find(const std::string& name) const;
  TickLoop& mainWorld() const { return *mainWorld_; }
  /// The file of the world's scene. Lives as long as the registry.
  SceneFileService& getSceneFile(const TickLoop& world) const;
  /// The main world first, then by name.
  std::vector<std::shared_ptr<TickLoop>> allWorlds() const;
  v1::WorldList makeWorldList() const override;
  std::vector<std::string> sceneNames() const override;
  /// Whether the server is stopping, and all worlds with it.
  bool isStopping() const;
  /// Calls FrameService::prepare() for all scenes.
  void prepareFrames();
  /// The renderer of the first scene; "" without a renderer.
  const std::string& rendererName() const { return scenes_.front()->frames.deviceName(); }

  void create(CreateWorldRequest request,
              std::function<void(std::variant<v1::World, v1::Error>)> done) override;
  void drop(const std::string& name, const std::string& requestingWorld,
            std::function<void(std::optional<v1::Error>)> done) override;
  std::unique_ptr<WorldMembership> join(const std::string& world, const std::string& name,
                                        Role role, std::shared_ptr<OutgoingQueue> out,
                                        MessagePacker pack) override;
  void work(std::vector<std::function<void()>> received) override;

  /// Ends all worlds. Later calls do nothing.
  void stop();
  /// Waits for the frame and query services. Call it after stop(), when no more requests can come.
  void finishServices();
  /// Totals of all worlds, including dropped ones. Only after stop().
  AuditTotals auditTotals() const { return auditTotals_; }

 private:
  using TickLoopPtr = std::shared_ptr<TickLoop>;

  bool postWork(std::function<void()> work);
  std::variant<v1::World, v1::Error> createNow(CreateWorldRequest request);
  TickLoopPtr startWorld(const std::string& name, HostedScene& scene, bool dropWhenEmpty);
  std::optional<v1::Error> validateRequest(const CreateWorldRequest& request) const;
  std::string makeUniqueWorldName(const std::string& stem) const;
  HostedScene* findScene(const std::string& name) const;
  std::variant<TickLoopPtr, v1::Error> remove(const std::string& name);
  void dropIfEmpty(const std::string& name, const TickLoopPtr& world, const std::string& cause);
  void endWorld(TickLoop& world, v1::ErrorCode code, const std::string& reason);

  const WorldOptions options_;
  std::vector<std::unique_ptr<HostedScene>> scenes_;  ///< constant after construction
  mutable std::mutex mutex_;                          ///< guards the members below
  std::map<std::string, TickLoopPtr> worlds_;         ///< changed by the thread and at both ends
  TickLoopPtr mainWorld_;                             ///< constant after construction
  bool stopping_ = false;
  AuditTotals auditTotals_;  ///< used by the thread, after it by stop()
  WorkPool workers_;         ///< answer requests to worlds whose threads are at rest
  WorkThread thread_;        ///< creates and drops worlds; last member: it uses the others
};

}  // namespace enfilade::server
