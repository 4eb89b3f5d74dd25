// The thread that owns a world: it runs posted jobs, answers requests, and runs due ticks. While it
// rests, another thread may do so for a moment; only the world's owner accesses it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Job queue of a world's thread. It outlives the world, because other threads may still post.
struct TickInbox {
  using Job = std::function<void(HostedWorld&)>;

  /// The thread that accesses the world. `none`: the world's own thread rests and takes it back
  /// when it wakes; until then another may become its guest.
  enum class Owner : std::uint8_t { thread, none, guest };

  /// Returns false if the world has ended; the job is discarded then.
  bool post(Job job);
  /// As post(), but does not wake the world's thread.
  bool queue(Job job);

  std::mutex mutex;  ///< guards the members below
  Owner owner = Owner::thread;
  std::exception_ptr guestFailure;  ///< an internal error on the guest's thread
  std::condition_variable posted;
  std::vector<Job> jobs;
  bool closed = false;
  std::optional<v1::Bye> closeNotice;  ///< set when closed
  ClientId lastId = 0;
  std::set<ClientId> members;  ///< clients that keep a world with dropWhenEmpty alive
  std::exception_ptr failure;
};

/// Runs one world on a thread of its own.
class TickLoop {
 public:
  TickLoop(std::shared_ptr<const scene::Scene> scene, FrameService& frames, QueryService& queries,
           const WorldOptions& options = {}, WorldIdentity worldIdentity = {});
  ~TickLoop();  ///< calls stop()
  TickLoop(const TickLoop&) = delete;
  TickLoop& operator=(const TickLoop&) = delete;

  // Callable from any thread, except auditTotals() and isRecordingComplete().

  const WorldIdentity& identity() const { return hosted_.identity; }
  /// The world's entry in ListWorlds.
  v1::World makeStatus() const;
  /// Adds a client; its Welcome replies to `requestId`. Returns 0 if the world has ended, without a
  /// message. Guests are not counted as clients of the world.
  ClientId join(std::string name, Role role, std::shared_ptr<OutgoingQueue> out,
                std::uint64_t requestId, bool guest = false, MessagePacker pack = nullptr);
  void receive(ClientId id, v1::ClientMessage message, RequestPermit permit);
  /// Several requests at once, without permits. workIfAtRest() has to follow.
  void queue(ClientId id, std::vector<v1::ClientMessage> messages);
  /// Answers what is queued on the calling thread, if the world's own thread rests. It takes over
  /// after a few milliseconds.
  void workIfAtRest();
  void leave(ClientId id);
  /// Runs a job between two ticks. Returns false if the world has ended.
  bool post(TickInbox::Job job) { return inbox_->post(std::move(job)); }
  /// Finishes the tick, closes the world, and ends the thread. Clients receive `reason`. Later
  /// calls only wait.
  void stop(v1::ErrorCode code = v1::ERROR_SHUTTING_DOWN,
            const std::string& reason = "the server is stopping");
  /// Like stop(), but does not wait.
  void requestStop(v1::ErrorCode code, const std::string& reason);
  /// Stops the world if it has no clients; returns whether it stops. Does not wait.
  bool requestStopIfEmpty(v1::ErrorCode code, const std::string& reason);
  /// The internal error that ended the thread; null: none.
  std::exception_ptr failure() const;
  /// Totals of all ticks. Only after stop(): until then the thread uses them.
  AuditTotals auditTotals() const;
  /// Whether all recordings are complete. Only after stop().
  bool isRecordingComplete() const;

 private:
  using Job = TickInbox::Job;
  void run();
  void runRemainingJobs();
  void fail(const std::string& reason);
  bool waitForJobs();
  void rest(std::unique_lock<std::mutex>& lock);
  void takeJobs();
  bool becomeGuest();
  void work();
  bool hasWork() const;
  bool isStepDue() const;
  bool takeFreeRunTick();

  HostedWorld hosted_;     // owner only
  std::vector<Job> jobs_;  // owner only: taken from the inbox
  const std::shared_ptr<TickInbox> inbox_ = std::make_shared<TickInbox>();
  std::mutex joinMutex_;  // guards the join of the thread
  std::thread thread_;
};

}  // namespace enfilade::server
