// A world and its connected clients. Only the tick thread may access this state.
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
#include "scene/world/queries/contact_horizon.hpp"
#include "scene/world/world.hpp"
#include "server/base/access.hpp"
#include "server/hosting/flow_control.hpp"
#include "server/hosting/frame_service.hpp"
#include "server/hosting/query_service.hpp"
#include "server/hosting/viewer_feed.hpp"
#include "server/hosting/world_directory.hpp"
#include "server/hosting/world_options.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/messages/tick_statistics.hpp"
#include "server/recording/recordable_world.hpp"
#include "server/recording/replay_check.hpp"

namespace enfilade::server {

using ClientId = std::uint64_t;
class WorldGroup;

inline constexpr std::size_t kKeptSnapshots = 32;  ///< HostedWorld::recentSnapshots

/// A Step in progress; the client's later requests wait for it.
struct PendingStep {
  std::uint64_t requestId = 0;
  std::uint32_t remaining = 0;  ///< ticks
  bool includeAvatars = false;
  std::uint32_t completed = 0;  ///< ticks
};

/// A request that a service works on. Either the service or a world that ends meanwhile answers it:
/// the first to claim it.
struct PendingReply {
  std::uint64_t requestId = 0;
  std::shared_ptr<std::atomic<bool>> claimed = std::make_shared<std::atomic<bool>>(false);
  bool claim() const { return !claimed->exchange(true); }
};

/// A request that waits for earlier ones of the same client.
struct QueuedRequest {
  v1::ClientMessage message;
  RequestPermit permit;
};

/// A subscription to rendered frames.
struct FrameSubscription {
  v1::FrameRequest request;
  double rate = 0;               ///< frames per simulated second; 0: every tick
  double nextTime = 0;           ///< seconds of simulated time
  bool rendering = false;        ///< a frame is in progress
  bool missed = false;           ///< a picture was due meanwhile: render again
  bool stale = false;            ///< the world was replaced meanwhile: render again
  std::uint64_t dropped = 0;     ///< since the start of the last frame
  std::uint64_t generation = 0;  ///< distinguishes it from a replaced subscription
  /// For a flow channel: of the last picture, and where the flow of that one began.
  std::shared_ptr<const scene::Snapshot> lastPicture, flowStart;
};

/// A client of the world.
struct Client {
  std::string name;
  Role role = Role::observe;
  bool guest = false;  ///< an HTTP visitor: not counted as a client
  std::shared_ptr<OutgoingQueue> out;
  MessagePacker pack;  ///< null: every message goes to `out`
  v1::Subscribe subscription;
  std::uint64_t sequence = 0;                           ///< of the last TickEvents
  std::map<scene::EntityId, std::string> sentHorizons;  ///< serialized, by avatar
  double nextStateTime = 0;                             ///< seconds of simulated time
  std::uint64_t droppedStates = 0;                      ///< since the last sent state
  std::deque<QueuedRequest> queue;                      ///< replies keep the order of requests
  std::optional<PendingStep> pendingStep;
  std::map<std::uint32_t, FrameSubscription> frameSubscriptions;
  std::optional<PendingReply> pendingReply;
  std::string upload;                 ///< parts that it has sent for a later request
  std::shared_ptr<WorldGroup> group;  ///< the worlds of its StepMany requests; null: none yet
};

/// The clock of a world, and the client that drives it.
struct WorldClock {
  v1::Clock::Mode mode = v1::Clock::MODE_LOCKSTEP;
  double speed = 1;  ///< simulated seconds per second
  std::chrono::steady_clock::time_point nextTick;
  std::optional<ClientId> driver;
};

/// Identifies a world among the worlds of a server.
struct WorldIdentity {
  std::string name = "main";
  std::string scene;                    ///< the scene's name
  WorldDirectory* directory = nullptr;  ///< null: a single world, not of a server
  bool dropWhenEmpty = false;
  /// Called when the last client has left, on the thread of that call. Only with dropWhenEmpty.
  std::function<void()> becameEmpty;
};

/// Status of a world that any thread may read.
struct WorldStatus {
  std::atomic<std::uint64_t> tick{0};
  std::atomic<v1::Clock::Mode> mode{v1::Clock::MODE_LOCKSTEP};
  std::atomic<double> speed{1};
  std::atomic<bool> hasDriver{false};
};

/// A world, its clients, its services and its replay.
struct HostedWorld {
  /// Throws protocol::mcap::RecordingError, and Divergence if a recording cannot be replayed.
  HostedWorld(std::shared_ptr<const scene::Scene> scene, FrameService& frameService,
              QueryService& queryService, const WorldOptions& options = {},
              WorldIdentity worldIdentity = {});

