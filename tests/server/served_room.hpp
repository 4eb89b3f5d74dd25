// Test fixture: a real server of the small room in the test's process, and helpers for clients'
// orders.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "protocol/clients/cpp/client.hpp"
#include "server/net/server.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {

class ServedRoom : public ::testing::Test {
 protected:
  void serve(const ServerLimits& limits = {},
             std::shared_ptr<const scene::Scene> scene = makeSmallRoom(), Access access = {}) {
    ServerOptions options;
    options.world.limits = limits;
    options.access = std::move(access);
    server_ =
        std::make_unique<Server>(std::move(scene), HostPort{"127.0.0.1", 0}, std::move(options));
  }
  protocol::Client makeClient(const std::string& name, const std::string& token = "",
                              const std::string& world = "") {
    protocol::ClientOptions options;
    options.name = name;
    options.token = token;
    options.world = world;
    return protocol::Client("127.0.0.1", server_->port(), options);
  }

  std::unique_ptr<Server> server_;
};

/// Whether the server can draw. In CI it must: Mesa's software renderer suffices.
inline bool drawsPictures(const std::string& renderer) {
  const bool draws = !renderer.empty();
  if (!draws && std::getenv("CI") != nullptr)
    ADD_FAILURE() << "no EGL device: install libegl-mesa0 and libgl1-mesa-dri";
  return draws;
}
inline bool drawsPictures(const Server& server) {
  return drawsPictures(server.rendererName());
}

/// Ends the test without a renderer: as skipped, or in CI as failed.
#define ENFILADE_NEED_PICTURES(server) \
  if (!drawsPictures(server)) GTEST_SKIP() << "no EGL device: install libegl-mesa0"

inline v1::Vec3 makeVec(double x, double y, double z) {
  v1::Vec3 v;
  v.set_x(x);
  v.set_y(y);
  v.set_z(z);
  return v;
}

inline v1::Command spawn(const std::string& avatar, double x, double y, double z) {
  v1::Command command;
  command.set_avatar(avatar);
  *command.mutable_spawn()->mutable_at() = makeVec(x, y, z);
  return command;
}

inline v1::Command walkTo(const std::string& avatar, double x, double y, double z) {
  v1::Command command;
  command.set_avatar(avatar);
  *command.mutable_walk()->add_along() = makeVec(x, y, z);
  return command;
}

inline v1::Subscribe makeFullSubscription() {
  v1::Subscribe subscription;
  subscription.set_contacts(true);
  subscription.set_notices(true);
  subscription.set_state(true);
  return subscription;
}

/// All contact events and notices among the received messages.
struct ReceivedEvents {
  std::vector<v1::ContactEvent> contacts;
  std::vector<v1::Notice> notices;

  void add(const std::deque<v1::ServerMessage>& messages) {
    for (const v1::ServerMessage& message : messages) {
      const v1::TickEvents& events = message.events();
      contacts.insert(contacts.end(), events.contacts().begin(), events.contacts().end());
      notices.insert(notices.end(), events.notices().begin(), events.notices().end());
    }
  }
  std::size_t count(v1::ContactEvent::Kind kind) const {
    return static_cast<std::size_t>(
        std::count_if(contacts.begin(), contacts.end(),
                      [&](const v1::ContactEvent& event) { return event.kind() == kind; }));
  }
};

}  // namespace enfilade::server::testing
