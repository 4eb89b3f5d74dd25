#include "server/hosting/hosted_world.hpp"

#include <algorithm>
#include <array>

#include "protocol/spliced_message.hpp"
#include "scene/world/contacts/active_contacts.hpp"
#include "server/hosting/frame_subscriptions.hpp"
#include "server/hosting/replay_control.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

/// What one tick tells. All who subscribed to the same get the same bytes, which are made when the
/// first of them wants them: with hundreds of clients this is most of what a tick sends.
struct TickTold {
  const v1::TickEvents& told;                   ///< of everyone
  std::vector<v1::ContactEvent> persists = {};  ///< to be told after those
  std::array<Buffer, 16> events = {};           ///< serialized; by what is subscribed
  Buffer state = {};                            ///< serialized
};

Buffer serialized(const google::protobuf::MessageLite& message) {
  std::vector<std::uint8_t> bytes(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(bytes.data());
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
}

Encoded joined(int field, const std::string& own, const Buffer& shared) {
  return {std::make_shared<const std::vector<std::uint8_t>>(
              protocol::encodeHeadOfJoined(static_cast<std::uint32_t>(field), own, shared->size())),
          shared};
}

bool wants(const v1::Subscribe& subscription, const v1::ContactEvent& event) {
  return event.kind() == v1::ContactEvent::KIND_NEAR ? subscription.near_misses()
                                                     : subscription.contacts();
}

/// TickEvents without its sequence; empty when nothing of what is subscribed happened.
const Buffer& eventsFor(TickTold& tick, const v1::Subscribe& subscription) {
  const std::size_t subscribed =
      (subscription.contacts() ? 1u : 0u) | (subscription.near_misses() ? 2u : 0u) |
      (subscription.notices() ? 4u : 0u) | (subscription.persists() ? 8u : 0u);
  Buffer& bytes = tick.events[subscribed];
  if (bytes) return bytes;
  v1::TickEvents events;
  for (const v1::ContactEvent& event : tick.told.contacts()) {
    if (wants(subscription, event)) *events.add_contacts() = event;
  }
  if (subscription.persists())
    for (const v1::ContactEvent& event : tick.persists) *events.add_contacts() = event;
  if (subscription.notices()) *events.mutable_notices() = tick.told.notices();
  if (!events.contacts().empty() || !events.notices().empty()) {
    events.set_tick(tick.told.tick());
    events.set_time(tick.told.time());
  }
  return bytes = serialized(events);
}

void sendEvents(Client& client, TickTold& told) {
  const Buffer& shared = eventsFor(told, client.subscription);
  if (shared->empty()) return;
  v1::TickEvents own;
  own.set_sequence(++client.sequence);
  client.out->push(joined(v1::ServerMessage::kEventsFieldNumber, own.SerializeAsString(), shared));
}

/// State without what was dropped.
Buffer stateOf(const scene::World& world, const scene::Snapshot& snapshot) {
  v1::State state;
  state.set_tick(snapshot.tick);
  state.set_time(snapshot.time);
  state.set_hash(snapshot.stateHash);
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    *state.add_avatars() = messageOf(world, avatar);
  }
  for (const scene::BodyView& body : *snapshot.bodies)
    if (body.displaced || body.moving) *state.add_bodies() = messageOf(world, body);
  return serialized(state);
}

void sendState(ServedWorld& served, Client& client, const scene::Snapshot& snapshot,
               TickTold& told) {
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
  if (!told.state) told.state = stateOf(served.world, snapshot);
  v1::State own;
  own.set_dropped(client.droppedStates);
  client.out->pushLatest(
      joined(v1::ServerMessage::kStateFieldNumber, own.SerializeAsString(), told.state));
}

