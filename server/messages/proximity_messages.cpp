#include "server/messages/proximity_messages.hpp"

#include <algorithm>
#include <cmath>

#include "scene/world/contacts/excluded_pairs.hpp"
#include "server/base/sanitize_for_log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using EntityOrError = std::variant<scene::EntityId, v1::Error>;

constexpr double kFarthestNear = 1000;   // metres
constexpr double kLongestLeast = 3600;   // seconds
constexpr std::size_t kShownBytes = 80;  // of a name that is not found

v1::Error bad(const std::string& field, const std::string& why) {
  return errorOf(v1::ERROR_BAD_MESSAGE, field + why, field);
}

EntityOrError entityOf(bool given, const v1::EntityRef& ref, const scene::SceneThen& then,
                       const std::string& field) {
  if (!given || ref.by_case() == v1::EntityRef::BY_NOT_SET)
    return bad(field, " is missing: give an id or a name");
  const scene::EntityId found =
      ref.has_id() ? scene::entityWith(then, ref.id()) : scene::entityNamed(then, ref.name());
  if (found != 0) return found;
  const std::string which = ref.has_id() ? "the id " + std::to_string(ref.id())
                                         : "the name '" + printable(ref.name(), kShownBytes) + "'";
  return errorOf(
      v1::ERROR_UNKNOWN_ENTITY,
      field + ": nothing has " + which + " now; an avatar may have left, or not entered yet",
      field);
}

struct TwoEntities {
  scene::EntityId a = 0, b = 0;
};

/// Of a message with a and b; `prefix` ends with '.'.
template <class Message>
std::variant<TwoEntities, v1::Error> twoOf(const Message& message, const scene::SceneThen& then,
                                           const std::string& prefix) {
  auto a = entityOf(message.has_a(), message.a(), then, prefix + "a");
  if (auto* error = std::get_if<v1::Error>(&a)) return std::move(*error);
  auto b = entityOf(message.has_b(), message.b(), then, prefix + "b");
  if (auto* error = std::get_if<v1::Error>(&b)) return std::move(*error);
  const TwoEntities two{std::get<scene::EntityId>(a), std::get<scene::EntityId>(b)};
  if (two.a == two.b) return bad(prefix + "b", " is the same as a: give two");
  return two;
}

v1::Error whyNot(const scene::NoAnswer& none, const std::string& prefix) {
  const std::string field = prefix + none.field;
  const bool tooMuch = none.why == scene::NoAnswer::Why::tooComplex;
  return errorOf(tooMuch ? v1::ERROR_TOO_COMPLEX : v1::ERROR_BAD_MESSAGE, field + " " + none.text,
                 field);
}

v1::PairState pairMessageOf(const scene::PairState& state, const scene::SceneThen& then) {
  v1::PairState message;
  message.set_a(state.a);
  message.set_b(state.b);
  message.set_a_name(scene::nameOf(then, state.a));
  message.set_b_name(scene::nameOf(then, state.b));
  putDecision(state.decision, message);
  message.set_penetration(state.penetration);
  return message;
}

template <class Reply>
Reply replyAt(const scene::SceneThen& then) {
  Reply reply;
  reply.set_tick(then.snapshot.tick);
  reply.set_time(then.snapshot.time);
  return reply;
}

/// Of a number in 0..most; a NaN is in no range.
std::optional<v1::Error> outside(const std::string& field, double value, double most,
                                 const char* unit) {
  if (value >= 0 && value <= most) return std::nullopt;
  return bad(field, ": give 0 to " + std::to_string(static_cast<int>(most)) + " " + unit);
}

}  // namespace

