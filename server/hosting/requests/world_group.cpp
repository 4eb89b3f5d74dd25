// Each member has an outgoing queue, as a connection has. While a round is under way, messages are
// taken from the queues as they come; the round ends with the last reply. Between rounds they stay
// in the queues, whose limits hold as for a connection that does not read.
#include "server/hosting/requests/world_group.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "collision/assert.hpp"
#include "protocol/framing.hpp"
#include "server/hosting/requests/shared_memory.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

/// Whether the message replies to a request: field 1, which is written first, is not 0.
bool isReply(const EncodedMessage& message) {
  constexpr std::uint8_t kTagOfReplyTo = 1 << 3;
  const std::vector<std::uint8_t>& head = *message.head;
  return head.size() > protocol::kPrefixBytes && head[protocol::kPrefixBytes] == kTagOfReplyTo;
}

constexpr std::size_t kAlignment = 64;  // bytes, of attachments

std::size_t align(std::size_t offset) {
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

/// Appends the header of a message, which may extend into the second piece. Returns the attachment.
std::span<const std::uint8_t> splitMessage(const EncodedMessage& message, std::string& header) {
  const std::size_t length = protocol::readHeaderLength(*message.head);
  header.assign(message.head->begin() + protocol::kPrefixBytes, message.head->end());
  if (!message.body) return {};
  const std::size_t rest = length - header.size();
  header.append(message.body->begin(), message.body->begin() + static_cast<std::ptrdiff_t>(rest));
  return std::span(*message.body).subspan(rest);
}

v1::Error makeGoneError(const std::string& world) {
  return makeError(v1::ERROR_UNKNOWN_WORLD,
                   "there is no world '" + world + "', or it has ended: create it first",
                   "step_many.worlds.world");
}

/// The server connects to sockets of such names alone, whatever a client asks for.
bool isMemorySocket(std::string_view name) {
  constexpr std::string_view kPrefix = "enfilade-";
  if (!name.starts_with(kPrefix)) return false;
  name.remove_prefix(kPrefix.size());
  const auto isLetterOrDigit = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
  };
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, isLetterOrDigit);
}

/// A world's entry in PackedSteps.
struct PackedStep {
  std::uint64_t tick = 0, stateHash = 0;
  std::array<double, 3> feet{kMissing, kMissing, kMissing};
  std::string blockedBy;
  std::uint64_t lastStoppedTick = 0;
  static constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
};

PackedStep packStep(const v1::StepReply& reply, const std::string& avatarName) {
  PackedStep step;
  step.tick = reply.tick();
  step.stateHash = reply.state_hash();
  for (const v1::AvatarState& avatar : reply.avatars()) {
    if (avatar.name() != avatarName) continue;
    step.feet = {avatar.feet().x(), avatar.feet().y(), avatar.feet().z()};
    step.blockedBy = avatar.move().stopped_by_name();
    step.lastStoppedTick = avatar.last_stopped_tick();
  }
  return step;
}

}  // namespace

/// A client in one world.
struct WorldGroup::Member : std::enable_shared_from_this<Member> {
  std::string world;
  std::shared_ptr<OutgoingQueue> out;
  std::unique_ptr<WorldMembership> membership;

  std::mutex mutex;              // guards the members below
  std::shared_ptr<Round> round;  // null: none is under way
  std::uint64_t expected = 0, replies = 0;
  std::vector<EncodedMessage> messages;
  bool welcomed = false;     // the Welcome was taken, or none will come
  bool ended = false;        // the world said Bye
  std::string packedAvatar;  // in the round; empty: steps have replies
  PackedStep step;

  void begin(const std::shared_ptr<Round>& next, const v1::StepMany::World& request);
  void collect();
  bool pack(const v1::ServerMessage& message);
  void answerRest();
};

/// The memory that a group shares with the client: two halves that take turns.
struct WorldGroup::Memory {
  const std::string socketName;                      ///< of the client
  std::unique_ptr<SharedMemory> current, last = {};  ///< `last`: replaced, but may still be read
  std::uint64_t number = 0;                          ///< of `current`
  std::uint64_t rounds = 0;                          ///< with pictures

  /// Space for an attachment, and where it is; nullopt if a new file cannot be passed to the
  /// client. Throws std::system_error.
  std::optional<std::span<std::uint8_t>> reserve(std::size_t bytes, v1::SharedMemory& place) {
    constexpr std::size_t kMinHalf = 1 << 16;
    const std::size_t half = current ? current->bytes().size() / 2 : 0;
    if (!current || bytes > half) {
      auto larger = std::make_unique<SharedMemory>(2 * std::bit_ceil(std::max(kMinHalf, bytes)));
      if (!larger->passTo(socketName, number + 1)) return std::nullopt;
      ++number;
      last = std::exchange(current, std::move(larger));
    }
    if (bytes > 0) ++rounds;
    const std::size_t offset = rounds % 2 * (current->bytes().size() / 2);
    place.set_number(number);
    place.set_bytes(current->bytes().size());
    place.set_offset(offset);
    return current->bytes().subspan(offset, bytes);
  }
};

