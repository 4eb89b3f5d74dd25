#include "server/hosting/tick_loop.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using SteadyClock = std::chrono::steady_clock;

/// A free-running world that fell behind by more than this gives the lost time up.
constexpr std::chrono::milliseconds kCatchUp{250};

/// While a tick of a free-running world is due, requests are answered for so long before it.
constexpr std::chrono::milliseconds kSlice{5};

/// When a world that waits for commands has stood still for so long, its recording is brought up to
/// it.
constexpr std::chrono::milliseconds kStill{500};

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
  client.waiting.push_back(std::move(request));
  answerWaiting(served, id, post);
}

v1::Bye farewellOf(v1::ErrorCode code, const std::string& reason) {
  v1::Bye farewell;
  farewell.set_code(code);
  farewell.set_reason(reason);
  return farewell;
}

/// With the inbox locked. The first farewell stands.
void end(TickInbox& inbox, v1::Bye farewell) {
  if (inbox.closed) return;
  inbox.closed = true;
  inbox.farewell = std::move(farewell);
}

std::string whatOf(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return error.what();
  }
}

}  // namespace

TickLoop::TickLoop(std::shared_ptr<const scene::Scene> scene, FrameService& frames,
                   QuestionService& questions, const WorldOptions& options, WorldPlace place)
    : served_(std::move(scene), frames, questions, options, std::move(place)) {
  served_.post = [inbox = inbox_](Job job) { inbox->post(std::move(job)); };
  served_.ending = [inbox = inbox_] {
    const std::lock_guard lock(inbox->mutex);
    return inbox->closed;
  };
  thread_ = std::thread([this] { run(); });
}

TickLoop::~TickLoop() {
  stop();
}

ClientId TickLoop::join(std::string name, Role role, std::shared_ptr<OutgoingQueue> out,
                        std::uint64_t requestId, bool guest) {
  ClientId id = 0;
  {
    const std::lock_guard lock(inbox_->mutex);
    if (inbox_->closed) return 0;
    id = ++inbox_->lastId;
    if (!guest) inbox_->members.insert(id);
  }
  const auto greet = [id, role, requestId, name = std::move(name), out](ServedWorld& served) {
    if (served.farewell) return out->finish(goodbyeOf(*served.farewell));
    Client& client = served.clients[id];
    client.name = name;
    client.role = role;
    client.out = out;
    v1::ServerMessage message;
    message.set_reply_to(requestId);
    *message.mutable_welcome() = welcomeOf(served);
    message.mutable_welcome()->set_role(static_cast<v1::Role>(static_cast<int>(role) + 1));
    send(client, message);
  };
  return post(greet) ? id : 0;
}

void TickLoop::receive(ClientId id, v1::ClientMessage message, RequestHold hold) {
  post([id, request =
                WaitingRequest{std::move(message), std::move(hold)}](ServedWorld& served) mutable {
    takeRequest(served, id, std::move(request), served.post);
  });
}

void TickLoop::leave(ClientId id) {
  post([id](ServedWorld& served) { removeClient(served, id); });
  bool empty = false;
  {
    const std::lock_guard lock(inbox_->mutex);
    empty = inbox_->members.erase(id) != 0 && inbox_->members.empty() && !inbox_->closed;
  }
  if (empty && place().dropWhenEmpty) place().becameEmpty();
}

bool TickInbox::post(Job job) {
  {
    const std::lock_guard lock(mutex);
    if (closed) return false;
    jobs.push_back(std::move(job));
  }
  posted.notify_one();
  return true;
}

v1::World TickLoop::glance() const {
  const WorldGlance& seen = served_.glance;
  v1::World world;
  world.set_name(place().name);
  world.set_scene(place().scene);
  world.set_drop_when_empty(place().dropWhenEmpty);
  world.set_tick(seen.tick);
  world.mutable_clock()->set_mode(seen.mode);
  if (seen.mode == v1::Clock::MODE_FREE_RUN) world.mutable_clock()->set_speed(seen.speed);
  world.mutable_clock()->set_has_driver(seen.driven);
  const std::lock_guard lock(inbox_->mutex);
  world.set_clients(static_cast<std::uint32_t>(inbox_->members.size()));
  if (inbox_->failure) world.set_failure(whatOf(inbox_->failure));
  return world;
}

void TickLoop::stop(v1::ErrorCode code, const std::string& reason) {
  askToStop(code, reason);
  const std::lock_guard lock(joining_);
  if (thread_.joinable()) thread_.join();
}

void TickLoop::askToStop(v1::ErrorCode code, const std::string& reason) {
  {
    const std::lock_guard lock(inbox_->mutex);
    end(*inbox_, farewellOf(code, reason));
  }
  inbox_->posted.notify_one();
}

bool TickLoop::askToStopIfEmpty(v1::ErrorCode code, const std::string& reason) {
  {
    const std::lock_guard lock(inbox_->mutex);
    if (!inbox_->members.empty()) return false;
    end(*inbox_, farewellOf(code, reason));
  }
  inbox_->posted.notify_one();
  return true;
}

std::exception_ptr TickLoop::failure() const {
  const std::lock_guard lock(inbox_->mutex);
  return inbox_->failure;
}

AuditTotals TickLoop::auditTotals() const {
  return served_.statistics.audit();
}

bool TickLoop::recordedAll() const {
  return served_.world.recordedAll();
}

void TickLoop::run() {
  try {
    while (takeJobs()) {
      runJobs(jobs_, served_);
      if (stepTicks() || freeRunTicks()) advance(served_);
      const ClientId stepped = served_.clock.driver.value_or(0);
      answerWaiting(served_, stepped, served_.post);
    }
    runLeftOver();
    closeWorld(served_);
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

/// What was posted before the end: requests get an answer, who came is told to go.
void TickLoop::runLeftOver() {
  for (const Job& job : jobs_) job(served_);
  jobs_.clear();
}

/// A fault of ours ends this world, and no other.
void TickLoop::fail(const std::string& why) {
  spdlog::critical("the tick of world '{}' failed: {}", place().name, why);
  {
    const std::lock_guard lock(inbox_->mutex);
    inbox_->failure = std::current_exception();
    end(*inbox_, farewellOf(v1::ERROR_INTERNAL, "the world failed: " + why));
    std::move(inbox_->jobs.begin(), inbox_->jobs.end(), std::back_inserter(jobs_));
    inbox_->jobs.clear();
    served_.farewell = inbox_->farewell;
  }
  try {
    failWorld(served_);
    runLeftOver();
  } catch (const std::exception& error) {
    spdlog::critical("nor could its clients be told: {}", error.what());
  }
}

/// Waits until there are jobs or a tick is due; false when the loop has to end.
bool TickLoop::takeJobs() {
  std::unique_lock lock(inbox_->mutex);
  const auto awake = [this] { return inbox_->closed || !inbox_->jobs.empty(); };
  const bool leftOver = !jobs_.empty();  // by the last slice
  if (freeRunning(served_) && !leftOver) {
    inbox_->posted.wait_until(lock, served_.clock.nextTick, awake);
  } else if (!leftOver && steppingClient(served_) == 0) {
    if (!inbox_->posted.wait_for(lock, kStill, awake)) {
      lock.unlock();
      if (WorldRecorder* recorder = served_.world.recorder()) recorder->flush();
      lock.lock();
      inbox_->posted.wait(lock, awake);
    }
  }
  std::move(inbox_->jobs.begin(), inbox_->jobs.end(), std::back_inserter(jobs_));
  inbox_->jobs.clear();
  served_.farewell = inbox_->farewell;
  return !inbox_->closed;
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
