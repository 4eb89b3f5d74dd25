#include "server/hosting/requests.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "protocol/framing.hpp"
#include "server/base/version.hpp"
#include "server/hosting/frame_subscriptions.hpp"
#include "server/hosting/replay_control.hpp"
#include "server/hosting/world_registry.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

/// One request on its way to its answer.
struct Asked {
  ServedWorld& served;
  ClientId id;
  Client& client;
  const v1::ClientMessage& message;
};

std::uint64_t lastTick(const ServedWorld& served) {
  return served.world.snapshot()->tick;
}

void reply(const Asked& asked, v1::ServerMessage message) {
  message.set_reply_to(asked.message.request_id());
  send(asked.client, message);
}

void replyError(const Asked& asked, v1::Error error) {
  sendError(asked.client, asked.message.request_id(), std::move(error));
}

// ---- commands ----------------------------------------------------------------------------------

/// Who walks on from a recording belongs to nobody until somebody takes it over.
std::optional<v1::Error> recordedProblem(const ServedWorld& served, const std::string& avatar) {
  if (!served.replay || !avatarNamed(*served.world.snapshot(), avatar)) return std::nullopt;
  return errorOf(v1::ERROR_NOT_ALLOWED,
                 "avatar '" + avatar + "' is the recording's: TakeOver makes it yours", "avatar");
}

std::optional<v1::Error> ownershipProblem(const Asked& asked, const v1::Command& command) {
  const auto owner = asked.served.owners.find(command.avatar());
  if (owner == asked.served.owners.end()) return recordedProblem(asked.served, command.avatar());
  if (owner->second == asked.id) return std::nullopt;
  return errorOf(v1::ERROR_NOT_ALLOWED,
                 "avatar '" + command.avatar() + "' belongs to another client: take another name",
                 "avatar");
}

std::optional<v1::Error> limitProblem(const Asked& asked, const v1::Command& command) {
  const ServerLimits& limits = asked.served.limits;
  const auto most = static_cast<int>(limits.waypoints);
  if (command.has_walk() && command.walk().along_size() > most) {
    return errorOf(v1::ERROR_TOO_LARGE,
                   "walk.along has " + std::to_string(command.walk().along_size()) +
                       " way points; give at most " + std::to_string(most),
                   "walk.along");
  }
  const bool isNew = command.has_spawn() && !asked.served.owners.contains(command.avatar());
  if (isNew && asked.served.owners.size() >= limits.avatars) {
    return errorOf(
        v1::ERROR_TOO_LARGE,
        "the world has its " + std::to_string(limits.avatars) + " avatars: wait until one leaves",
        "spawn");
  }
  return std::nullopt;
}

std::optional<v1::Error> submitCommand(const Asked& asked, const v1::Command& command) {
  if (auto problem = onlyReplayed(asked.served)) return problem;
  if (auto problem = ownershipProblem(asked, command)) return problem;
  if (auto problem = limitProblem(asked, command)) return problem;
  if (auto refused = asked.served.world.submit(command)) return refused;
  if (command.has_spawn()) {
    asked.served.owners[command.avatar()] = asked.id;
    asked.served.unsettled.insert(command.avatar());
  }
  return std::nullopt;
}

void replyCommand(const Asked& asked, std::optional<v1::Error> error) {
  v1::ServerMessage message;
  v1::CommandReply& body = *message.mutable_command();
  body.set_accepted(!error);
  if (error) {
    *body.mutable_error() = std::move(*error);
  } else {
    body.set_tick(lastTick(asked.served) + 1);
  }
  reply(asked, std::move(message));
}

void answer(const Asked& asked, const v1::Command& command) {
  replyCommand(asked, submitCommand(asked, command));
}

void answer(const Asked& asked, const v1::BodyCommand& command) {
  auto problem = onlyReplayed(asked.served);
  replyCommand(asked, problem ? std::move(problem) : asked.served.world.submit(command));
}

// ---- time --------------------------------------------------------------------------------------

/// Makes the client the driver where there is none.
bool takeClock(const Asked& asked) {
  std::optional<ClientId>& driver = asked.served.clock.driver;
  if (!driver) driver = asked.id;
  publish(asked.served);
  if (driver == asked.id) return true;
  replyError(asked, errorOf(v1::ERROR_NOT_ALLOWED,
                            "another client drives the clock: wait until it leaves"));
  return false;
}

