#include "server/worlds/tick_loop.hpp"

#include <algorithm>
#include <iterator>

#include "collision/assert.hpp"
#include "server/hosting/advance_world.hpp"
#include "server/hosting/requests/dispatch.hpp"
#include "server/hosting/requests/welcome.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {

namespace {

using SteadyClock = std::chrono::steady_clock;

/// Maximum lag that a free-running world makes up for; it skips time beyond this lag.
constexpr std::chrono::milliseconds kMaxCatchUp{250};

/// Time for requests before a due tick of a free-running world.
constexpr std::chrono::milliseconds kRequestSlice{5};

/// Time that a guest works in a world before the world's own thread continues.
constexpr std::chrono::milliseconds kGuestTime{5};

/// Idle time after which a recording is flushed to its file.
constexpr std::chrono::milliseconds kFlushDelay{500};

SteadyClock::duration computeTickPeriod(const HostedWorld& hosted) {
  ENFILADE_ASSERT(hosted.clock.speed > 0);
  const std::chrono::duration<double> seconds(hosted.world.settings().tickDuration /
                                              hosted.clock.speed);
  return std::chrono::duration_cast<SteadyClock::duration>(seconds);
}

bool isFreeRunning(const HostedWorld& hosted) {
  return hosted.clock.mode == v1::Clock::MODE_FREE_RUN;
}

/// The client with a Step in progress; 0: none.
ClientId findSteppingClient(const HostedWorld& hosted) {
  for (const auto& [id, client] : hosted.clients) {
    if (!client.pendingStep) continue;
    ENFILADE_ASSERT(hosted.clock.driver == id);
    return id;
  }
  return 0;
}

/// Runs and removes jobs in order. In free-run it stops for a due tick after kRequestSlice.
void runJobs(std::vector<std::function<void(HostedWorld&)>>& jobs, HostedWorld& hosted) {
  const auto sliceEnd = SteadyClock::now() + kRequestSlice;
  std::size_t done = 0;
  while (done < jobs.size()) {
    jobs[done++](hosted);
    if (isFreeRunning(hosted) && SteadyClock::now() >= std::max(sliceEnd, hosted.clock.nextTick)) {
      break;
    }
  }
  jobs.erase(jobs.begin(), jobs.begin() + static_cast<std::ptrdiff_t>(done));
}

void enqueueRequest(HostedWorld& hosted, ClientId id, QueuedRequest request) {
  const auto found = hosted.clients.find(id);
  if (found == hosted.clients.end()) return;
  Client& client = found->second;
  if (client.out->finished()) return;
  client.queue.push_back(std::move(request));
  processQueue(hosted, id);
}

/// Closes the inbox; the first notice is kept. The caller holds the lock.
void closeInbox(TickInbox& inbox, v1::Bye closeNotice) {
  ENFILADE_ASSERT(inbox.closed == inbox.closeNotice.has_value());
  if (inbox.closed) return;
  inbox.closed = true;
  inbox.closeNotice = std::move(closeNotice);
}

std::string describeException(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return error.what();
  }
}

}  // namespace

TickLoop::TickLoop(std::shared_ptr<const scene::Scene> scene, FrameService& frames,
                   QueryService& queries, const WorldOptions& options, WorldIdentity worldIdentity)
    : hosted_(std::move(scene), frames, queries, options, std::move(worldIdentity)) {
  hosted_.post = [inbox = inbox_](Job job) { inbox->post(std::move(job)); };
  hosted_.isEnding = [inbox = inbox_] {
    const std::lock_guard lock(inbox->mutex);
    return inbox->closed;
  };
  thread_ = std::thread([this] { run(); });
}

TickLoop::~TickLoop() {
  stop();
}

ClientId TickLoop::join(std::string name, Role role, std::shared_ptr<OutgoingQueue> out,
                        std::uint64_t requestId, bool guest, MessagePacker pack) {
  ClientId id = 0;
  {
    const std::lock_guard lock(inbox_->mutex);
    if (inbox_->closed) return 0;
    id = ++inbox_->lastId;
    if (!guest) inbox_->members.insert(id);
  }
  const auto addClient = [id, role, requestId, guest, name = std::move(name), out,
                          pack = std::move(pack)](HostedWorld& hosted) {
    if (hosted.closeNotice) return out->finish(encodeBye(*hosted.closeNotice));
    ENFILADE_ASSERT(!hosted.clients.contains(id));
    Client& client = hosted.clients[id];
    client.name = name;
    client.role = role;
    client.guest = guest;
    client.out = out;
    client.pack = pack;
    v1::ServerMessage message;
    message.set_reply_to(requestId);
    *message.mutable_welcome() = makeWelcome(hosted);
    message.mutable_welcome()->set_role(static_cast<v1::Role>(static_cast<int>(role) + 1));
    sendMessage(client, message);
  };
  return post(addClient) ? id : 0;
}

