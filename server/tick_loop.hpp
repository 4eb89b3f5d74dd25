// The thread that owns the world: it takes what sessions post, answers, and makes the ticks that
// are due. Nothing else touches the world.
#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "server/requests.hpp"

namespace enfilade::server {

class TickLoop {
 public:
  TickLoop(std::shared_ptr<const scene::Scene> scene, FrameService& frames, RayService& rays,
           const WorldOptions& options = {});
  ~TickLoop();  ///< stops
  TickLoop(const TickLoop&) = delete;
  TickLoop& operator=(const TickLoop&) = delete;

  // All of these but the last may be called from any thread.

  /// Greets a client: its Welcome answers `requestId`.
  ClientId join(std::string name, Role role, std::shared_ptr<OutgoingQueue> out,
                std::uint64_t requestId);
  void receive(ClientId id, v1::ClientMessage message, std::size_t bytes);
  void leave(ClientId id);
  /// Finishes the tick, closes the world, and ends the thread. Later calls do nothing.
  void stop();
  /// What ended the thread, if anything but stop() did: a fault of ours.
  std::exception_ptr failure() const;
  /// Of all ticks. Only after stop(): until then it is the thread's.
  AuditTotals auditTotals() const;

 private:
  using Job = std::function<void(ServedWorld&)>;
  void post(Job job);
  void run();
  bool takeJobs();
  bool stepTicks();
  bool freeRunTicks();

  ServedWorld served_;        // the thread's
  std::vector<Job> jobs_;     // the thread's: taken from inbox_
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable posted_;
  std::vector<Job> inbox_;
  ClientId lastId_ = 0;
  bool stopping_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace enfilade::server