void answer(const Asked& asked, const v1::Step& step) {
  const std::uint32_t most = asked.served.limits.ticksPerStep;
  if (step.ticks() < 1 || step.ticks() > most) {
    return replyError(asked, errorOf(v1::ERROR_BAD_MESSAGE,
                                     "step.ticks = " + std::to_string(step.ticks()) +
                                         ": give 1 to " + std::to_string(most),
                                     "step.ticks"));
  }
  if (asked.served.clock.mode != v1::Clock::MODE_LOCKSTEP) {
    return replyError(asked, errorOf(v1::ERROR_NOT_ALLOWED,
                                     "the clock is not in lockstep: set it to lockstep first"));
  }
  if (!takeClock(asked)) return;
  if (auto ended = replayEnded(asked.served)) return replyError(asked, std::move(*ended));
  asked.client.step = {asked.message.request_id(), step.ticks(), step.avatars()};
}

void answer(const Asked& asked, const v1::SetClock& wanted) {
  constexpr double kSlowest = 1e-3, kFastest = 1000;
  const double speed = wanted.free_run().speed();
  if (wanted.mode_case() == v1::SetClock::MODE_NOT_SET) {
    return replyError(
        asked, errorOf(v1::ERROR_BAD_MESSAGE, "mode is missing: give lockstep, free_run or pause",
                       "set_clock.mode"));
  }
  if (speed != 0 && !(speed >= kSlowest && speed <= kFastest)) {
    return replyError(asked,
                      errorOf(v1::ERROR_BAD_MESSAGE,
                              "free_run.speed = " + std::to_string(speed) + ": give 0.001 to 1000",
                              "set_clock.free_run.speed"));
  }
  if (!takeClock(asked)) return;
  ServedClock& clock = asked.served.clock;
  clock.mode = wanted.has_lockstep()   ? v1::Clock::MODE_LOCKSTEP
               : wanted.has_free_run() ? v1::Clock::MODE_FREE_RUN
                                       : v1::Clock::MODE_PAUSED;
  clock.speed = speed > 0 ? speed : 1;
  clock.nextTick = std::chrono::steady_clock::now();
  publish(asked.served);
  tellReplay(asked.served);
  v1::ServerMessage message;
  *message.mutable_set_clock()->mutable_clock() = messageOf(clock);
  message.mutable_set_clock()->set_tick(lastTick(asked.served));
  reply(asked, std::move(message));
}

void answer(const Asked& asked, const v1::Restart&) {
  if (auto problem = onlyReplayed(asked.served)) return replyError(asked, std::move(*problem));
  if (asked.served.clock.mode != v1::Clock::MODE_LOCKSTEP) {
    return replyError(asked, errorOf(v1::ERROR_NOT_ALLOWED,
                                     "a world begins anew only in lockstep: set the clock to "
                                     "lockstep first"));
  }
  if (!takeClock(asked)) return;
  restartWorld(asked.served);
  publish(asked.served);
  const auto snapshot = asked.served.world.snapshot();
  v1::ServerMessage message;
  message.mutable_restart()->set_tick(snapshot->tick);
  message.mutable_restart()->set_state_hash(snapshot->stateHash);
  reply(asked, std::move(message));
}

void answer(const Asked& asked, const v1::Seek& wanted) {
  auto problem = seekProblem(asked.served, wanted);
  if (problem) return replyError(asked, std::move(*problem));
  if (!takeClock(asked)) return;
  problem = seek(asked.served, wanted);
  if (problem) return replyError(asked, std::move(*problem));
  const auto snapshot = asked.served.world.snapshot();
  v1::ServerMessage message;
  message.mutable_seek()->set_tick(snapshot->tick);
  message.mutable_seek()->set_time(snapshot->time);
  message.mutable_seek()->set_state_hash(snapshot->stateHash);
  reply(asked, std::move(message));
}

