#include "tests/support/server_load.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "protocol/clients/cpp/async_client.hpp"
#include "scene/world/world.hpp"
#include "tests/server/raw_connection.hpp"

namespace enfilade::tests {

using collision::Vec3;
using Clock = std::chrono::steady_clock;

namespace {

double drawUniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

}  // namespace

std::vector<Vec3> findStandingPlaces(std::shared_ptr<const scene::Scene> still, int count,
                                     unsigned seed) {
  constexpr int kTries = 400;  // for each place
  const scene::Aabb bounds = still->bounds();
  scene::World world(std::move(still));
  std::mt19937_64 random(seed);
  std::vector<Vec3> places;
  for (int i = 0; i < kTries * count && static_cast<int>(places.size()) < count; ++i) {
    const double x = drawUniform(random, bounds.min.x(), bounds.max.x());
    const double y = drawUniform(random, bounds.min.y(), bounds.min.y() + 0.7 * bounds.size().y());
    const double z = drawUniform(random, bounds.min.z(), bounds.max.z());
    scene::submitAvatarCommand(world, {"p" + std::to_string(i), scene::Spawn{Vec3(x, y, z)}, 0});
    const scene::TickReport report = scene::tickWorld(world);
    for (const scene::Notice& notice : report.notices) {
      if (notice.kind == scene::Notice::Kind::spawned) places.push_back(notice.position);
    }
  }
  return places;
}

// ---- load --------------------------------------------------------------------------------------

namespace {

constexpr std::size_t kMaxFaults = 3;  // reported per client

struct DriveCommand {
  std::uint64_t firstTick = 0;  ///< first tick after the command
  std::uint64_t heardTick = 0;  ///< the last tick known when it was sent
  Vec3 velocity;
};

/// One client, with checks of the messages that it must receive.
class Visitor {
 public:
  Visitor(std::size_t number, const LoadOptions& options, LoadResult& result)
      : options_(options),
        result_(result),
        watches_(number % options.watchEvery == 0),
        name_("load" + std::to_string(number)),
        random_(number + 1),
        client_("127.0.0.1", options.port, makeHandlers(), makeClientOptions()) {
    subscribe();
    spawn(options.places[number]);
  }
  Visitor(const Visitor&) = delete;

  protocol::AsyncClient& getClient() { return client_; }
  bool isReady() const { return present_; }
  bool isOver() const { return over_; }
  bool isAnswered() const { return client_.pendingRequests() == 0; }
  std::uint64_t getHeardTick() const { return heardTick_; }

  void runClock() {
    v1::ClientMessage message;
    message.mutable_set_clock()->mutable_free_run()->set_speed(1);
    ask(std::move(message), [](const protocol::Reply&) {});
  }

  /// Drives in a new direction each time, so that a State identifies the command in effect.
  void drive() {
    const double angle = drawUniform(random_, 0, 2 * std::numbers::pi);
    const double speed = drawUniform(random_, 0.5, 1.5);
    DriveCommand command{0, heardTick_, speed * Vec3(std::cos(angle), 0, std::sin(angle))};
    v1::ClientMessage message;
    message.mutable_command()->set_avatar(name_);
    v1::Vec3& velocity = *message.mutable_command()->mutable_drive()->mutable_velocity();
    velocity.set_x(command.velocity.x());
    velocity.set_z(command.velocity.z());
    ++result_.commands;
    ask(std::move(message), [this, command](const protocol::Reply& reply) mutable {
      ++result_.replies;
      if (!reply.message.command().accepted()) {
        ++result_.refused;
        return;
      }
      command.firstTick = reply.message.command().tick();
      if (watches_) pending_.push_back(command);
    });
  }

  void checkEnd() {
    if (!open_.empty()) recordFault(std::to_string(open_.size()) + " contacts never ended");
    if (lost_ > 0) recordFault(std::to_string(lost_) + " requests were not answered");
  }

 private:
  protocol::AsyncOptions makeClientOptions() const {
    protocol::AsyncOptions options;
    options.name = name_;
    return options;
  }

  protocol::AsyncHandlers makeHandlers() {
    protocol::AsyncHandlers handlers;
    handlers.welcome = [this](const v1::Welcome& welcome) {
      ++result_.welcomed;
      tick_ = welcome.policies().tick();
    };
    handlers.events = [this](const v1::TickEvents& events) { hear(events); };
    handlers.state = [this](const v1::State& state) { see(state); };
    handlers.closed = [this](const v1::Error& why) {
      over_ = true;
      if (why.code() != v1::ERROR_SHUTTING_DOWN) return recordFault("cut off: " + why.message());
      ++result_.closedInPeace;
    };
    return handlers;
  }

