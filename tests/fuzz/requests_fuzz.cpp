// Fuzz target of all requests, answered by a small world. The input is a sequence of messages. Each
// is preceded by its sender (a byte, of which the lowest bit counts) and its length (two bytes,
// little-endian). Steps run at once, so that the world moves. Images are small and drawn by rays.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <vector>

#include "protocol/framing.hpp"
#include "server/hosting/advance_world.hpp"
#include "server/hosting/requests/dispatch.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/messages/world_messages.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/server/body_room.hpp"

namespace enfilade::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;
using server::Client;
using server::ClientId;
using server::HostedWorld;
using Job = std::function<void(HostedWorld&)>;

constexpr std::size_t kMaxMessages = 64;  // of one input, so that a finding is small
constexpr std::uint32_t kPictureSide = 16;

/// Replies of the services to the tick thread, which is this thread.
class Inbox {
 public:
  void post(Job job) {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
    came_.notify_one();
  }
  Job next() {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [this] { return !jobs_.empty(); });
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    return job;
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Job> jobs_;
};

/// State shared by all inputs, since no request changes it.
struct House {
  House() { spdlog::set_level(spdlog::level::off); }
  std::shared_ptr<const scene::Scene> scene = server::testing::makeBodyRoom();
  server::FrameService frames{scene, {render::RendererKind::rays, {}}};
  server::QueryService questions{scene};
  Inbox inbox;
};

House& getHouse() {
  static House one;
  return one;
}

server::ServerLimits makeSmallLimits() {
  server::ServerLimits limits;
  limits.avatars = 4;
  limits.ticksPerStep = 16;
  limits.waypoints = 16;
  limits.rays = 32;
  limits.scanRays = 256;
  limits.pairs = 8;
  limits.frameSubscriptions = 2;
  return limits;
}

class SmallServer {
 public:
  SmallServer()
      : served_(getHouse().scene, getHouse().frames, getHouse().questions,
                {makeSmallLimits(), {}, 0, {}, {}}) {
    served_.post = [](Job job) { getHouse().inbox.post(std::move(job)); };
    for (const ClientId id : {1, 2}) {
      Client& client = served_.clients[id];
      client.role = server::Role::admin;
      client.out = std::make_shared<server::OutgoingQueue>(
          server::OutgoingLimits{1u << 24, 64},
          server::EncodedMessage(std::make_shared<std::vector<std::uint8_t>>()), [] {});
    }
  }

  /// Handles one message; its reply must arrive, with the message's number.
  void take(ClientId id, const v1::ClientMessage& message) {
    Client& client = served_.clients.at(id);
    client.queue.push_back({message, {}});
    server::processQueue(served_, id);
    while (client.pendingReply || isDrawing()) getHouse().inbox.next()(served_);
    for (std::uint32_t ticks = 0; client.pendingStep; ++ticks) {
      require(ticks < served_.limits.ticksPerStep, "a step's length is limited");
      server::advance(served_);
      while (isDrawing()) getHouse().inbox.next()(served_);
    }
    if (!message.has_bye())
      require(hasReplied(client, message.request_id()), "each request is answered");
    require(served_.statistics.makeMetrics().worst_penetration() == 0, "nothing penetrates");
  }
  void end() { server::closeWorld(served_); }

 private:
  bool isDrawing() const {
    return std::any_of(served_.clients.begin(), served_.clients.end(), [](const auto& one) {
      const auto& subscriptions = one.second.frameSubscriptions;
      return std::any_of(subscriptions.begin(), subscriptions.end(),
                         [](const auto& subscription) { return subscription.second.rendering; });
    });
  }
  /// Reads all messages that were sent.
  static bool hasReplied(Client& client, std::uint64_t requestId) {
    bool found = false;
    for (auto next = client.out->pop(); next.message; next = client.out->pop()) {
      protocol::Decoder decoder(protocol::kClientLimits, protocol::Decoder::Expect::messages);
      std::vector<std::uint8_t> whole = *next.message.head;
      if (const auto& rest = next.message.body)
        whole.insert(whole.end(), rest->begin(), rest->end());
      Bytes bytes(whole);
      const auto framed = decoder.next(bytes);
      v1::ServerMessage reply;
      require(framed && bytes.empty() && protocol::parseHeader(framed->header, reply),
              "replies parse");
      found = found || reply.reply_to() == requestId;
    }
    return found;
  }

  HostedWorld served_;
};

void shrink(v1::FrameRequest& request) {
  const auto fit = [](std::uint32_t side) { return side > 4096 ? side : side % kPictureSide; };
  request.set_width(fit(request.width()));
  request.set_height(fit(request.height()));
}

/// Reduces counts that are legitimately slow.
void shrink(v1::ClientMessage& message) {
  if (message.has_frame()) shrink(*message.mutable_frame());
  if (message.watch_frames().has_frame()) shrink(*message.mutable_watch_frames()->mutable_frame());
}

}  // namespace

void tryBytes(Bytes bytes) {
  constexpr std::size_t kHead = 3;
  SmallServer server;
  for (std::size_t count = 0; bytes.size() >= kHead && count < kMaxMessages; ++count) {
    const ClientId id = 1u + (bytes[0] & 1u);
    const std::size_t length = bytes[1] | static_cast<std::size_t>(bytes[2]) << 8;
    bytes = bytes.subspan(kHead);
    const Bytes part = bytes.first(std::min(length, bytes.size()));
    bytes = bytes.subspan(part.size());
    v1::ClientMessage message;
    if (!protocol::parseHeader(part, message) || message.has_bye())
      continue;  // the session handles it
    message.set_request_id(count + 1);
    shrink(message);
    server.take(id, message);
  }
  server.end();
}

}  // namespace enfilade::fuzz
