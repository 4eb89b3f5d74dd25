// The world and everyone who is connected to it. Only the tick thread reads or changes this.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "protocol/enfilade.pb.h"
#include "scene/world.hpp"
#include "server/access.hpp"
#include "server/frame_service.hpp"
#include "server/outgoing_queue.hpp"
#include "server/ray_service.hpp"
#include "server/tick_statistics.hpp"
#include "server/world_options.hpp"

namespace enfilade::server {

using ClientId = std::uint64_t;

/// A Step that is being made; the client's later requests wait for it.
struct StepUnderWay {
  std::uint64_t requestId = 0;
  std::uint32_t remaining = 0;  ///< ticks
  bool avatars = false;
};

struct WaitingRequest {
  v1::ClientMessage message;
  std::size_t bytes = 0;
};

/// Pictures that are sent unasked.
struct FrameWatch {
  v1::FrameRequest request;
  double rate = 0;               ///< a second of simulated time; 0: every tick
  double nextTime = 0;           ///< seconds of simulated time
  bool underWay = false;         ///< one is being drawn
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
  std::size_t waitingBytes = 0;
  std::optional<StepUnderWay> step;
  std::map<std::uint32_t, FrameWatch> watches;
  std::optional<std::uint64_t> answerUnderWay;  ///< the request that a service works on
};

struct ServedClock {
  v1::Clock::Mode mode = v1::Clock::MODE_LOCKSTEP;
  double speed = 1;  ///< simulated seconds per second
  std::chrono::steady_clock::time_point nextTick;
  std::optional<ClientId> driver;
};

struct ServedWorld {
  ServedWorld(std::shared_ptr<const scene::Scene> scene, FrameService& frameService,
              RayService& rayService, const WorldOptions& options = {});

  std::shared_ptr<const scene::Scene> scene;
  std::uint32_t auditEvery = 0;  ///< ticks; 0: never
  scene::World world;
  FrameService& frames;
  RayService& rays;
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
  /// Hands a job to the tick thread; callable from any thread.
  std::function<void(std::function<void(ServedWorld&)>)> post;
};

/// Makes one tick and tells everyone what they subscribed to.
void advance(ServedWorld& served);

/// The world as it was at first. Everyone is told that contacts ended and avatars left.
void restartWorld(ServedWorld& served);

/// Takes a client out; its avatars leave at the next tick.
void removeClient(ServedWorld& served, ClientId id);

/// Ends all contacts, answers what is open, and says goodbye to all.
void closeWorld(ServedWorld& served);

void send(Client& client, const v1::ServerMessage& message);
void sendError(Client& client, std::uint64_t requestId, v1::Error error);

}  // namespace enfilade::server