void TickLoop::receive(ClientId id, v1::ClientMessage message, RequestPermit permit) {
  post([id, request = QueuedRequest{std::move(message), std::move(permit)}](
           HostedWorld& hosted) mutable { enqueueRequest(hosted, id, std::move(request)); });
}

void TickLoop::queue(ClientId id, std::vector<v1::ClientMessage> messages) {
  inbox_->queue([id, messages = std::move(messages)](HostedWorld& hosted) mutable {
    for (v1::ClientMessage& message : messages)
      enqueueRequest(hosted, id, {std::move(message), nullptr});
  });
}

void TickLoop::leave(ClientId id) {
  post([id](HostedWorld& hosted) { removeClient(hosted, id); });
  bool empty = false;
  {
    const std::lock_guard lock(inbox_->mutex);
    empty = inbox_->members.erase(id) != 0 && inbox_->members.empty() && !inbox_->closed;
  }
  if (empty && identity().dropWhenEmpty) identity().becameEmpty();
}

bool TickInbox::queue(Job job) {
  const std::lock_guard lock(mutex);
  if (!closed) jobs.push_back(std::move(job));
  return !closed;
}

bool TickInbox::post(Job job) {
  const bool queued = queue(std::move(job));
  if (queued) posted.notify_one();
  return queued;
}

v1::World TickLoop::makeStatus() const {
  const WorldStatus& status = hosted_.status;
  v1::World world;
  world.set_name(identity().name);
  world.set_scene(identity().scene);
  world.set_drop_when_empty(identity().dropWhenEmpty);
  world.set_tick(status.tick);
  world.mutable_clock()->set_mode(status.mode);
  if (status.mode == v1::Clock::MODE_FREE_RUN) world.mutable_clock()->set_speed(status.speed);
  world.mutable_clock()->set_has_driver(status.hasDriver);
  const std::lock_guard lock(inbox_->mutex);
  world.set_clients(static_cast<std::uint32_t>(inbox_->members.size()));
  if (inbox_->failure) world.set_failure(describeException(inbox_->failure));
  return world;
}

void TickLoop::stop(v1::ErrorCode code, const std::string& reason) {
  requestStop(code, reason);
  const std::lock_guard lock(joinMutex_);
  if (thread_.joinable()) thread_.join();
}

void TickLoop::requestStop(v1::ErrorCode code, const std::string& reason) {
  {
    const std::lock_guard lock(inbox_->mutex);
    closeInbox(*inbox_, makeBye(code, reason));
  }
  inbox_->posted.notify_one();
}

bool TickLoop::requestStopIfEmpty(v1::ErrorCode code, const std::string& reason) {
  {
    const std::lock_guard lock(inbox_->mutex);
    if (!inbox_->members.empty()) return false;
    closeInbox(*inbox_, makeBye(code, reason));
  }
  inbox_->posted.notify_one();
  return true;
}

std::exception_ptr TickLoop::failure() const {
  const std::lock_guard lock(inbox_->mutex);
  return inbox_->failure;
}

AuditTotals TickLoop::auditTotals() const {
  ENFILADE_ASSERT(!thread_.joinable());
  return hosted_.statistics.audit();
}

bool TickLoop::isRecordingComplete() const {
  ENFILADE_ASSERT(!thread_.joinable());
  return hosted_.world.isRecordingComplete();
}