void answer(const Asked& asked, const v1::TakeOver& wanted) {
  auto problem = takeOverProblem(asked.served, asked.id, wanted);
  if (problem) return replyError(asked, std::move(*problem));
  if (!asked.served.replay->branchedAt() && !takeClock(asked)) return;
  problem = takeOver(asked.served, asked.id, wanted);
  if (problem) return replyError(asked, std::move(*problem));
  v1::ServerMessage message;
  message.mutable_take_over()->set_tick(lastTick(asked.served));
  reply(asked, std::move(message));
}

// ---- listening and looking ---------------------------------------------------------------------

void answer(const Asked& asked, const v1::Subscribe& subscription) {
  if (!(subscription.state_rate() >= 0 && subscription.state_rate() <= 1e6)) {
    return replyError(
        asked, errorOf(v1::ERROR_BAD_MESSAGE, "subscribe.state_rate: give 0 to 1000000 a second",
                       "subscribe.state_rate"));
  }
  asked.client.subscription = subscription;
  asked.client.nextStateTime = 0;
  v1::ServerMessage message;
  message.mutable_subscribe()->set_tick(lastTick(asked.served));
  if (subscription.contacts()) {
    for (const auto& [pair, event] : asked.served.live) {
      *message.mutable_subscribe()->add_live() = event;
    }
  }
  reply(asked, std::move(message));
}

std::optional<v1::Error> tickGone(const Asked& asked, std::uint64_t wanted, const char* field) {
  const std::uint64_t last = lastTick(asked.served);
  if (wanted == last) return std::nullopt;
  return errorOf(v1::ERROR_TICK_GONE,
                 "the last tick is " + std::to_string(last) + ", not " + std::to_string(wanted),
                 field);
}

/// A service works on the request: the client's later ones wait until what is returned is called,
/// on the service's thread, with the reply, which `deliver` hands to the client's queue.
std::function<void(Encoded)> untilAnswered(const Asked& asked, const PostToTickThread& post,
                                           void (OutgoingQueue::*deliver)(Encoded)) {
  const AnswerUnderWay answer{asked.message.request_id()};
  asked.client.answerUnderWay = answer;
  return [out = asked.client.out, id = asked.id, post, deliver, answer](Encoded whole) {
    if (!answer.claim()) return;  // the world ended, and said so
    ((*out).*deliver)(std::move(whole));
    post([id, post](ServedWorld& then) {
      const auto client = then.clients.find(id);
      if (client == then.clients.end()) return;
      client->second.answerUnderWay.reset();
      answerWaiting(then, id, post);
    });
  };
}

void answer(const Asked& asked, const v1::FrameRequest& request, const PostToTickThread& post) {
  ServedWorld& served = asked.served;
  if (request.has_tick()) {
    if (auto gone = tickGone(asked, request.tick(), "frame.tick")) {
      return replyError(asked, std::move(*gone));
    }
  }
  if (served.frames.deviceName().empty()) {
    return replyError(asked, errorOf(v1::ERROR_NO_RENDERER, served.frames.whyNone()));
  }
  const auto snapshot = served.world.snapshot();
  auto view = viewFrom(request, *snapshot);
  if (auto* error = std::get_if<v1::Error>(&view)) {
    if (!error->field().empty()) error->set_field("frame." + error->field());
    return replyError(asked, std::move(*error));
  }
  FrameJob job{snapshot, std::get<View>(view), request, asked.message.request_id(), 0,
               0,        served.drawn};
  job.seen = toRecording(served, request);
  served.frames.draw(std::move(job), untilAnswered(asked, post, &OutgoingQueue::pushFrame));
}

/// A question about the last tick: answered beside the ticks.
template <class Query>
void ask(const Asked& asked, const Query& query, const char* tick, const PostToTickThread& post) {
  ServedWorld& served = asked.served;
  if (query.has_tick()) {
    if (auto gone = tickGone(asked, query.tick(), tick)) return replyError(asked, std::move(*gone));
  }
  served.questions.ask(
      {served.world.snapshot(), asked.message, served.world.lengths(), served.limits},
      untilAnswered(asked, post, &OutgoingQueue::push));
}

void answer(const Asked& asked, const v1::WatchFrames& wanted) {
  if (auto problem = watchFrames(asked.served, asked.id, asked.client, wanted))
    return replyError(asked, std::move(*problem));
  v1::ServerMessage message;
  message.mutable_watch_frames()->set_tick(lastTick(asked.served));
  reply(asked, std::move(message));
}