/// One StepMany under way.
struct WorldGroup::Round {
  std::uint64_t requestId = 0;
  std::function<void(EncodedMessage)> done;
  std::vector<std::shared_ptr<Member>> members;  ///< in the order of the request
  std::shared_ptr<Memory> memory;                ///< null: not requested
  bool hasPackedSteps = false;
  std::atomic<std::size_t> unfinished = 0;

  void finishOne() {
    if (--unfinished != 0) return;
    try {
      done(encodeReply());
    } catch (const std::system_error& error) {
      done(makeErrorReply(requestId, makeError(v1::ERROR_INTERNAL,
                                               std::string("no shared memory: ") + error.what())));
    }
  }
  EncodedMessage encodeReply();
  void packSteps(v1::PackedSteps& steps) const;
};

void WorldGroup::Member::begin(const std::shared_ptr<Round>& next,
                               const v1::StepMany::World& request) {
  const std::lock_guard lock(mutex);
  round = next;
  expected = static_cast<std::uint64_t>(request.requests_size());
  packedAvatar = request.packed_avatar();
  replies = 0;
  messages.clear();
  step = {};
}

/// Takes what the world has sent; the last reply ends the round. Called from the threads of the
/// world, of its pictures and of its queries.
void WorldGroup::Member::collect() {
  std::shared_ptr<Round> finished;
  {
    const std::lock_guard lock(mutex);
    if (!round) return;
    while (true) {
      OutgoingQueue::Next next = out->pop();
      if (!next.message) break;
      if (isReply(next.message)) ++replies;
      welcomed = true;
      messages.push_back(std::move(next.message));
      if (!next.last) continue;
      ended = true;
      answerRest();
    }
    if (welcomed && replies == expected) finished = std::exchange(round, nullptr);
  }
  if (finished) finished->finishOne();
}

/// Keeps a reply to a Command or a Step as numbers. Called from the world's thread.
bool WorldGroup::Member::pack(const v1::ServerMessage& message) {
  {
    const std::lock_guard lock(mutex);
    if (!round || packedAvatar.empty()) return false;
    if (message.has_step()) {
      step = packStep(message.step(), packedAvatar);
    } else if (!message.command().accepted()) {
      return false;
    }
    ++replies;
  }
  collect();
  return true;
}

/// Errors for the requests that the world did not answer before it ended. The caller holds the
/// lock.
void WorldGroup::Member::answerRest() {
  while (replies < expected) messages.emplace_back(makeErrorReply(++replies, makeGoneError(world)));
}

/// The messages are copied as they are encoded: on the wire, a serialized message is a field of
/// another one. The thread of the last world does this, while all members are at rest.
EncodedMessage WorldGroup::Round::encodeReply() {
  v1::ServerMessage reply;
  reply.set_reply_to(requestId);
  std::vector<std::span<const std::uint8_t>> attachments;
  std::size_t bytes = 0;
  for (const auto& member : members) {
    v1::StepManyReply::World& world = *reply.mutable_step_many()->add_worlds();
    auto& fields = *world.GetReflection()->MutableUnknownFields(&world);
    for (const EncodedMessage& message : member->messages) {
      attachments.push_back(splitMessage(
          message, *fields.AddLengthDelimited(v1::StepManyReply::World::kMessagesFieldNumber)));
      if (!attachments.back().empty()) bytes = align(bytes) + attachments.back().size();
      world.add_attachment_ends(bytes);
    }
  }
  if (hasPackedSteps) packSteps(*reply.mutable_step_many()->mutable_steps());
  if (bytes > protocol::kClientLimits.total / 2 ||
      reply.ByteSizeLong() > protocol::kClientLimits.header / 2) {
    for (const auto& member : members) member->ended = true;  // it has lost events
    return makeErrorReply(
        requestId, makeError(v1::ERROR_TOO_LARGE,
                             "the events or pictures do not fit into one reply: request fewer "
                             "worlds at a time; this connection has left them",
                             "step_many.worlds"));
  }
  v1::SharedMemory place;
  const auto shared = memory ? memory->reserve(bytes, place) : std::nullopt;
  if (shared) *reply.mutable_step_many()->mutable_memory() = std::move(place);
  std::vector<std::uint8_t> own(shared ? 0 : bytes);
  const std::span<std::uint8_t> target = shared.value_or(own);
  std::size_t at = 0;
  for (const auto& attachment : attachments) {
    if (attachment.empty()) continue;
    at = align(at);
    std::ranges::copy(attachment, target.begin() + static_cast<std::ptrdiff_t>(at));
    at += attachment.size();
  }
  return encodeShared(reply, std::move(own));
}

void WorldGroup::Round::packSteps(v1::PackedSteps& steps) const {
  for (const auto& member : members) {
    const PackedStep& step = member->step;
    steps.add_tick(step.tick);
    steps.add_state_hash(step.stateHash);
    for (const double coordinate : step.feet) steps.add_feet(coordinate);
    steps.add_stopped_by_name(step.blockedBy);
    steps.add_last_stopped_tick(step.lastStoppedTick);
  }
}