void answerStep(ServedWorld& served, Client& client, const scene::Snapshot& snapshot) {
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

/// `stopped`: there are no more ticks.
void finishStep(ServedWorld& served, Client& client, bool stopped) {
  if (!client.step || (client.step->remaining > 0 && !stopped)) return;
  if (client.step->made > 0) return answerStep(served, client, *served.world.snapshot());
  const std::uint64_t id = client.step->requestId;
  client.step.reset();
  sendError(client, id, *replayEnded(served));
}

void keepLive(ServedWorld& served, const v1::TickEvents& told) {
  for (const v1::ContactEvent& event : told.contacts()) {
    const std::pair pair{event.a(), event.b()};
    if (event.kind() == v1::ContactEvent::KIND_BEGIN) served.live[pair] = event;
    if (event.kind() == v1::ContactEvent::KIND_END) served.live.erase(pair);
  }
}

bool anyoneWantsPersists(const ServedWorld& served) {
  return std::any_of(served.clients.begin(), served.clients.end(),
                     [](const auto& one) { return one.second.subscription.persists(); });
}

bool beganInLastTick(const ServedWorld& served, const scene::ContactEvent& contact) {
  const auto begun = served.live.find({contact.a, contact.b});
  return begun != served.live.end() && begun->second.tick() == contact.tick;
}

/// Contacts that live after the last tick and began before it, as they are now. Nothing is looked
/// for when nobody wants them. Call it after keepLive(), which knows when they began.
std::vector<v1::ContactEvent> persistsOf(const ServedWorld& served) {
  std::vector<v1::ContactEvent> persists;
  if (!anyoneWantsPersists(served)) return persists;
  for (const scene::ContactEvent& contact : scene::livingContacts(served.world)) {
    const bool inTrigger = contact.kind == scene::ContactEvent::Kind::enter;
    if (inTrigger || beganInLastTick(served, contact)) continue;
    persists.push_back(messageOf(served.world, contact));
    persists.back().set_kind(v1::ContactEvent::KIND_PERSIST);
  }
  return persists;
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
    if (!request.message.has_bye()) sendError(client, request.message.request_id(), error);
  }
}

void sayGoodbye(Client& client, const v1::Bye& farewell) {
  answerClosing(client, farewell);
  client.out->finish(goodbyeOf(farewell));
}

void tellEveryone(ServedWorld& served, const v1::TickEvents& told) {
  TickTold shared{told};
  for (auto& [id, client] : served.clients) sendEvents(client, shared);
}

void tellTick(ServedWorld& served, const RecordedWorld::Ticked& ticked) {
  const auto& [report, told] = ticked;
  served.statistics.add(report);
  logFindings(served.world, report);
  served.idle = report.idle;
  publish(served);
  settleOwners(served, report.notices);
  keepLive(served, told);
  TickTold shared{told, persistsOf(served)};
  for (auto& [id, client] : served.clients) {
    sendEvents(client, shared);
    sendState(served, client, *report.snapshot, shared);
    drawWatched(served, id, client);
    if (client.step) --client.step->remaining, ++client.step->made;
  }
  drawRecorded(served);
}

void forgetSubscribedTimes(Client& client) {
  client.nextStateTime = 0;
  for (auto& [number, watch] : client.watches) watch.nextTime = 0;
}

/// Nothing more is played until somebody seeks or takes over.
void stopReplay(ServedWorld& served) {
  if (served.clock.mode == v1::Clock::MODE_FREE_RUN) served.clock.mode = v1::Clock::MODE_PAUSED;
  publish(served);
  tellReplay(served);
}

scene::World atItsBeginning(const std::shared_ptr<const scene::Scene>& scene,
                            const scene::Lengths& lengths, std::uint32_t auditEvery) {
  scene::World world(scene, lengths);
  scene::auditBroadPhase(world, auditEvery);
  return world;
}

}  // namespace