v1::Entity entityOf(const scene::World& world, std::uint32_t id) {
  const auto& objects = world.scene().model().objects;
  v1::Entity entity;
  entity.set_id(id);
  entity.set_name(scene::nameOf(world, id));
  if (id >= 1 && id <= objects.size()) {
    entity.set_kind(v1::Entity::KIND_OBJECT);
    entity.set_global_id(objects[id - 1].globalId);
    entity.set_operation(objects[id - 1].operation);
  } else if (!entity.name().empty()) {
    entity.set_kind(v1::Entity::KIND_AVATAR);
  }
  return entity;
}

/// Adds to a reply what fits into ServerLimits::replyBytes.
class BoundedNames {
 public:
  BoundedNames(const ServedWorld& served, v1::EntityNames& names)
      : served_(served), names_(names) {}

  /// False, and nothing is added, when the reply would become too large.
  bool add(std::uint32_t id) {
    constexpr std::size_t kFieldBytes = 8;  // an entity's tag and length in the message, at most
    v1::Entity entity = entityOf(served_.world, id);
    bytes_ += entity.ByteSizeLong() + kFieldBytes;
    if (bytes_ > served_.limits.replyBytes) return false;
    *names_.add_entities() = std::move(entity);
    return true;
  }
  bool addAll() {
    const auto& objects = served_.world.scene().model().objects;
    for (std::uint32_t id = 1; id <= objects.size(); ++id) {
      if (!add(id)) return false;
    }
    const auto& avatars = served_.world.snapshot()->avatars;
    return std::all_of(avatars.begin(), avatars.end(), [this](const auto& a) { return add(a.id); });
  }

 private:
  const ServedWorld& served_;
  v1::EntityNames& names_;
  std::size_t bytes_ = 0;
};

void answer(const Asked& asked, const v1::DescribeEntities& wanted) {
  const ServerLimits& limits = asked.served.limits;
  const auto count = static_cast<std::size_t>(wanted.ids_size());
  const std::string remedy =
      "ask in pages, for at most " + std::to_string(limits.describedIds) + " ids at a time";
  if (count > limits.describedIds) {
    return replyError(
        asked, errorOf(v1::ERROR_TOO_LARGE, "ids has " + std::to_string(count) + " ids: " + remedy,
                       "describe.ids"));
  }
  v1::ServerMessage message;
  BoundedNames names(asked.served, *message.mutable_names());
  const bool whole = count == 0 ? names.addAll()
                                : std::all_of(wanted.ids().begin(), wanted.ids().end(),
                                              [&](std::uint32_t id) { return names.add(id); });
  if (!whole) {
    return replyError(
        asked,
        errorOf(v1::ERROR_TOO_LARGE,
                "the names take more than the " + std::to_string(limits.replyBytes) +
                    " bytes of a reply: give ids and " + remedy + ", fewer where names are long",
                "describe.ids"));
  }
  reply(asked, std::move(message));
}

void answerMetrics(const Asked& asked) {
  ServedWorld& served = asked.served;
  v1::ServerMessage message;
  v1::Metrics& metrics = *message.mutable_metrics();
  metrics = served.statistics.metrics();
  metrics.set_clients(static_cast<std::uint32_t>(served.clients.size()));
  metrics.set_avatars(static_cast<std::uint32_t>(served.world.snapshot()->avatars.size()));
  metrics.set_frames(*served.drawn);
  metrics.set_dropped(served.droppedStates + served.droppedFrames);
  if (const WorldRecorder* recorder = served.world.recorder()) {
    metrics.mutable_recording()->set_ticks(recorder->ticks());
    metrics.mutable_recording()->set_bytes(recorder->bytes());
    metrics.mutable_recording()->set_broken(recorder->broken());
  }
  reply(asked, std::move(message));
}

// ---- worlds -------------------------------------------------------------------------------------

void replyAlone(const Asked& asked) {
  replyError(asked, errorOf(v1::ERROR_UNSUPPORTED, "this server has one world and no others"));
}