  void ask(v1::ClientMessage message, protocol::AsyncClient::OnReply onReply) {
    client_.request(std::move(message), [this, onReply](protocol::Reply reply) {
      const bool closing = reply.message.error().code() == v1::ERROR_SHUTTING_DOWN;
      if (reply.lost && !closing) ++lost_;
      if (reply.message.has_error() && !closing) recordFault(reply.message.error().message());
      onReply(std::move(reply));
    });
  }

  void subscribe() {
    v1::ClientMessage message;
    v1::Subscribe& wanted = *message.mutable_subscribe();
    wanted.set_contacts(true);
    wanted.set_notices(true);
    wanted.set_state(watches_);
    wanted.set_state_rate(options_.stateRate);
    ask(std::move(message), [this](const protocol::Reply& reply) {
      for (const v1::ContactEvent& live : reply.message.subscribe().live()) {
        open_.insert({live.a(), live.b()});
        ++result_.begins;  // an avatar that came before has landed already
      }
    });
  }

  void spawn(const Vec3& place) {
    v1::ClientMessage message;
    message.mutable_command()->set_avatar(name_);
    v1::Vec3& at = *message.mutable_command()->mutable_spawn()->mutable_at();
    at.set_x(place.x());
    at.set_y(place.y() + 0.01);
    at.set_z(place.z());
    ask(std::move(message), [](const protocol::Reply&) {});
  }

  void hear(const v1::TickEvents& events) {
    ++result_.tickEvents;
    if (events.sequence() != ++sequence_) {
      recordFault("TickEvents " + std::to_string(events.sequence()) + " came in the place of " +
                  std::to_string(sequence_));
      sequence_ = events.sequence();
    }
    for (const v1::ContactEvent& event : events.contacts()) {
      const std::pair pair{event.a(), event.b()};
      if (event.kind() == v1::ContactEvent::KIND_BEGIN) {
        ++result_.begins;
        if (!open_.insert(pair).second) recordFault("a contact began twice");
      } else if (event.kind() == v1::ContactEvent::KIND_END) {
        ++result_.ends;
        if (open_.erase(pair) == 0) recordFault("a contact ended that had not begun");
      }
    }
    for (const v1::Notice& notice : events.notices()) {
      if (notice.avatar() != name_) continue;
      if (notice.kind() == v1::Notice::KIND_SPAWNED) {
        present_ = true;
        ++result_.spawned;
      }
      if (notice.kind() == v1::Notice::KIND_REFUSED) recordFault("refused: " + notice.text());
    }
  }

  void see(const v1::State& state) {
    ++result_.states;
    result_.droppedStates += state.dropped();
    if (state.tick() <= heardTick_ && heardTick_ != 0) recordFault("a State came out of order");
    heardTick_ = state.tick();
    if (pending_.empty()) return;
    for (const v1::AvatarState& avatar : state.avatars()) {
      if (avatar.name() != name_) continue;
      follow(state.tick(), Vec3(avatar.move().asked().x(), 0, avatar.move().asked().z()) / tick_);
      return;
    }
  }

  /// The newest command in effect was shown now; it replaced those before it.
  void follow(std::uint64_t tick, const Vec3& velocity) {
    constexpr double kSame = 1e-6;  // metres per second; commands differ by far more
    for (std::size_t i = pending_.size(); i-- > 0;) {
      if ((pending_[i].velocity - velocity).norm() > kSame) continue;
      result_.acceptedToShown.push_back(tick + 1 - pending_[i].firstTick);
      result_.sentToShown.push_back(tick - pending_[i].heardTick);
      pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(i + 1));
      return;
    }
  }

  void recordFault(const std::string& text) {
    if (faults_++ < kMaxFaults) result_.faults.push_back(name_ + ": " + text);
  }

