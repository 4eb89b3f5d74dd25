#include "server/messages/proximity_messages.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "scene/world/contacts/excluded_pairs.hpp"
#include "server/log/sanitize_for_log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using EntityOrError = std::variant<scene::EntityId, v1::Error>;

constexpr double kMaxQueryDistance = 1000;   // metres
constexpr double kMaxTimeHorizon = 3600;     // seconds
constexpr std::size_t kMaxQuotedBytes = 80;  // of an unknown name

v1::Error makeFieldError(const std::string& field, const std::string& reason) {
  return makeError(v1::ERROR_BAD_MESSAGE, field + reason, field);
}

EntityOrError resolveEntity(bool isPresent, const v1::EntityRef& ref, const scene::SceneAt& sceneAt,
                            const std::string& field) {
  if (!isPresent || ref.by_case() == v1::EntityRef::BY_NOT_SET)
    return makeFieldError(field, " is missing: give an id or a name");
  const scene::EntityId found = ref.has_id() ? scene::resolveEntity(sceneAt, ref.id())
                                             : scene::findEntity(sceneAt, ref.name());
  if (found != 0) return found;
  const std::string description =
      ref.has_id() ? "the id " + std::to_string(ref.id())
                   : "the name '" + sanitizeForLog(ref.name(), kMaxQuotedBytes) + "'";
  return makeError(v1::ERROR_UNKNOWN_ENTITY,
                   field + ": no entity has " + description +
                       "; an avatar may have left or not been spawned yet",
                   field);
}

struct EntityPair {
  scene::EntityId a = 0, b = 0;
};

/// Resolves the entities `a` and `b` of a message; `prefix` ends with '.'.
template <class Message>
std::variant<EntityPair, v1::Error> resolvePair(const Message& message,
                                                const scene::SceneAt& sceneAt,
                                                const std::string& prefix) {
  ENFILADE_ASSERT(prefix.ends_with('.'));
  auto a = resolveEntity(message.has_a(), message.a(), sceneAt, prefix + "a");
  if (auto* error = std::get_if<v1::Error>(&a)) return std::move(*error);
  auto b = resolveEntity(message.has_b(), message.b(), sceneAt, prefix + "b");
  if (auto* error = std::get_if<v1::Error>(&b)) return std::move(*error);
  const EntityPair pair{std::get<scene::EntityId>(a), std::get<scene::EntityId>(b)};
  if (pair.a == pair.b)
    return makeFieldError(prefix + "b", " is the same entity as a: give two different ones");
  return pair;
}

v1::Error toError(const scene::QueryError& failure, const std::string& prefix) {
  const std::string field = prefix + failure.field;
  const bool tooComplex = failure.reason == scene::QueryError::Reason::tooComplex;
  return makeError(tooComplex ? v1::ERROR_TOO_COMPLEX : v1::ERROR_BAD_MESSAGE,
                   field + " " + failure.text, field);
}

v1::PairState makePairState(const scene::PairProximity& state, const scene::SceneAt& sceneAt) {
  v1::PairState message;
  message.set_a(state.a);
  message.set_b(state.b);
  message.set_a_name(scene::lookUpEntityName(sceneAt, state.a));
  message.set_b_name(scene::lookUpEntityName(sceneAt, state.b));
  setSeparation(state.separation, message);
  message.set_penetration(state.penetration);
  return message;
}

template <class Reply>
Reply makeReply(const scene::SceneAt& sceneAt) {
  Reply reply;
  reply.set_tick(sceneAt.snapshot.tick);
  reply.set_time(sceneAt.snapshot.time);
  return reply;
}

/// Accepts numbers in 0..maxValue; rejects NaN.
std::optional<v1::Error> validateRange(const std::string& field, double value, double maxValue,
                                       const char* unit) {
  if (value >= 0 && value <= maxValue) return std::nullopt;
  return makeFieldError(field,
                        ": give 0 to " + std::to_string(static_cast<int>(maxValue)) + " " + unit);
}

}  // namespace