void answer(const Asked& asked, const v1::CreateWorld& wanted, const PostToTickThread& post) {
  const WorldPlace& here = asked.served.place;
  if (!here.worlds) return replyAlone(asked);
  const auto tell = [id = asked.message.request_id(),
                     done = untilAnswered(asked, post, &OutgoingQueue::push)](
                        std::variant<v1::World, v1::Error> made) {
    v1::ServerMessage message;
    message.set_reply_to(id);
    if (auto* error = std::get_if<v1::Error>(&made)) return done(errorReply(id, std::move(*error)));
    *message.mutable_create_world()->mutable_world() = std::get<v1::World>(std::move(made));
    done(encodeShared(message));
  };
  const std::string scene = wanted.scene().empty() ? here.scene : wanted.scene();
  here.worlds->create({wanted.name(), scene, wanted.drop_when_empty()}, tell);
}

void answer(const Asked& asked, const v1::DropWorld& wanted, const PostToTickThread& post) {
  const WorldPlace& here = asked.served.place;
  if (!here.worlds) return replyAlone(asked);
  const auto tell =
      [id = asked.message.request_id(),
       done = untilAnswered(asked, post, &OutgoingQueue::push)](std::optional<v1::Error> problem) {
        if (problem) return done(errorReply(id, std::move(*problem)));
        v1::ServerMessage message;
        message.set_reply_to(id);
        message.mutable_drop_world();
        done(encodeShared(message));
      };
  here.worlds->drop(wanted.name(), here.name, tell);
}

void answerList(const Asked& asked) {
  if (!asked.served.place.worlds) return replyAlone(asked);
  v1::ServerMessage message;
  *message.mutable_worlds() = asked.served.place.worlds->list();
  reply(asked, std::move(message));
}

/// What was asked before is answered by now; the session closes when it is sent.
void answerBye(const Asked& asked) {
  v1::ServerMessage message;
  message.mutable_bye()->set_reason("you said goodbye");
  asked.client.out->finish(encodeShared(message));
}

/// The least role that may ask this.
Role roleNeeded(v1::ClientMessage::BodyCase body) {
  switch (body) {
    case v1::ClientMessage::kCommand:
    case v1::ClientMessage::kBodyCommand:
    case v1::ClientMessage::kStep:
    case v1::ClientMessage::kSetClock:
    case v1::ClientMessage::kSeek:
    case v1::ClientMessage::kTakeOver:
      return Role::drive;
    case v1::ClientMessage::kRestart:
    case v1::ClientMessage::kCreateWorld:
    case v1::ClientMessage::kDropWorld:
      return Role::admin;
    default:
      return Role::observe;
  }
}

void answer(const Asked& asked, const PostToTickThread& post) {
  const v1::ClientMessage& message = asked.message;
  const Role needed = roleNeeded(message.body_case());
  if (asked.client.role < needed) {
    return replyError(
        asked, errorOf(v1::ERROR_NOT_ALLOWED, std::string("this needs a token with the role ") +
                                                  nameOf(needed) + ", and yours is " +
                                                  nameOf(asked.client.role) +
                                                  ": ask whoever runs the server for one"));
  }
  switch (message.body_case()) {
    case v1::ClientMessage::kCommand:
      return answer(asked, message.command());
    case v1::ClientMessage::kBodyCommand:
      return answer(asked, message.body_command());
    case v1::ClientMessage::kStep:
      return answer(asked, message.step());
    case v1::ClientMessage::kSetClock:
      return answer(asked, message.set_clock());
    case v1::ClientMessage::kRestart:
      return answer(asked, message.restart());
    case v1::ClientMessage::kSeek:
      return answer(asked, message.seek());
    case v1::ClientMessage::kTakeOver:
      return answer(asked, message.take_over());
    case v1::ClientMessage::kSubscribe:
      return answer(asked, message.subscribe());
    case v1::ClientMessage::kFrame:
      return answer(asked, message.frame(), post);
    case v1::ClientMessage::kWatchFrames:
      return answer(asked, message.watch_frames());
    case v1::ClientMessage::kRays:
      return ask(asked, message.rays(), "rays.tick", post);
    case v1::ClientMessage::kDistances:
      return ask(asked, message.distances(), "distances.tick", post);
    case v1::ClientMessage::kTouching:
      return ask(asked, message.touching(), "touching.tick", post);
    case v1::ClientMessage::kCannotTouch:
      return ask(asked, message.cannot_touch(), "cannot_touch.tick", post);
    case v1::ClientMessage::kDescribe:
      return answer(asked, message.describe());
    case v1::ClientMessage::kMetrics:
      return answerMetrics(asked);
    case v1::ClientMessage::kCreateWorld:
      return answer(asked, message.create_world(), post);
    case v1::ClientMessage::kDropWorld:
      return answer(asked, message.drop_world(), post);
    case v1::ClientMessage::kListWorlds:
      return answerList(asked);
    case v1::ClientMessage::kHello:
      return replyError(asked, errorOf(v1::ERROR_NOT_ALLOWED,
                                       "hello was said already: connect anew to say another"));
    case v1::ClientMessage::kBye:
      return answerBye(asked);
    case v1::ClientMessage::BODY_NOT_SET:
      break;
  }
  replyError(asked,
             errorOf(v1::ERROR_UNSUPPORTED, "this server does not know the request", "body"));
}