std::variant<v1::DistanceReply, v1::Error> answerOf(const v1::DistanceQuery& query,
                                                    const scene::SceneThen& then,
                                                    const ServerLimits& limits) {
  const int most = static_cast<int>(limits.pairs);
  if (query.pairs_size() < 1) return bad("distances.pairs", " is empty: give at least one");
  if (query.pairs_size() > most) {
    return errorOf(v1::ERROR_TOO_LARGE,
                   "distances.pairs has " + std::to_string(query.pairs_size()) +
                       " pairs; ask for at most " + std::to_string(most) + " at a time",
                   "distances.pairs");
  }
  auto reply = replyAt<v1::DistanceReply>(then);
  std::size_t work = scene::kMostWork;
  for (int i = 0; i < query.pairs_size(); ++i) {
    const std::string prefix = "distances.pairs[" + std::to_string(i) + "].";
    auto two = twoOf(query.pairs(i), then, prefix);
    if (auto* error = std::get_if<v1::Error>(&two)) return std::move(*error);
    const auto [a, b] = std::get<TwoEntities>(two);
    const auto state = scene::stateOfPair(then, a, b, query.refined(), work);
    if (const auto* none = std::get_if<scene::NoAnswer>(&state)) return whyNot(*none, prefix);
    *reply.add_pairs() = pairMessageOf(std::get<scene::PairState>(state), then);
  }
  return reply;
}

std::variant<v1::TouchingReply, v1::Error> answerOf(const v1::TouchingQuery& query,
                                                    const scene::SceneThen& then,
                                                    const scene::Lengths& lengths,
                                                    const ServerLimits& limits) {
  auto entity = entityOf(query.has_entity(), query.entity(), then, "touching.entity");
  if (auto* error = std::get_if<v1::Error>(&entity)) return std::move(*error);
  if (auto error = outside("touching.within", query.within(), kFarthestNear, "metres"))
    return std::move(*error);
  std::size_t work = scene::kMostWork;
  const auto found = scene::nearTo(then, std::get<scene::EntityId>(entity), query.within(), work);
  if (const auto* none = std::get_if<scene::NoAnswer>(&found)) return whyNot(*none, "touching.");
  const auto& near = std::get<scene::Near>(found);
  auto reply = replyAt<v1::TouchingReply>(then);
  const scene::BodyView* body = scene::bodyOf(then, std::get<scene::EntityId>(entity));
  if (body)
    for (const scene::EntityId id :
         scene::mountingOf(then.scene(), body->index, scene::contactLimit(lengths)))
      reply.add_mounting(id);
  constexpr std::size_t kFieldBytes = 8;  // a pair's tag and length in the message, at most
  std::size_t bytes = 0;
  for (const scene::PairState& state : near.found) {
    v1::PairState message = pairMessageOf(state, then);
    bytes += message.ByteSizeLong() + kFieldBytes;
    if (bytes > limits.replyBytes) break;
    *reply.add_found() = std::move(message);
  }
  const std::size_t told = static_cast<std::size_t>(reply.found_size());
  reply.set_left_out(static_cast<std::uint32_t>(near.leftOut + near.found.size() - told));
  return reply;
}

std::variant<v1::CannotTouchReply, v1::Error> answerOf(const v1::CannotTouchQuery& query,
                                                       const scene::SceneThen& then,
                                                       const scene::Lengths& lengths) {
  const std::string prefix = "cannot_touch.";
  auto two = twoOf(query, then, prefix);
  if (auto* error = std::get_if<v1::Error>(&two)) return std::move(*error);
  if (auto error = outside(prefix + "least", query.least(), kLongestLeast, "seconds"))
    return std::move(*error);
  const auto [a, b] = std::get<TwoEntities>(two);
  const scene::Assume assume = query.assume() == v1::CannotTouchQuery::ASSUME_ANY_COMMAND
                                   ? scene::Assume::anyCommand
                                   : scene::Assume::presentMotion;
  std::size_t work = scene::kMostWork;
  const auto found = scene::timeApart(then, lengths, a, b, assume, query.least(), work);
  if (const auto* none = std::get_if<scene::NoAnswer>(&found)) return whyNot(*none, prefix);
  const auto& apart = std::get<scene::TimeApart>(found);
  auto reply = replyAt<v1::CannotTouchReply>(then);
  const bool never = std::isinf(apart.contact);
  *reply.mutable_now() = pairMessageOf(apart.now, then);
  reply.set_never(never);
  reply.set_before(never ? 0 : apart.contact);
  reply.set_closing_speed(apart.closing.speed);
  reply.set_closing_acceleration(apart.closing.acceleration);
  reply.set_look_again(never ? query.least() : apart.again.after);
  reply.set_proved(apart.again.proved);
  return reply;
}

}  // namespace enfilade::server
