// The world and everyone who is connected to it. Only the tick thread reads or changes this.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"
#include "server/base/access.hpp"
#include "server/hosting/flow_control.hpp"
#include "server/hosting/frame_service.hpp"
#include "server/hosting/query_service.hpp"
#include "server/hosting/world_options.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/messages/tick_statistics.hpp"
#include "server/recording/recordable_world.hpp"
#include "server/recording/replay_check.hpp"

namespace enfilade::server {

using ClientId = std::uint64_t;

/// A Step that is being made; the client's later requests wait for it.
struct StepUnderWay {
  std::uint64_t requestId = 0;
  std::uint32_t remaining = 0;  ///< ticks
  bool avatars = false;
  std::uint32_t made = 0;  ///< ticks
};

/// A request that a service works on. Who claims it first answers it: the service, or the world
/// that ends meanwhile.
struct AnswerUnderWay {
  std::uint64_t requestId = 0;
  std::shared_ptr<std::atomic<bool>> claimed = std::make_shared<std::atomic<bool>>(false);
  bool claim() const { return !claimed->exchange(true); }
};

struct WaitingRequest {
  v1::ClientMessage message;
  RequestHold hold;
};

/// Pictures that are sent unasked.
struct FrameWatch {
  v1::FrameRequest request;
  double rate = 0;               ///< a second of simulated time; 0: every tick
  double nextTime = 0;           ///< seconds of simulated time
  bool underWay = false;         ///< one is being drawn
  bool elsewhere = false;        ///< and the world has gone elsewhere since: another one follows
  std::uint64_t dropped = 0;     ///< since the last one that was begun
  std::uint64_t generation = 0;  ///< tells it from one that it replaced
};

struct Client {
  std::string name;
  Role role = Role::observe;
  std::shared_ptr<OutgoingQueue> out;
  v1::Subscribe subscription;
  std::uint64_t sequence = 0;          ///< of the last TickEvents
  double nextStateTime = 0;            ///< seconds of simulated time
  std::uint64_t droppedStates = 0;     ///< since the last one that was sent
  std::deque<WaitingRequest> waiting;  ///< replies keep the order of the requests
  std::optional<StepUnderWay> step;
  std::map<std::uint32_t, FrameWatch> watches;
  std::optional<AnswerUnderWay> answerUnderWay;
};

struct ServedClock {
  v1::Clock::Mode mode = v1::Clock::MODE_LOCKSTEP;
  double speed = 1;  ///< simulated seconds per second
  std::chrono::steady_clock::time_point nextTick;
  std::optional<ClientId> driver;
};

class Worlds;

/// Which of the server's worlds one is.
struct WorldPlace {
  std::string name = "main";
  std::string scene;         ///< its name
  Worlds* worlds = nullptr;  ///< null: it is the only one, and there can be no others
  bool dropWhenEmpty = false;
  /// The last client left, on the thread that told so. Only with dropWhenEmpty.
  std::function<void()> becameEmpty;
};

/// What everyone may know of a world without asking its thread.
struct WorldGlance {
  std::atomic<std::uint64_t> tick{0};
  std::atomic<v1::Clock::Mode> mode{v1::Clock::MODE_LOCKSTEP};
  std::atomic<double> speed{1};
  std::atomic<bool> driven{false};
};

struct ServedWorld {
  /// Throws protocol::mcap::RecordingError, and Diverged where a recording cannot be played.
  ServedWorld(std::shared_ptr<const scene::Scene> scene, FrameService& frameService,
              QuestionService& questionService, const WorldOptions& options = {},
              WorldPlace place = {});

  const WorldPlace place;
  WorldGlance glance;
  std::shared_ptr<const scene::Scene> scene;
  std::uint32_t auditEvery = 0;    ///< ticks; 0: never
  std::unique_ptr<Replay> replay;  ///< null: the world plays no recording
  /// Of a replay: how its branches are recorded; nullopt: they are not.
  std::optional<RecordingOptions> branchRecording;
  std::uint64_t branches = 0;  ///< recordings of branches that were begun
  RecordedWorld world;
  FrameService& frames;
  QuestionService& questions;
  ServerLimits limits;
  ServedClock clock;
  std::map<ClientId, Client> clients;
  /// Who may command an avatar, by its name: from its spawn order until it and its orders are gone.
  std::map<std::string, ClientId> owners;
  std::set<std::string> unsettled;  ///< of `owners`: names that may be free
  std::map<std::pair<scene::EntityId, scene::EntityId>, v1::ContactEvent> live;
  TickStatistics statistics;
  bool idle = true;                 ///< as the last tick told
  std::uint64_t droppedStates = 0;  ///< of all clients
  std::uint64_t droppedFrames = 0;  ///< of all watches
  std::uint64_t lastWatch = 0;      ///< the last FrameWatch::generation
  /// Pictures that were drawn of this world.
  std::shared_ptr<std::atomic<std::uint64_t>> drawn =
      std::make_shared<std::atomic<std::uint64_t>>(0);
  /// What clients are told at the end; once it is given, no more requests are answered.
  std::optional<v1::Bye> farewell;
  std::set<std::string> recordedViews;  ///< avatars whose view is being drawn for the recording
  /// Hands a job to the tick thread; callable from any thread.
  std::function<void(std::function<void(ServedWorld&)>)> post;
  /// Whether the world is to end: long work on the tick thread gives up then.
  std::function<bool()> ending = [] { return false; };
};

/// Makes one tick and tells everyone what they subscribed to. A replay that has no more stops.
void advance(ServedWorld& served);

/// The world as it was at first. Everyone is told that contacts ended and avatars left.
void restartWorld(ServedWorld& served);

/// Another world of the same scene: contacts that live are told as ended by a seek, `living` as
/// those that live now, and everyone gets states and pictures of it. Avatars belong to nobody then.
void goTo(ServedWorld& served, scene::World world, const v1::TickEvents& living);

/// Drops what the avatar was told, and stops it.
void haltAvatar(ServedWorld& served, const std::string& avatar);

/// Takes a client out; its avatars leave at the next tick.
void removeClient(ServedWorld& served, ClientId id);

/// Ends all contacts, answers what is open, and says goodbye to all by `farewell`.
void closeWorld(ServedWorld& served);

/// Says goodbye to all, where the world itself cannot be asked any more.
void failWorld(ServedWorld& served);

Buffer goodbyeOf(const v1::Bye& farewell);

/// Lets everyone see how the world stands.
void publish(ServedWorld& served);

v1::Clock messageOf(const ServedClock& clock);

void send(Client& client, const v1::ServerMessage& message);
void sendError(Client& client, std::uint64_t requestId, v1::Error error);

}  // namespace enfilade::server
