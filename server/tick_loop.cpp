#include "server/tick_loop.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>

#include "server/world_messages.hpp"

namespace enfilade::server {

namespace {

using SteadyClock = std::chrono::steady_clock;

/// A free-running world that fell behind by more than this gives the lost time up.
constexpr std::chrono::milliseconds kCatchUp{250};

/// While a tick of a free-running world is due, requests are answered for so long before it.
constexpr std::chrono::milliseconds kSlice{5};

SteadyClock::duration tickPeriod(const ServedWorld& served) {
  const std::chrono::duration<double> seconds(served.world.lengths().tick / served.clock.speed);
  return std::chrono::duration_cast<SteadyClock::duration>(seconds);
}

bool freeRunning(const ServedWorld& served) {
  return served.clock.mode == v1::Clock::MODE_FREE_RUN;
}

/// The driver's client while it waits for its ticks.
ClientId steppingClient(const ServedWorld& served) {
  for (const auto& [id, client] : served.clients) {
    if (client.step) return id;
  }
  return 0;
}

/// Runs jobs in order and takes them out; in free-run a due tick goes first once kSlice is over.
void runJobs(std::vector<std::function<void(ServedWorld&)>>& jobs, ServedWorld& served) {
  const auto sliceEnd = SteadyClock::now() + kSlice;
  std::size_t done = 0;
  while (done < jobs.size()) {
    jobs[done++](served);
    if (freeRunning(served) && SteadyClock::now() >= std::max(sliceEnd, served.clock.nextTick)) {
      break;
    }
  }
  jobs.erase(jobs.begin(), jobs.begin() + static_cast<std::ptrdiff_t>(done));
}

void takeRequest(ServedWorld& served, ClientId id, WaitingRequest request,
                 const PostToTickThread& post) {
  const auto found = served.clients.find(id);
  if (found == served.clients.end()) return;
  Client& client = found->second;
  if (client.out->finished()) return;
  client.waitingBytes += request.bytes;
  client.waiting.push_back(std::move(request));
  answerWaiting(served, id, post);
  if (client.waitingBytes <= served.limits.waitingBytes) return;
  v1::ServerMessage bye;
  bye.mutable_bye()->set_code(v1::ERROR_TOO_LARGE);
  bye.mutable_bye()->set_reason("more than " + std::to_string(served.limits.waitingBytes) +
                                " bytes of requests wait: read replies before sending more");
  client.out->finish(encodeShared(bye));
  removeClient(served, id);
}

}  // namespace

TickLoop::TickLoop(std::shared_ptr<const scene::Scene> scene, FrameService& frames,
                   RayService& rays, const WorldOptions& options)
    : served_(std::move(scene), frames, rays, options) {
  served_.post = [this](Job job) { post(std::move(job)); };
  thread_ = std::thread([this] { run(); });
}

TickLoop::~TickLoop() {
  stop();
}

ClientId TickLoop::join(std::string name, Role role, std::shared_ptr<OutgoingQueue> out,
                        std::uint64_t requestId) {
  ClientId id = 0;
  {
    const std::lock_guard lock(mutex_);
    id = ++lastId_;
  }
  post([id, role, requestId, name = std::move(name), out = std::move(out)](ServedWorld& served) {
    Client& client = served.clients[id];
    client.name = name;
    client.role = role;
    client.out = out;
    v1::ServerMessage message;
    message.set_reply_to(requestId);
    *message.mutable_welcome() = welcomeOf(served);
    message.mutable_welcome()->set_role(static_cast<v1::Role>(static_cast<int>(role) + 1));
    send(client, message);
  });
  return id;
}

void TickLoop::receive(ClientId id, v1::ClientMessage message, std::size_t bytes) {
  post([this, id, request = WaitingRequest{std::move(message), bytes}](ServedWorld& served) {
    takeRequest(served, id, request, [this](Job job) { post(std::move(job)); });
  });
}

void TickLoop::leave(ClientId id) {
  post([id](ServedWorld& served) { removeClient(served, id); });
}

void TickLoop::post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    inbox_.push_back(std::move(job));
  }
  posted_.notify_one();
}

void TickLoop::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  posted_.notify_one();
  if (thread_.joinable()) thread_.join();
}

std::exception_ptr TickLoop::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

AuditTotals TickLoop::auditTotals() const {
  return served_.statistics.audit();
}

void TickLoop::run() {
  try {
    while (takeJobs()) {
      runJobs(jobs_, served_);
      if (stepTicks() || freeRunTicks()) advance(served_);
      const ClientId stepped = served_.clock.driver.value_or(0);
      answerWaiting(served_, stepped, [this](Job job) { post(std::move(job)); });
    }
    closeWorld(served_);
  } catch (const std::exception& error) {
    spdlog::critical("the tick failed: {}", error.what());
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    stopping_ = true;
  }
}

/// Waits until there are jobs or a tick is due; false when the loop has to end.
bool TickLoop::takeJobs() {
  std::unique_lock lock(mutex_);
  const auto awake = [this] { return stopping_ || !inbox_.empty(); };
  const bool leftOver = !jobs_.empty();  // by the last slice
  if (freeRunning(served_) && !leftOver) {
    posted_.wait_until(lock, served_.clock.nextTick, awake);
  } else if (!leftOver && steppingClient(served_) == 0) {
    posted_.wait(lock, awake);
  }
  std::move(inbox_.begin(), inbox_.end(), std::back_inserter(jobs_));
  inbox_.clear();
  return !stopping_;
}

bool TickLoop::stepTicks() {
  return served_.clock.mode == v1::Clock::MODE_LOCKSTEP && steppingClient(served_) != 0;
}

bool TickLoop::freeRunTicks() {
  const auto now = SteadyClock::now();
  ServedClock& clock = served_.clock;
  if (!freeRunning(served_) || now < clock.nextTick) return false;
  clock.nextTick = std::max(clock.nextTick + tickPeriod(served_), now - kCatchUp);
  return true;
}

}  // namespace enfilade::server
