// The worlds that one connection steps together (StepMany). In each it is a client of its own.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "server/base/access.hpp"
#include "server/base/server_limits.hpp"
#include "server/hosting/world_directory.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

class WorldGroup {
 public:
  /// `name` and `role`: of the client in all worlds. `directory` must outlive the group. All worlds
  /// together may leave as much unread as one connection.
  WorldGroup(WorldDirectory& directory, std::string name, Role role, const ServerLimits& limits);
  ~WorldGroup();  ///< leaves all worlds
  WorldGroup(const WorldGroup&) = delete;
  WorldGroup& operator=(const WorldGroup&) = delete;

  /// An error of the request as a whole; nullopt: submit() accepts it.
  static std::optional<v1::Error> validate(const v1::StepMany& request, std::uint32_t maxWorlds);
  /// Forwards the requests to their worlds. `done` receives the encoded reply on a thread of the
  /// last world to answer. Call it again only then.
  void submit(const v1::StepMany& request, std::uint64_t requestId,
              std::function<void(EncodedMessage)> done);

 private:
  struct Member;
  struct Memory;
  struct Round;
  std::shared_ptr<Member> enter(const std::string& world);

  WorldDirectory& directory_;
  const std::string name_;
  const Role role_;
  const OutgoingLimits limits_;
  std::map<std::string, std::shared_ptr<Member>> members_;  ///< by world
  std::shared_ptr<Memory> memory_;                          ///< null: not requested yet
};

}  // namespace enfilade::server
