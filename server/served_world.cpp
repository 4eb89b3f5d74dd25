#include "server/served_world.hpp"

#include <algorithm>

#include "protocol/framing.hpp"
#include "server/body_messages.hpp"
#include "server/frame_watches.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {

namespace {

bool wants(const v1::Subscribe& subscription, const v1::ContactEvent& event) {
  return event.kind() == v1::ContactEvent::KIND_NEAR ? subscription.near_misses()
                                                     : subscription.contacts();
}

void sendEvents(Client& client, const v1::TickEvents& told) {
  v1::ServerMessage message;
  v1::TickEvents& events = *message.mutable_events();
  for (const v1::ContactEvent& event : told.contacts()) {
    if (wants(client.subscription, event)) *events.add_contacts() = event;
  }
  if (client.subscription.notices()) {
    *events.mutable_notices() = told.notices();
  }
  if (events.contacts().empty() && events.notices().empty()) return;
  events.set_sequence(++client.sequence);
  events.set_tick(told.tick());
  events.set_time(told.time());
  send(client, message);
}

void sendState(ServedWorld& served, Client& client, const scene::Snapshot& snapshot) {
  const double tick = served.world.lengths().tick;
  if (!client.subscription.state() || snapshot.time + tick / 2 < client.nextStateTime) return;
  const double rate = client.subscription.state_rate();
  client.nextStateTime = snapshot.time + (rate > 0 ? 1 / rate : 0);
  if (client.out->dropLatest()) {
    ++client.droppedStates;
    ++served.droppedStates;
  } else {
    client.droppedStates = 0;
  }
  v1::ServerMessage message;
  v1::State& state = *message.mutable_state();
  state.set_tick(snapshot.tick);
  state.set_time(snapshot.time);
  state.set_hash(snapshot.stateHash);
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    *state.add_avatars() = messageOf(served.world, avatar);
  }
  for (const scene::BodyView& body : *snapshot.bodies)
    if (body.displaced || body.moving) *state.add_bodies() = messageOf(served.world, body);
  state.set_dropped(client.droppedStates);
  client.out->pushLatest(encodeShared(message));
}

void finishStep(ServedWorld& served, Client& client, const scene::Snapshot& snapshot) {
  if (!client.step || --client.step->remaining > 0) return;
  v1::ServerMessage message;
  message.set_reply_to(client.step->requestId);
  v1::StepReply& reply = *message.mutable_step();
  reply.set_tick(snapshot.tick);
  reply.set_time(snapshot.time);
  reply.set_state_hash(snapshot.stateHash);
  reply.set_idle(served.idle);
  if (client.step->avatars) {
    for (const scene::AvatarView& avatar : snapshot.avatars) {
      *reply.add_avatars() = messageOf(served.world, avatar);
    }
  }
  client.step.reset();
  send(client, message);
}

void keepLive(ServedWorld& served, const v1::TickEvents& told) {
  for (const v1::ContactEvent& event : told.contacts()) {
    const std::pair pair{event.a(), event.b()};
    if (event.kind() == v1::ContactEvent::KIND_BEGIN) served.live[pair] = event;
    if (event.kind() == v1::ContactEvent::KIND_END) served.live.erase(pair);
  }
}

bool isPresent(const scene::Snapshot& snapshot, const std::string& name) {
  return std::any_of(snapshot.avatars.begin(), snapshot.avatars.end(),
                     [&](const scene::AvatarView& avatar) { return avatar.name == name; });
}

/// A name is free again when its avatar is gone and nothing is queued for it. Without an avatar
/// every tick tells about a queue's next order, so that a tick without a notice shows it empty.
void settleOwners(ServedWorld& served, const std::vector<scene::Notice>& notices) {
  using Kind = scene::Notice::Kind;
  std::set<std::string> told;
  for (const scene::Notice& notice : notices) told.insert(notice.avatar);
  std::erase_if(served.unsettled, [&](const std::string& name) {
    if (told.contains(name)) return false;
    if (!isPresent(*served.world.snapshot(), name)) served.owners.erase(name);
    return true;
  });
  for (const scene::Notice& notice : notices) {
    if (notice.kind == Kind::left || notice.kind == Kind::refused) {
      served.unsettled.insert(notice.avatar);
    }
  }
}

