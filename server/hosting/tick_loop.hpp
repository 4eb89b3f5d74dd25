// The thread that owns the world: it takes what sessions post, answers, and makes the ticks that
// are due. Nothing else touches the world.
#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "server/hosting/requests.hpp"

namespace enfilade::server {

/// What waits for the thread of a world. It outlasts the world, since others may still post.
struct TickInbox {
  using Job = std::function<void(ServedWorld&)>;

  /// False: the world has ended, and nothing was done.
  bool post(Job job);

  std::mutex mutex;  ///< guards what follows
  std::condition_variable posted;
  std::vector<Job> jobs;
  bool closed = false;
  std::optional<v1::Bye> farewell;  ///< once it is closed
  ClientId lastId = 0;
  std::set<ClientId> members;  ///< clients that count: dropWhenEmpty waits for them to leave
  std::exception_ptr failure;
};

class TickLoop {
 public:
  TickLoop(std::shared_ptr<const scene::Scene> scene, FrameService& frames,
           QuestionService& questions, const WorldOptions& options = {}, WorldPlace place = {});
  ~TickLoop();  ///< stops
  TickLoop(const TickLoop&) = delete;
  TickLoop& operator=(const TickLoop&) = delete;

  // All of these but the last two may be called from any thread.

  const WorldPlace& place() const { return served_.place; }
  /// As ListWorlds tells it.
  v1::World glance() const;
  /// Greets a client: its Welcome answers `requestId`. 0: the world has ended, and nobody is told
  /// so. A guest is none of the clients that the world is told to have.
  ClientId join(std::string name, Role role, std::shared_ptr<OutgoingQueue> out,
                std::uint64_t requestId, bool guest = false);
  void receive(ClientId id, v1::ClientMessage message, RequestHold hold);
  void leave(ClientId id);
  /// For what has to be done between two ticks. False: the world has ended.
  bool post(TickInbox::Job job) { return inbox_->post(std::move(job)); }
  /// Finishes the tick, closes the world, and ends the thread. Clients get `reason` for last words.
  /// Later calls only wait.
  void stop(v1::ErrorCode code = v1::ERROR_SHUTTING_DOWN,
            const std::string& reason = "the server ends");
  /// The same, but does not wait.
  void askToStop(v1::ErrorCode code, const std::string& reason);
  /// Unless a client is in it; whether it stops. Does not wait.
  bool askToStopIfEmpty(v1::ErrorCode code, const std::string& reason);
  /// What ended the thread, if anything but stop() did: a fault of ours.
  std::exception_ptr failure() const;
  /// Of all ticks. Only after stop(): until then it is the thread's.
  AuditTotals auditTotals() const;
  /// Whether what was to be recorded is. As auditTotals().
  bool recordedAll() const;

 private:
  using Job = TickInbox::Job;
  void run();
  void runLeftOver();
  void fail(const std::string& why);
  bool takeJobs();
  bool stepTicks();
  bool freeRunTicks();

  ServedWorld served_;     // the thread's
  std::vector<Job> jobs_;  // the thread's: taken from the inbox
  const std::shared_ptr<TickInbox> inbox_ = std::make_shared<TickInbox>();
  std::mutex joining_;  // of the thread
  std::thread thread_;
};

}  // namespace enfilade::server