void TickLoop::run() {
  try {
    while (waitForJobs()) work();
    runRemainingJobs();
    closeWorld(hosted_);
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

void TickLoop::work() {
  runJobs(jobs_, hosted_);
  if (isStepDue() || takeFreeRunTick()) advance(hosted_);
  processQueue(hosted_, hosted_.clock.driver.value_or(0));
}

/// Whether the owner may not rest until a job comes.
bool TickLoop::hasWork() const {
  return !jobs_.empty() || isFreeRunning(hosted_) || findSteppingClient(hosted_) != 0;
}

/// Returns false if the world has another owner or nothing to do.
bool TickLoop::becomeGuest() {
  const std::lock_guard lock(inbox_->mutex);
  if (inbox_->owner != TickInbox::Owner::none || inbox_->closed || inbox_->jobs.empty())
    return false;
  inbox_->owner = TickInbox::Owner::guest;
  takeJobs();
  return true;
}

void TickLoop::workIfAtRest() {
  using Owner = TickInbox::Owner;
  if (!becomeGuest()) return inbox_->posted.notify_one();
  std::exception_ptr failure;
  try {
    const auto end = SteadyClock::now() + kGuestTime;
    do work();
    while (hasWork() && !isFreeRunning(hosted_) && SteadyClock::now() < end);
  } catch (...) {
    failure = std::current_exception();
  }
  bool isAtRest = false;
  {
    const std::lock_guard lock(inbox_->mutex);
    isAtRest = !failure && !inbox_->closed && inbox_->jobs.empty() && !hasWork() &&
               !hosted_.world.recorder();
    inbox_->guestFailure = failure;
    inbox_->owner = isAtRest ? Owner::none : Owner::thread;
  }
  if (!isAtRest) inbox_->posted.notify_one();
}

/// Runs jobs posted before the end: requests get an error, new clients a Bye.
void TickLoop::runRemainingJobs() {
  for (const Job& job : jobs_) job(hosted_);
  jobs_.clear();
}

/// Ends this world after an internal error; other worlds continue.
void TickLoop::fail(const std::string& reason) {
  writeLog(LogLevel::critical, "the tick of world '{}' failed: {}", identity().name, reason);
  {
    const std::lock_guard lock(inbox_->mutex);
    inbox_->failure = std::current_exception();
    closeInbox(*inbox_, makeBye(v1::ERROR_INTERNAL, "the world failed: " + reason));
    takeJobs();
  }
  try {
    abortWorld(hosted_);
    runRemainingJobs();
  } catch (const std::exception& error) {
    writeLog(LogLevel::critical, "its clients cannot be notified: {}", error.what());
  }
}

/// Waits for jobs or for a due tick; returns false if the loop must end.
bool TickLoop::waitForJobs() {
  std::unique_lock lock(inbox_->mutex);
  const auto awake = [this] { return inbox_->closed || !inbox_->jobs.empty(); };
  if (!hasWork()) {
    rest(lock);
  } else if (isFreeRunning(hosted_) && jobs_.empty()) {
    inbox_->posted.wait_until(lock, hosted_.clock.nextTick, awake);
  }
  takeJobs();
  return !inbox_->closed;
}

/// Waits for jobs. Meanwhile another thread may be the world's guest, unless the world is recorded:
/// the recording is flushed after a while.
void TickLoop::rest(std::unique_lock<std::mutex>& lock) {
  using Owner = TickInbox::Owner;
  const auto awake = [this] { return inbox_->closed || !inbox_->jobs.empty(); };
  if (WorldRecorder* recorder = hosted_.world.recorder()) {
    if (inbox_->posted.wait_for(lock, kFlushDelay, awake)) return;
    lock.unlock();
    recorder->flush();
    lock.lock();
    return inbox_->posted.wait(lock, awake);
  }
  inbox_->owner = Owner::none;
  inbox_->posted.wait(lock, [this, awake] {
    return inbox_->owner == Owner::thread || (inbox_->owner == Owner::none && awake());
  });
  inbox_->owner = Owner::thread;
  if (inbox_->guestFailure) std::rethrow_exception(inbox_->guestFailure);
}

/// The owner calls it, and holds the lock.
void TickLoop::takeJobs() {
  std::move(inbox_->jobs.begin(), inbox_->jobs.end(), std::back_inserter(jobs_));
  inbox_->jobs.clear();
  hosted_.closeNotice = inbox_->closeNotice;
}

bool TickLoop::isStepDue() const {
  return hosted_.clock.mode == v1::Clock::MODE_LOCKSTEP && findSteppingClient(hosted_) != 0;
}

bool TickLoop::takeFreeRunTick() {
  const auto now = SteadyClock::now();
  WorldClock& clock = hosted_.clock;
  if (!isFreeRunning(hosted_) || now < clock.nextTick) return false;
  clock.nextTick = std::max(clock.nextTick + computeTickPeriod(hosted_), now - kMaxCatchUp);
  return true;
}

}  // namespace enfilade::server