/// A request that we cannot answer for a fault of ours harms nobody but who asked.
void answerOrSayWhyNot(const Asked& asked, const PostToTickThread& post) {
  try {
    answer(asked, post);
  } catch (const std::exception& error) {
    spdlog::error("a request of '{}' failed: {}", asked.client.name, error.what());
    asked.client.answerUnderWay.reset();
    asked.client.step.reset();
    replyError(asked, errorOf(v1::ERROR_INTERNAL, error.what()));
  }
}

}  // namespace

v1::Welcome welcomeOf(const ServedWorld& served) {
  v1::Welcome welcome;
  welcome.set_protocol_version(protocol::kVersion);
  welcome.set_server_version(kServerVersion);
  welcome.add_capabilities("free_run");
  welcome.add_capabilities("rays");
  welcome.add_capabilities("packed_rays");
  welcome.add_capabilities("pairs");
  welcome.add_capabilities("persists");
  welcome.add_capabilities("restart");
  if (!served.frames.deviceName().empty()) {
    welcome.add_capabilities("frames");
    welcome.add_capabilities("shadows");
  }
  *welcome.mutable_scene() = messageOf(served.world.scene());
  *welcome.mutable_policies() = messageOf(served.world.lengths());
  v1::Limits& limits = *welcome.mutable_limits();
  limits.set_max_message(protocol::kServerTakes.total);
  limits.set_max_avatars(served.limits.avatars);
  limits.set_max_picture_width(served.limits.pictureSide);
  limits.set_max_picture_height(served.limits.pictureSide);
  limits.set_max_ticks_per_step(served.limits.ticksPerStep);
  limits.set_max_waypoints(served.limits.waypoints);
  limits.set_max_rays(served.limits.rays);
  limits.set_max_watches(served.limits.watches);
  limits.set_max_scan_rays(served.limits.scanRays);
  limits.set_max_worlds(served.limits.worlds);
  limits.set_max_pairs(served.limits.pairs);
  limits.set_max_requests_under_way(served.limits.requestsUnderWay);
  limits.set_max_bytes_under_way(served.limits.waitingBytes);
  limits.set_requests_per_second(served.limits.requestsPerSecond);
  welcome.set_tick(lastTick(served));
  welcome.set_renderer(served.frames.deviceName());
  welcome.set_software_renderer(served.frames.software());
  *welcome.mutable_clock() = messageOf(served.clock);
  if (served.replay) {
    welcome.add_capabilities("replay");
    *welcome.mutable_replay() = replayOf(served);
  }
  welcome.set_world(served.place.name);
  if (served.place.worlds) {
    welcome.add_capabilities("worlds");
    for (const std::string& scene : served.place.worlds->sceneNames()) welcome.add_scenes(scene);
  }
  return welcome;
}

void answerWaiting(ServedWorld& served, ClientId id, const PostToTickThread& post) {
  const auto found = served.clients.find(id);
  if (found == served.clients.end() || served.farewell) return;
  Client& client = found->second;
  // Who is cut off hears no answer, and must not keep the others waiting for theirs.
  while (!client.waiting.empty() && !client.step && !client.answerUnderWay &&
         !client.out->finished()) {
    const WaitingRequest request = std::move(client.waiting.front());
    client.waiting.pop_front();
    answerOrSayWhyNot({served, id, client, request.message}, post);
  }
}

}  // namespace enfilade::server
