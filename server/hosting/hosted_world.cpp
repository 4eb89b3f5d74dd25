#include "server/hosting/hosted_world.hpp"

#include "server/messages/world_messages.hpp"

namespace enfilade::server {

HostedWorld::HostedWorld(std::shared_ptr<const scene::Scene> sceneToHost,
                         FrameService& frameService, QueryService& queryService,
                         const WorldOptions& options, WorldIdentity worldIdentity)
    : identity(std::move(worldIdentity)),
      scene(std::move(sceneToHost)),
      auditEvery(options.auditEvery),
      replay(options.replay ? std::make_unique<Replay>(options.replay->file, options.replay->run,
                                                       scene, auditEvery)
                            : nullptr),
      world(replay ? replay->seek(options.replay->startTick)
                   : makeInitialWorld(scene, options.settings, auditEvery)),
      frames(frameService),
      queries(queryService),
      limits(options.limits) {
  if (replay) {
    updateActiveContacts(*this, replay->findActiveContactsAt(world));
    branchRecording = options.record;
    status.tick = options.replay->startTick;
  } else if (options.record) {
    world.record(*options.record);
  }
}

scene::World makeInitialWorld(const std::shared_ptr<const scene::Scene>& scene,
                              const scene::WorldSettings& settings, std::uint32_t auditEvery) {
  scene::World world(scene, settings);
  scene::setAuditInterval(world, auditEvery);
  return world;
}

void updateActiveContacts(HostedWorld& hosted, const v1::TickEvents& events) {
  for (const v1::ContactEvent& event : events.contacts()) {
    const std::pair pair{event.a(), event.b()};
    if (event.kind() == v1::ContactEvent::KIND_BEGIN) hosted.activeContacts[pair] = event;
    if (event.kind() == v1::ContactEvent::KIND_END) hosted.activeContacts.erase(pair);
  }
}

namespace {

void broadcastClock(HostedWorld& hosted) {
  v1::ServerMessage message;
  *message.mutable_clock()->mutable_clock() = toProto(hosted.clock);
  message.mutable_clock()->set_tick(hosted.world.snapshot()->tick);
  const Buffer shared = encodeShared(message);
  for (auto& [id, client] : hosted.clients)
    if (client.subscription.clock()) client.out->push(shared);
}

}  // namespace

void publishStatus(HostedWorld& hosted) {
  const bool changed = hosted.status.mode != hosted.clock.mode ||
                       hosted.status.speed != hosted.clock.speed ||
                       hosted.status.hasDriver != hosted.clock.driver.has_value();
  hosted.status.tick = hosted.world.snapshot()->tick;
  hosted.status.mode = hosted.clock.mode;
  hosted.status.speed = hosted.clock.speed;
  hosted.status.hasDriver = hosted.clock.driver.has_value();
  if (changed) broadcastClock(hosted);
}

v1::Clock toProto(const WorldClock& clock) {
  v1::Clock message;
  message.set_mode(clock.mode);
  if (clock.mode == v1::Clock::MODE_FREE_RUN) message.set_speed(clock.speed);
  message.set_has_driver(clock.driver.has_value());
  return message;
}

/// Uses a Drive with velocity 0, which also clears the order queue.
void stopAvatar(HostedWorld& hosted, const std::string& avatar) {
  v1::Command stop;
  stop.set_avatar(avatar);
  stop.mutable_drive()->mutable_velocity();
  hosted.world.submit(stop);
}

void removeClient(HostedWorld& hosted, ClientId id) {
  hosted.viewers.erase(id);
  const auto leaving = hosted.clients.find(id);
  if (leaving == hosted.clients.end()) return;
  hosted.frames.cancel(leaving->second.out);
  hosted.clients.erase(leaving);
  hosted.horizonSelectionChanged = true;
  if (hosted.clock.driver == id) hosted.clock.driver.reset();
  publishStatus(hosted);
  std::erase_if(hosted.owners, [&](const auto& owner) {
    if (owner.second != id) return false;
    stopAvatar(hosted, owner.first);  // an avatar without an owner must not move
    v1::Command leave;
    leave.set_avatar(owner.first);
    leave.mutable_leave();
    hosted.world.submit(leave);
    return true;
  });
}

void sendMessage(Client& client, const v1::ServerMessage& message) {
  if (client.pack && client.pack(message)) return;
  client.out->push(encodeShared(message));
}

void sendError(Client& client, std::uint64_t requestId, v1::Error error) {
  client.out->push(makeErrorReply(requestId, std::move(error)));
}

}  // namespace enfilade::server