void answerClosing(Client& client, const v1::Bye& farewell) {
  const v1::Error error = errorOf(farewell.code(), farewell.reason());
  if (client.answerUnderWay && client.answerUnderWay->claim())
    sendError(client, client.answerUnderWay->requestId, error);
  if (client.step) sendError(client, client.step->requestId, error);
  for (const WaitingRequest& request : client.waiting) {
    sendError(client, request.message.request_id(), error);
  }
}

void sayGoodbye(Client& client, const v1::Bye& farewell) {
  answerClosing(client, farewell);
  client.out->finish(goodbyeOf(farewell));
}

scene::World atItsBeginning(const std::shared_ptr<const scene::Scene>& scene,
                            const scene::Lengths& lengths, std::uint32_t auditEvery) {
  scene::World world(scene, lengths);
  scene::auditBroadPhase(world, auditEvery);
  return world;
}

}  // namespace

ServedWorld::ServedWorld(std::shared_ptr<const scene::Scene> served, FrameService& frameService,
                         RayService& rayService, const WorldOptions& options, WorldPlace where)
    : place(std::move(where)),
      scene(std::move(served)),
      auditEvery(options.auditEvery),
      world(atItsBeginning(scene, options.lengths, auditEvery)),
      frames(frameService),
      rays(rayService),
      limits(options.limits) {
  if (options.record) world.record(*options.record);
}

Buffer goodbyeOf(const v1::Bye& farewell) {
  v1::ServerMessage message;
  *message.mutable_bye() = farewell;
  return encodeShared(message);
}

void send(Client& client, const v1::ServerMessage& message) {
  client.out->push(encodeShared(message));
}

void sendError(Client& client, std::uint64_t requestId, v1::Error error) {
  v1::ServerMessage message;
  message.set_reply_to(requestId);
  *message.mutable_error() = std::move(error);
  send(client, message);
}

void advance(ServedWorld& served) {
  const auto [report, told] = served.world.tick();
  served.statistics.add(report);
  logFindings(served.world, report);
  served.idle = report.idle;
  publish(served);
  settleOwners(served, report.notices);
  keepLive(served, told);
  for (auto& [id, client] : served.clients) {
    sendEvents(client, told);
    sendState(served, client, *report.snapshot);
    drawWatched(served, id, client);
    finishStep(served, client, *report.snapshot);
  }
  drawRecorded(served);
}

void restartWorld(ServedWorld& served) {
  const v1::TickEvents told =
      served.world.end(v1::ContactEvent::REASON_RESTART, "the world begins anew");
  for (auto& [id, client] : served.clients) {
    sendEvents(client, told);
    client.nextStateTime = 0;
    for (auto& [number, watch] : client.watches) watch.nextTime = 0;
  }
  served.world.beginAnew(atItsBeginning(served.scene, served.world.lengths(), served.auditEvery));
  served.owners.clear();
  served.unsettled.clear();
  served.live.clear();
  served.idle = true;
}

void removeClient(ServedWorld& served, ClientId id) {
  if (served.clients.erase(id) == 0) return;
  if (served.clock.driver == id) served.clock.driver.reset();
  publish(served);
  for (auto owner = served.owners.begin(); owner != served.owners.end();) {
    if (owner->second != id) {
      ++owner;
      continue;
    }
    // Leave queues; Drive first empties the queue, so that nobody walks on without an owner.
    v1::Command stop, leave;
    stop.set_avatar(owner->first);
    stop.mutable_drive()->mutable_velocity();
    served.world.submit(stop);
    leave.set_avatar(owner->first);
    leave.mutable_leave();
    served.world.submit(leave);
    owner = served.owners.erase(owner);
  }
}

void closeWorld(ServedWorld& served) {
  const v1::TickEvents told = served.world.end(v1::ContactEvent::REASON_SHUTDOWN);
  if (!served.farewell) {
    served.farewell.emplace().set_code(v1::ERROR_SHUTTING_DOWN);
    served.farewell->set_reason("the server ends");
  }
  for (auto& [id, client] : served.clients) {
    sendEvents(client, told);
    sayGoodbye(client, *served.farewell);
  }
  served.clients.clear();
  if (WorldRecorder* recorder = served.world.recorder()) recorder->close();
}

void failWorld(ServedWorld& served) {
  for (auto& [id, client] : served.clients) sayGoodbye(client, *served.farewell);
  served.clients.clear();
}

void publish(ServedWorld& served) {
  served.glance.tick = served.world.snapshot()->tick;
  served.glance.mode = served.clock.mode;
  served.glance.speed = served.clock.speed;
  served.glance.driven = served.clock.driver.has_value();
}

}  // namespace enfilade::server
