#include "server/diff/recorded_walk.hpp"

#include <set>
#include <tuple>
#include <utility>

#include "protocol/recording/recording.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using protocol::mcap::RecordingError;
using Event = v1::ContactEvent;

WalkEvent toWalkEvent(const Event& event) {
  WalkEvent walkEvent;
  walkEvent.a = event.a_name();
  walkEvent.b = event.b_name();
  walkEvent.tick = event.tick();
  walkEvent.time = event.time();
  walkEvent.point = vectorFromProto(event.point_b());
  walkEvent.normal = vectorFromProto(event.normal());
  walkEvent.distance = event.distance();
  walkEvent.aGlobalId = event.a_global_id();
  walkEvent.bGlobalId = event.b_global_id();
  return walkEvent;
}

/// Swaps the roles of a and b.
Event swapSides(Event event) {
  std::swap(*event.mutable_a_name(), *event.mutable_b_name());
  std::swap(*event.mutable_a_global_id(), *event.mutable_b_global_id());
  std::swap(*event.mutable_point_a(), *event.mutable_point_b());
  v1::Vec3& normal = *event.mutable_normal();
  normal.set_x(-normal.x());
  normal.set_y(-normal.y());
  normal.set_z(-normal.z());
  const std::uint32_t a = event.a();
  event.set_a(event.b());
  event.set_b(a);
  return event;
}

/// Collects the data of a run from its messages.
class RunCollector {
 public:
  /// `afterTick`: events up to this tick are skipped.
  RunCollector(const v1::RecordingStart& start, std::uint64_t afterTick) : afterTick_(afterTick) {
    run_.start = start;
    run_.hash = start.state_hash();
    for (const v1::Body& body : start.scene().bodies())
      if (body.kind() == "rigid") dynamicBodies_.insert(body.name());
  }

  void add(const v1::TickEvents& events) {
    for (const Event& event : events.contacts()) {
      if (event.tick() <= afterTick_)
        continue;  // includes contacts active at the start of a branch
      isSwapped(event) ? addContact(swapSides(event)) : addContact(event);
    }
    if (events.tick() <= afterTick_) return;
    for (const v1::Notice& notice : events.notices()) addNotice(notice, events.time());
  }

  void add(const v1::State& state) {
    run_.ticks = state.tick();
    run_.time = state.time();
    run_.hash = state.hash();
    if (state.tick() <= afterTick_) return;
    for (const v1::AvatarState& avatar : state.avatars()) {
      const Vec3 footPosition = vectorFromProto(avatar.feet());
      const auto [at, isNew] = run_.avatars.try_emplace(avatar.name());
      const auto before = footPositions_.find(avatar.id());
      if (isNew) at->second.entered = state.time();
      if (before != footPositions_.end())
        at->second.pathLength += (footPosition - before->second).norm();
      at->second.last = state.time();
      footPositions_[avatar.id()] = footPosition;
    }
  }

  const v1::Scene& scene() const { return run_.start.scene(); }
  RecordedRun finish() { return std::move(run_); }

 private:
  /// True if a and b must be swapped. The recording orders dynamic bodies by ids, which differ
  /// between models; here the order of names applies.
  bool isSwapped(const Event& event) const {
    return event.b_name() < event.a_name() && dynamicBodies_.contains(event.a_name()) &&
           dynamicBodies_.contains(event.b_name());
  }

  /// True for ground contacts: b lies below at a walkable slope; for two dynamic bodies, either
  /// lies below.
  bool isGroundContact(const Event& event) const {
    const double down = -event.normal().y();
    const double walkableNormalY = run_.start.lengths().walkable_normal_y();
    return down >= walkableNormalY ||
           (-down >= walkableNormalY && dynamicBodies_.contains(event.b_name()));
  }

  void addContact(const Event& event) {
    PairRecord& pair = run_.pairs[{event.a_name(), event.b_name()}];
    switch (event.kind()) {
      case Event::KIND_BEGIN:
        beginContact(pair, event);
        break;
      case Event::KIND_END:
        endContact(event);
        break;
      case Event::KIND_NEAR:
        // Only PHASE_MIN has the minimum: the distance at the beginning depends on the step.
        if (event.phase() == Event::PHASE_MIN) updateNearest(pair, event);
        break;
      case Event::KIND_BLOCKED:
        pair.blocked.push_back(toWalkEvent(event));
        break;
      case Event::KIND_ENTER:
        pair.enters.push_back(toWalkEvent(event));
        break;
      case Event::KIND_LEAVE:
        pair.leaves.push_back(toWalkEvent(event));
        break;
      case Event::KIND_LEFT_WORLD:
        pair.falls.push_back(toWalkEvent(event));
        break;
      default:
        break;
    }
  }