  const LoadOptions& options_;
  LoadResult& result_;
  const bool watches_;  ///< receives states
  const std::string name_;
  std::mt19937_64 random_;
  double tick_ = 1;  ///< seconds
  bool present_ = false, over_ = false;
  std::uint64_t sequence_ = 0, heardTick_ = 0, lost_ = 0;
  std::size_t faults_ = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> open_;
  std::deque<DriveCommand> pending_;  ///< accepted, and not shown yet
  protocol::AsyncClient client_;
};

using Visitors = std::vector<std::unique_ptr<Visitor>>;

/// Polls all connections; waits up to `patience` if none is ready.
void turn(Visitors& visitors, std::chrono::milliseconds patience) {
  std::vector<pollfd> sockets;
  for (const auto& visitor : visitors) {
    sockets.push_back({visitor->getClient().descriptor(), visitor->getClient().pollEvents(), 0});
  }
  ::poll(sockets.data(), sockets.size(), static_cast<int>(patience.count()));
  for (std::size_t i = 0; i < visitors.size(); ++i) {
    if (sockets[i].revents != 0 || (sockets[i].fd < 0 && !visitors[i]->isOver())) {
      visitors[i]->getClient().advance();
    }
  }
}

/// Polls until `done` holds for all; false after a timeout.
bool turnUntil(Visitors& visitors, const std::function<bool(const Visitor&)>& done) {
  constexpr std::chrono::seconds kPatience{60};
  const auto giveUp = Clock::now() + kPatience;
  const auto all = [&] {
    return std::all_of(visitors.begin(), visitors.end(),
                       [&](const auto& visitor) { return done(*visitor); });
  };
  while (!all() && Clock::now() < giveUp) turn(visitors, std::chrono::milliseconds(10));
  return all();
}

/// All clients send at the rate, each with its own phase. Sockets are polled once a millisecond:
/// polling after each command would let these clients use up the CPU.
void driveAll(Visitors& visitors, const LoadOptions& options, LoadResult& result) {
  constexpr std::chrono::milliseconds kLook{1};
  const auto start = Clock::now();
  const std::chrono::duration<double> period(1 / options.commandRate);
  const auto end = start + std::chrono::duration<double>(options.seconds);
  const auto steps =
      static_cast<std::size_t>(options.seconds * options.commandRate) * visitors.size();
  const auto due = [&](std::size_t step) {
    return start + period * (static_cast<double>(step) / double(visitors.size()));
  };
  std::size_t step = 0;
  for (auto look = start; look < end; look = std::max(look + kLook, Clock::now())) {
    std::this_thread::sleep_until(look);
    for (; step < steps && due(step) <= look; ++step) {
      Visitor& visitor = *visitors[step % visitors.size()];
      if (!visitor.isOver()) visitor.drive();
    }
    turn(visitors, std::chrono::milliseconds(0));
  }
  result.unsent = steps - step;
}

}  // namespace

LoadResult runLoad(const LoadOptions& options, const std::function<void()>& beforeStop,
                   const std::function<void()>& stop) {
  LoadResult result;
  result.clients = options.places.size();
  Visitors visitors;
  for (std::size_t i = 0; i < options.places.size(); ++i) {
    visitors.push_back(std::make_unique<Visitor>(i, options, result));
    turn(visitors, std::chrono::milliseconds(0));
  }
  visitors.front()->runClock();
  if (!turnUntil(visitors, [](const Visitor& one) { return one.isReady() || one.isOver(); })) {
    result.faults.push_back("not everyone was spawned in time");
  }
  const auto begin = Clock::now();
  const std::uint64_t firstTick = visitors.front()->getHeardTick();
  driveAll(visitors, options, result);
  result.wallSeconds = std::chrono::duration<double>(Clock::now() - begin).count();
  result.ticks = visitors.front()->getHeardTick() - firstTick;
  const auto settled = [](const Visitor& one) { return one.isOver() || one.isAnswered(); };
  if (!turnUntil(visitors, settled)) result.faults.push_back("requests wait for their answers");
  beforeStop();
  stop();
  if (!turnUntil(visitors, [](const Visitor& one) { return one.isOver(); })) {
    result.faults.push_back("not every client received a Bye");
  }
  for (const auto& visitor : visitors) visitor->checkEnd();
  std::sort(result.acceptedToShown.begin(), result.acceptedToShown.end());
  std::sort(result.sentToShown.begin(), result.sentToShown.end());
  return result;
}

// ---- visits ------------------------------------------------------------------------------------

void visitRudely(std::uint16_t port, int count, unsigned seed) {
  using server::testing::RawConnection;
  std::mt19937_64 random(seed);
  for (int i = 0; i < count; ++i) {
    RawConnection raw(port);
    const auto manner = random() % 7;
    if (manner == 0) continue;  // closes at once
    raw.sendHello();
    if (manner == 1) continue;  // does not wait for the Welcome
    if (manner == 2) raw.receive();
    if (manner <= 3) {
      raw.send(std::vector<std::uint8_t>{100, 0, 0, 0, 50, 0, 0, 0, 1, 2, 3});
      continue;  // in the middle of a message
    }
    raw.receive();
    if (manner == 4) {
      raw.closeSending();
      raw.receive();
      continue;
    }
    if (manner == 6) {  // abandons its avatar
      v1::ClientMessage spawn;
      spawn.set_request_id(2);
      spawn.mutable_command()->set_avatar("visitor" + std::to_string(i));
      spawn.mutable_command()->mutable_spawn()->mutable_at()->set_y(0.01);
      raw.send(spawn);
      raw.receive();
      continue;
    }
    v1::ClientMessage bye;
    bye.mutable_bye();
    raw.send(bye);
    raw.readToEnd();
  }
}

Footprint measureFootprint() {
  const auto entries = [](const char* folder) {
    std::uint64_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
    return count;
  };
  Footprint now;
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0;
  statm >> pages >> now.residentBytes;
  now.residentBytes *= static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  now.descriptors = entries("/proc/self/fd");
  now.threads = entries("/proc/self/task");
  return now;
}

}  // namespace enfilade::tests