WorldGroup::WorldGroup(WorldDirectory& directory, std::string name, Role role,
                       const ServerLimits& limits)
    : directory_(directory),
      name_(std::move(name)),
      role_(role),
      limits_{limits.outgoingBytes, limits.outgoingFrames, limits.outgoingFrameBytes,
              std::make_shared<OutgoingBudget>(limits.outgoingBytes)} {}

WorldGroup::~WorldGroup() = default;

std::optional<v1::Error> WorldGroup::validate(const v1::StepMany& request,
                                              std::uint32_t maxWorlds) {
  const auto count = static_cast<std::uint32_t>(request.worlds_size());
  if (count < 1 || count > maxWorlds)
    return makeError(
        v1::ERROR_BAD_MESSAGE,
        "worlds: give 1 to " + std::to_string(maxWorlds) + ", not " + std::to_string(count),
        "step_many.worlds");
  if (!request.memory_socket().empty() && !isMemorySocket(request.memory_socket()))
    return makeError(v1::ERROR_BAD_MESSAGE,
                     "memory_socket: give 'enfilade-' and 1 to 64 letters and digits",
                     "step_many.memory_socket");
  std::set<std::string_view> names;
  for (int i = 0; i < request.worlds_size(); ++i) {
    const v1::StepMany::World& world = request.worlds(i);
    const std::string field = "step_many.worlds[" + std::to_string(i) + "]";
    if (!names.insert(world.world()).second)
      return makeError(v1::ERROR_BAD_MESSAGE, "world: '" + world.world() + "' is in it twice",
                       field + ".world");
    for (int k = 0; k < world.requests_size(); ++k) {
      const v1::ClientMessage& one = world.requests(k);
      if (!one.has_hello() && !one.has_bye() && !one.has_step_many()) continue;
      return makeError(v1::ERROR_BAD_MESSAGE, "requests: hello, bye and step_many cannot be in it",
                       field + ".requests[" + std::to_string(k) + "]");
    }
  }
  return std::nullopt;
}

/// The member of a world; enters the world if necessary. A world that does not exist gives a member
/// without membership.
std::shared_ptr<WorldGroup::Member> WorldGroup::enter(const std::string& world) {
  std::shared_ptr<Member>& member = members_[world];
  if (member && member->membership && !member->ended) return member;
  member = std::make_shared<Member>();
  member->world = world;
  member->out = std::make_shared<OutgoingQueue>(
      limits_, encodeBye(makeBye(v1::ERROR_TOO_SLOW, "its messages were not read in time")),
      [weak = std::weak_ptr(member)] {
        if (const auto self = weak.lock()) self->collect();
      });
  member->membership = directory_.join(world, name_, role_, member->out,
                                       [weak = std::weak_ptr(member)](const auto& message) {
                                         const auto self = weak.lock();
                                         return self && self->pack(message);
                                       });
  if (!member->membership) member->welcomed = true;
  return member;
}

void WorldGroup::submit(const v1::StepMany& request, std::uint64_t requestId,
                        std::function<void(EncodedMessage)> done) {
  const auto round = std::make_shared<Round>();
  round->requestId = requestId;
  round->done = std::move(done);
  if (!request.memory_socket().empty()) {
    if (!memory_ || memory_->socketName != request.memory_socket())
      memory_ = std::make_shared<Memory>(Memory{request.memory_socket(), nullptr});
    round->memory = memory_;
  }
  round->unfinished = static_cast<std::size_t>(request.worlds_size()) + 1;
  for (const v1::StepMany::World& world : request.worlds()) {
    round->members.push_back(enter(world.world()));
    round->hasPackedSteps |= !world.packed_avatar().empty();
  }
  std::vector<std::function<void()>> received;
  for (int i = 0; i < request.worlds_size(); ++i) {
    const v1::StepMany::World& world = request.worlds(i);
    Member& member = *round->members[static_cast<std::size_t>(i)];
    member.begin(round, world);
    if (!member.membership) {
      const std::lock_guard lock(member.mutex);
      member.answerRest();
    } else {
      std::vector<v1::ClientMessage> requests(world.requests().begin(), world.requests().end());
      for (std::size_t k = 0; k < requests.size(); ++k) {
        requests[k].set_request_id(k + 1);
        if (!world.packed_avatar().empty() && requests[k].has_step())
          requests[k].mutable_step()->set_avatars(true);  // its feet are packed
      }
      received.push_back(member.membership->receive(std::move(requests)));
    }
    member.collect();  // what was queued between rounds; ends the round if there are no requests
  }
  for (const v1::StepMany::World& world : request.worlds()) {
    const auto member = members_.find(world.world());
    if (world.leave() || !member->second->membership) members_.erase(member);
  }
  directory_.work(std::move(received));
  round->finishOne();
}

}  // namespace enfilade::server