  void beginContact(PairRecord& pair, const Event& event) {
    auto& list = isGroundContact(event) ? pair.ground : pair.contacts;
    activeContacts_[{event.a(), event.b()}] = {&list, list.size()};
    list.push_back(toWalkEvent(event));
    updateNearest(pair, event);
  }

  void endContact(const Event& event) {
    const auto found = activeContacts_.find({event.a(), event.b()});
    if (found == activeContacts_.end()) return;
    (*found->second.first)[found->second.second].ended = event.time();
    activeContacts_.erase(found);
  }

  void updateNearest(PairRecord& pair, const Event& event) const {
    if (isGroundContact(event)) return;
    if (pair.nearest && pair.nearest->distance <= event.distance()) return;
    pair.nearest =
        Nearest{event.distance(), event.tick(), event.time(), vectorFromProto(event.point_b())};
  }

  void addNotice(const v1::Notice& notice, double time) {
    if (!endsOrder(notice)) return;
    FinishedOrder end;
    end.kind = notice.kind();
    end.avatar = notice.avatar();
    end.tag = notice.tag();
    end.repeat = endedOrders_[{notice.avatar(), notice.tag(), isLeaving(notice)}]++;
    end.tick = notice.tick();
    end.time = time;
    end.position = vectorFromProto(notice.position());
    end.obstacle = notice.obstacle_name();
    end.text = notice.text();
    run_.orders.push_back(std::move(end));
  }

  /// True if the notice ends an order. Dropped orders have no outcome, and older recordings lack
  /// them.
  static bool endsOrder(const v1::Notice& notice) {
    return notice.kind() != v1::Notice::KIND_CAPTURE && notice.kind() != v1::Notice::KIND_DROPPED;
  }
  /// True if the avatar left. Such a notice ends no counted order.
  static bool isLeaving(const v1::Notice& notice) { return notice.kind() == v1::Notice::KIND_LEFT; }

  RecordedRun run_;
  const std::uint64_t afterTick_;
  std::set<std::string> dynamicBodies_;          ///< names of the dynamic bodies
  std::map<std::uint32_t, Vec3> footPositions_;  ///< positions of the last tick, by entity
  /// Positions of active contacts, by entities. The list pointers stay valid inside a std::map.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::vector<WalkEvent>*, std::size_t>>
      activeContacts_;
  std::map<std::tuple<std::string, std::uint64_t, bool>, std::uint32_t> endedOrders_;
};

/// Adds the names, which follow the first start.
void addNames(RecordedWalk& walk, const v1::Scene& scene, const v1::RecordedNames& names) {
  if (!walk.objects) walk.objects.emplace();
  for (const v1::Body& body : scene.bodies()) {
    if (body.objects().empty() || body.objects(0) < names.first_id()) continue;
    const std::uint32_t at = body.objects(0) - names.first_id();
    if (at < static_cast<std::uint32_t>(names.paths_size()))
      walk.bodies.emplace(body.name(), names.paths(static_cast<int>(at)));
  }
  for (int i = 0; i < names.paths_size(); ++i)
    walk.objects->emplace(names.paths(i), i < names.global_ids_size() ? names.global_ids(i) : "");
}

}  // namespace

WalkMoment findEnd(const RecordedWalk& walk) {
  return {walk.runs.size() - 1, walk.runs.back().ticks};
}

RecordedWalk readWalk(const std::filesystem::path& file, const WalkRange& range) {
  protocol::RecordingReader reader(file, range.run);
  RecordedWalk walk;
  walk.file = file;
  walk.run = range.run;
  std::optional<RunCollector> run;
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (run) walk.runs.push_back(run->finish());
      run.emplace(*start, walk.runs.empty() ? range.afterTick : 0);
      continue;
    }
    if (!run) throw RecordingError(file.string() + ": does not start with its scene");
    if (const auto* names = std::get_if<v1::RecordedNames>(&*item))
      addNames(walk, run->scene(), *names);
    const auto wanted = [&](const auto& message) {
      return !range.until || WalkMoment{walk.runs.size(), message.tick()} <= *range.until;
    };
    const auto* events = std::get_if<v1::TickEvents>(&*item);
    if (events && wanted(*events)) run->add(*events);
    const auto* state = std::get_if<v1::State>(&*item);
    if (state && wanted(*state)) run->add(*state);
  }
  if (!run) throw RecordingError(file.string() + ": not a recording of Enfilade");
  walk.runs.push_back(run->finish());
  while (range.until && walk.runs.size() > range.until->run + 1) walk.runs.pop_back();
  walk.closed = reader.complete();
  walk.wholeBytes = reader.wholeBytes();
  return walk;
}

}  // namespace enfilade::server
