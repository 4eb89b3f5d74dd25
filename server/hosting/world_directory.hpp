// WorldDirectory: interface to the worlds of a server, for the requests of clients.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "server/base/access.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

/// A client's request for a new world; "" lets the server choose.
struct CreateWorldRequest {
  std::string name;
  std::string scene;
  bool dropWhenEmpty = false;
};

/// Takes a message to a client in another form, on the world's thread; false: send it as it is.
using MessagePacker = std::function<bool(const v1::ServerMessage&)>;

/// A client in a world, until its destruction.
class WorldMembership {
 public:
  virtual ~WorldMembership() = default;
  /// Queues the requests. Returns the work that answers them, for work(); it may be run after the
  /// membership's end.
  virtual std::function<void()> receive(std::vector<v1::ClientMessage> messages) = 0;
};

/// Lists, creates, drops and enters worlds. Callable from any thread.
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
  /// Enters a world as a client, whose messages go to `out`, first its Welcome with reply_to = 0.
  /// Null: there is no such world.
  virtual std::unique_ptr<WorldMembership> join(const std::string& world, const std::string& name,
                                                Role role, std::shared_ptr<OutgoingQueue> out,
                                                MessagePacker pack) = 0;
  /// Lets the worlds of several receive() answer, on all processors. Does not wait.
  virtual void work(std::vector<std::function<void()>> received) = 0;
};

}  // namespace enfilade::server
