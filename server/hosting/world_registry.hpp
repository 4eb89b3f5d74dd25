// The worlds of one server, made and dropped while it runs: each with a thread, a clock and clients
// of its own. Worlds of one scene share it, and who draws it and answers questions about it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/base/work_thread.hpp"
#include "server/hosting/frame_service.hpp"
#include "server/hosting/query_service.hpp"
#include "server/hosting/tick_loop.hpp"

namespace enfilade::server {

/// The world that a server begins with, and that lasts as long as it does.
inline constexpr const char* kMainWorld = "main";

/// A scene, and what answers about it for all its worlds.
struct ServedScene {
  ServedScene(std::string sceneName, std::shared_ptr<const scene::Scene> served,
              const DrawingOptions& drawing);

  const std::string name;  ///< as Welcome.scenes tells it
  const std::shared_ptr<const scene::Scene> scene;
  FrameService frames;
  QuestionService questions;
};

/// What a client asks for; "" lets the server choose.
struct WorldToMake {
  std::string name;
  std::string scene;
  bool dropWhenEmpty = false;
};

class Worlds {
 public:
  /// `main` of the first scene, and one world of each other scene. Throws RenderError: as
  /// FrameService.
  Worlds(const std::vector<std::shared_ptr<const scene::Scene>>& scenes,
         const WorldOptions& options, const DrawingOptions& drawing);
  ~Worlds();  ///< stops
  Worlds(const Worlds&) = delete;
  Worlds& operator=(const Worlds&) = delete;

  // All of these may be called from any thread.

  /// "" is the main world. Null: there is none of this name.
  std::shared_ptr<TickLoop> find(const std::string& name) const;
  TickLoop& mainWorld() const { return *main_; }
  /// The main world first, then by name.
  std::vector<std::shared_ptr<TickLoop>> all() const;
  v1::WorldList list() const;
  std::vector<std::string> sceneNames() const;
  /// The server ends, and all worlds with it.
  bool stopping() const;
  /// Of all scenes: FrameService::prepare().
  void prepareFrames();
  /// Of the first scene; "" without a renderer.
  const std::string& rendererName() const { return scenes_.front()->frames.deviceName(); }

  /// `done` is called on a thread of the worlds' own, with the world, or why there is none.
  void create(WorldToMake wanted, std::function<void(std::variant<v1::World, v1::Error>)> done);
  /// `done` is called when the world has ended; before that when it is asked out of the world
  /// itself, `askedIn`, so that the answer gets through.
  void drop(const std::string& name, const std::string& askedIn,
            std::function<void(std::optional<v1::Error>)> done);

  /// Ends all worlds. Later calls do nothing.
  void stop();
  /// Waits for what draws and answers for the worlds; after stop(), and when nobody asks any more.
  void finishServices();
  /// Of all ticks of all worlds, dropped ones among them. Only after stop().
  AuditTotals auditTotals() const { return audit_; }

 private:
  using World = std::shared_ptr<TickLoop>;

  bool give(std::function<void()> work);
  std::variant<v1::World, v1::Error> make(WorldToMake wanted);
  World start(const std::string& name, ServedScene& scene, bool dropWhenEmpty);
  std::optional<v1::Error> problemOf(const WorldToMake& wanted) const;
  std::string freeName(const std::string& stem) const;
  ServedScene* sceneNamed(const std::string& name) const;
  std::variant<World, v1::Error> takeOut(const std::string& name);
  void dropIfEmpty(const std::string& name, const World& world, const std::string& why);
  void end(TickLoop& world, v1::ErrorCode code, const std::string& reason);

  const WorldOptions options_;
  std::vector<std::unique_ptr<ServedScene>> scenes_;  ///< never changes once made
  mutable std::mutex mutex_;                          ///< guards what follows
  std::map<std::string, World> worlds_;               ///< changed by the thread, and at both ends
  World main_;                                        ///< never changes once made
  bool stopping_ = false;
  AuditTotals audit_;  ///< the thread's, then stop()'s
  WorkThread thread_;  ///< makes and drops; last: it uses the others
};

}  // namespace enfilade::server
