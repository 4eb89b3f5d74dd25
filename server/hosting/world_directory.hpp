// The worlds of a server, as a client's request uses them.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"

namespace enfilade::server {

/// A client's request for a new world; "" lets the server choose.
struct CreateWorldRequest {
  std::string name;
  std::string scene;
  bool dropWhenEmpty = false;
};

/// Lists, creates and drops worlds. Callable from any thread.
class WorldDirectory {
 public:
  virtual ~WorldDirectory() = default;
  virtual std::vector<std::string> sceneNames() const = 0;
  virtual v1::WorldList makeWorldList() const = 0;
  /// Creates a world. `done` receives the world or an error, on a thread of the directory.
  virtual void create(CreateWorldRequest request,
                      std::function<void(std::variant<v1::World, v1::Error>)> done) = 0;
  /// Drops a world and calls `done` after its end. If the request comes from that world itself
  /// (`requestingWorld`), `done` is called before the end, so that the reply can be sent.
  virtual void drop(const std::string& name, const std::string& requestingWorld,
                    std::function<void(std::optional<v1::Error>)> done) = 0;
};

}  // namespace enfilade::server