  const WorldIdentity identity;
  WorldStatus status;
  std::shared_ptr<const scene::Scene> scene;
  std::uint32_t auditEvery = 0;    ///< ticks; 0: never
  std::unique_ptr<Replay> replay;  ///< null: the world replays no recording
  /// Recording options for branches of a replay; nullopt: branches are not recorded.
  std::optional<RecordingOptions> branchRecording;
  std::uint64_t branchCount = 0;  ///< number of started branch recordings
  RecordableWorld world;
  FrameService& frames;
  QueryService& queries;
  ServerLimits limits;
  WorldClock clock;
  std::map<ClientId, Client> clients;
  /// The client that may command an avatar, by the avatar's name. An entry lasts from the spawn
  /// order until the avatar and its orders are gone.
  std::map<std::string, ClientId> owners;
  std::set<std::string> pendingRelease;  ///< names in `owners` that may become free
  std::set<std::string> takenOver;       ///< avatars that the next tick stops for a TakeOver
  ActiveContacts activeContacts;
  /// Of the last ticks, the latest one last; for flow channels.
  std::deque<std::shared_ptr<const scene::Snapshot>> recentSnapshots;
  std::map<ClientId, ViewerFeed> viewers;            ///< of clients that are viewers
  std::unique_ptr<scene::ContactHorizons> horizons;  ///< null before the first subscriber
  bool horizonSelectionChanged = false;              ///< a client subscribed or left
  TickStatistics statistics;
  bool idle = true;  ///< of the last tick
  /// Of avatars in this run. Used by the thread of navigation queries alone.
  std::shared_ptr<KeptPaths> keptPaths = std::make_shared<KeptPaths>();
  std::uint64_t droppedStates = 0;   ///< of all clients
  std::uint64_t droppedFrames = 0;   ///< of all frame subscriptions
  std::uint64_t lastGeneration = 0;  ///< last FrameSubscription::generation
  /// Number of frames rendered for this world.
  std::shared_ptr<std::atomic<std::uint64_t>> renderedFrames =
      std::make_shared<std::atomic<std::uint64_t>>(0);
  /// The final message to clients. Once it is set, requests are no longer answered.
  std::optional<v1::Bye> closeNotice;
  std::set<std::string> recordingRenders;  ///< avatars with a frame in progress for the recording
  /// Posts a job to the tick thread; callable from any thread.
  std::function<void(std::function<void(HostedWorld&)>)> post;
  /// Whether the world is stopping: long work on the tick thread aborts then.
  std::function<bool()> isEnding = [] { return false; };
};

/// A world at tick 0.
scene::World makeInitialWorld(const std::shared_ptr<const scene::Scene>& scene,
                              const scene::WorldSettings& settings, std::uint32_t auditEvery);

/// Updates `activeContacts` from the begin and end events.
void updateActiveContacts(HostedWorld& hosted, const v1::TickEvents& events);

/// Updates the status that other threads read, and sends a change of the clock to its subscribers.
void publishStatus(HostedWorld& hosted);

v1::Clock toProto(const WorldClock& clock);

/// Clears the avatar's orders and stops it.
void stopAvatar(HostedWorld& hosted, const std::string& avatar);

/// Removes a client; its avatars leave at the next tick.
void removeClient(HostedWorld& hosted, ClientId id);

void sendMessage(Client& client, const v1::ServerMessage& message);
void sendError(Client& client, std::uint64_t requestId, v1::Error error);

}  // namespace enfilade::server