std::variant<v1::DistanceReply, v1::Error> answerDistances(const v1::DistanceQuery& query,
                                                           const scene::SceneAt& sceneAt,
                                                           const ServerLimits& limits) {
  const int maxPairs = static_cast<int>(limits.pairs);
  if (query.pairs_size() < 1)
    return makeFieldError("distances.pairs", " is empty: give at least one");
  if (query.pairs_size() > maxPairs) {
    return makeError(v1::ERROR_TOO_LARGE,
                     "distances.pairs has " + std::to_string(query.pairs_size()) +
                         " pairs; request at most " + std::to_string(maxPairs) + " at a time",
                     "distances.pairs");
  }
  auto reply = makeReply<v1::DistanceReply>(sceneAt);
  std::size_t budget = scene::kMaxQueryWork;
  for (int i = 0; i < query.pairs_size(); ++i) {
    const std::string prefix = "distances.pairs[" + std::to_string(i) + "].";
    auto pair = resolvePair(query.pairs(i), sceneAt, prefix);
    if (auto* error = std::get_if<v1::Error>(&pair)) return std::move(*error);
    const auto [a, b] = std::get<EntityPair>(pair);
    const auto state = scene::computePairProximity(sceneAt, a, b, query.refined(), budget);
    if (const auto* failure = std::get_if<scene::QueryError>(&state))
      return toError(*failure, prefix);
    *reply.add_pairs() = makePairState(std::get<scene::PairProximity>(state), sceneAt);
  }
  return reply;
}

std::variant<v1::TouchingReply, v1::Error> answerTouching(const v1::TouchingQuery& query,
                                                          const scene::SceneAt& sceneAt,
                                                          const scene::WorldSettings& settings,
                                                          const ServerLimits& limits) {
  auto entity = resolveEntity(query.has_entity(), query.entity(), sceneAt, "touching.entity");
  if (auto* error = std::get_if<v1::Error>(&entity)) return std::move(*error);
  if (auto error = validateRange("touching.within", query.within(), kMaxQueryDistance, "metres"))
    return std::move(*error);
  std::size_t budget = scene::kMaxQueryWork;
  const auto found =
      scene::findNearbyEntities(sceneAt, std::get<scene::EntityId>(entity), query.within(), budget);
  if (const auto* failure = std::get_if<scene::QueryError>(&found))
    return toError(*failure, "touching.");
  const auto& nearby = std::get<scene::NearbyEntities>(found);
  auto reply = makeReply<v1::TouchingReply>(sceneAt);
  const scene::BodySnapshot* body =
      scene::findBodySnapshot(sceneAt, std::get<scene::EntityId>(entity));
  if (body)
    for (const scene::EntityId id : scene::findExcludedPartners(
             sceneAt.scene(), body->index, scene::computeContactThreshold(settings)))
      reply.add_mounting(id);
  constexpr std::size_t kFieldBytes = 8;  // maximum size of a pair's tag and length in the message
  std::size_t bytes = 0;
  for (const scene::PairProximity& state : nearby.pairs) {
    v1::PairState message = makePairState(state, sceneAt);
    bytes += message.ByteSizeLong() + kFieldBytes;
    if (bytes > limits.replyBytes) break;
    *reply.add_found() = std::move(message);
  }
  const std::size_t includedCount = static_cast<std::size_t>(reply.found_size());
  reply.set_left_out(
      static_cast<std::uint32_t>(nearby.skipped + nearby.pairs.size() - includedCount));
  return reply;
}

std::variant<v1::CannotTouchReply, v1::Error> answerCannotTouch(
    const v1::CannotTouchQuery& query, const scene::SceneAt& sceneAt,
    const scene::WorldSettings& settings) {
  const std::string prefix = "cannot_touch.";
  auto pair = resolvePair(query, sceneAt, prefix);
  if (auto* error = std::get_if<v1::Error>(&pair)) return std::move(*error);
  if (auto error = validateRange(prefix + "least", query.least(), kMaxTimeHorizon, "seconds"))
    return std::move(*error);
  const auto [a, b] = std::get<EntityPair>(pair);
  const scene::MotionAssumption assumption =
      query.assume() == v1::CannotTouchQuery::ASSUME_ANY_COMMAND
          ? scene::MotionAssumption::anyCommand
          : scene::MotionAssumption::presentMotion;
  std::size_t budget = scene::kMaxQueryWork;
  const auto found =
      scene::computeTimeToContact(sceneAt, settings, a, b, assumption, query.least(), budget);
  if (const auto* failure = std::get_if<scene::QueryError>(&found))
    return toError(*failure, prefix);
  const auto& timeToContact = std::get<scene::TimeToContact>(found);
  auto reply = makeReply<v1::CannotTouchReply>(sceneAt);
  const bool never = std::isinf(timeToContact.separatedUntil);
  *reply.mutable_now() = makePairState(timeToContact.proximity, sceneAt);
  reply.set_never(never);
  reply.set_before(never ? 0 : timeToContact.separatedUntil);
  reply.set_closing_speed(timeToContact.closing.speed);
  reply.set_closing_acceleration(timeToContact.closing.acceleration);
  reply.set_look_again(never ? query.least() : timeToContact.nextCheck.after);
  reply.set_proved(timeToContact.nextCheck.proved);
  return reply;
}

}  // namespace enfilade::server