ServedWorld::ServedWorld(std::shared_ptr<const scene::Scene> served, FrameService& frameService,
                         QuestionService& questionService, const WorldOptions& options,
                         WorldPlace where)
    : place(std::move(where)),
      scene(std::move(served)),
      auditEvery(options.auditEvery),
      replay(options.replay ? std::make_unique<Replay>(options.replay->file, options.replay->run,
                                                       scene, auditEvery)
                            : nullptr),
      world(replay ? replay->seek(options.replay->from)
                   : atItsBeginning(scene, options.lengths, auditEvery)),
      frames(frameService),
      questions(questionService),
      limits(options.limits) {
  if (replay) {
    keepLive(*this, replay->livingIn(world));
    branchRecording = options.record;
    glance.tick = options.replay->from;
  } else if (options.record) {
    world.record(*options.record);
  }
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
  const auto ticked =
      served.replay ? served.replay->tick(served.world) : std::optional(served.world.tick());
  if (ticked) tellTick(served, *ticked);
  const bool stopped = !ticked || (served.replay && served.replay->atEnd());
  if (stopped) stopReplay(served);
  for (auto& [id, client] : served.clients) finishStep(served, client, stopped);
}

void restartWorld(ServedWorld& served) {
  const v1::TickEvents told =
      served.world.end(v1::ContactEvent::REASON_RESTART, "the world begins anew");
  tellEveryone(served, told);
  for (auto& [id, client] : served.clients) forgetSubscribedTimes(client);
  served.world.beginAnew(atItsBeginning(served.scene, served.world.lengths(), served.auditEvery));
  served.owners.clear();
  served.unsettled.clear();
  served.live.clear();
  served.idle = true;
}

void goTo(ServedWorld& served, scene::World world, const v1::TickEvents& living) {
  tellEveryone(served, served.world.end(v1::ContactEvent::REASON_SEEK));
  served.world.goOnWith(std::move(world));
  served.owners.clear();
  served.unsettled.clear();
  served.live.clear();
  keepLive(served, living);
  publish(served);
  TickTold shared{living};
  for (auto& [id, client] : served.clients) {
    sendEvents(client, shared);
    forgetSubscribedTimes(client);
    for (auto& [number, watch] : client.watches) watch.elsewhere = watch.underWay;
    sendState(served, client, *served.world.snapshot(), shared);
    drawWatched(served, id, client);
  }
}

/// A Drive that stops empties the queue first.
void haltAvatar(ServedWorld& served, const std::string& avatar) {
  v1::Command stop;
  stop.set_avatar(avatar);
  stop.mutable_drive()->mutable_velocity();
  served.world.submit(stop);
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
    haltAvatar(served, owner->first);  // nobody walks on without an owner
    v1::Command leave;
    leave.set_avatar(owner->first);
    leave.mutable_leave();
    served.world.submit(leave);
    owner = served.owners.erase(owner);
  }
}

void closeWorld(ServedWorld& served) {
  const v1::TickEvents told = served.world.end(v1::ContactEvent::REASON_SHUTDOWN);
  tellEveryone(served, told);
  if (!served.farewell) {
    served.farewell.emplace().set_code(v1::ERROR_SHUTTING_DOWN);
    served.farewell->set_reason("the server ends");
  }
  for (auto& [id, client] : served.clients) sayGoodbye(client, *served.farewell);
  served.clients.clear();
  if (WorldRecorder* recorder = served.world.recorder()) recorder->close();
}

void failWorld(ServedWorld& served) {
  for (auto& [id, client] : served.clients) sayGoodbye(client, *served.farewell);
  served.clients.clear();
}

v1::Clock messageOf(const ServedClock& clock) {
  v1::Clock message;
  message.set_mode(clock.mode);
  if (clock.mode == v1::Clock::MODE_FREE_RUN) message.set_speed(clock.speed);
  message.set_has_driver(clock.driver.has_value());
  return message;
}

void publish(ServedWorld& served) {
  served.glance.tick = served.world.snapshot()->tick;
  served.glance.mode = served.clock.mode;
  served.glance.speed = served.clock.speed;
  served.glance.driven = served.clock.driver.has_value();
}

}  // namespace enfilade::server
