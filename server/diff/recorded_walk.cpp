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

Happening happeningOf(const Event& event) {
  Happening happening;
  happening.a = event.a_name();
  happening.b = event.b_name();
  happening.tick = event.tick();
  happening.time = event.time();
  happening.point = vectorFrom(event.point_b());
  happening.normal = vectorFrom(event.normal());
  happening.distance = event.distance();
  return happening;
}

/// As seen from `b`.
Event turnedRound(Event event) {
  std::swap(*event.mutable_a_name(), *event.mutable_b_name());
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

/// Gathers a run, message by message.
class RunGatherer {
 public:
  /// `since`: what is told up to this tick is left out.
  RunGatherer(const v1::RecordingStart& start, std::uint64_t since) : since_(since) {
    run_.start = start;
    run_.hash = start.state_hash();
    for (const v1::Body& body : start.scene().bodies())
      if (body.kind() == "rigid") rigid_.insert(body.name());
  }

  void add(const v1::TickEvents& events) {
    for (const Event& event : events.contacts()) {
      if (event.tick() <= since_) continue;  // of what a branch found alive, too
      isTurned(event) ? add(turnedRound(event)) : add(event);
    }
    if (events.tick() <= since_) return;
    for (const v1::Notice& notice : events.notices()) add(notice, events.time());
  }

  void add(const v1::State& state) {
    run_.ticks = state.tick();
    run_.time = state.time();
    run_.hash = state.hash();
    if (state.tick() <= since_) return;
    for (const v1::AvatarState& avatar : state.avatars()) {
      const Vec3 feet = vectorFrom(avatar.feet());
      const auto [at, isNew] = run_.avatars.try_emplace(avatar.name());
      const auto before = feet_.find(avatar.id());
      if (isNew) at->second.entered = state.time();
      if (before != feet_.end()) at->second.wayLength += (feet - before->second).norm();
      at->second.last = state.time();
      feet_[avatar.id()] = feet;
    }
  }

  const v1::Scene& scene() const { return run_.start.scene(); }
  RecordedRun finish() { return std::move(run_); }

 private:
  /// Of two free bodies the ids tell who comes first, and in another model they may be others: here
  /// it is the names.
  bool isTurned(const Event& event) const {
    return event.b_name() < event.a_name() && rigid_.contains(event.a_name()) &&
           rigid_.contains(event.b_name());
  }

  /// One stands on the other: b lies below, no steeper than ground may be; of two free bodies
  /// either.
  bool isGround(const Event& event) const {
    const double down = -event.normal().y();
    const double steepest = run_.start.lengths().walkable_normal_y();
    return down >= steepest || (-down >= steepest && rigid_.contains(event.b_name()));
  }

  void add(const Event& event) {
    PairRecord& pair = run_.pairs[{event.a_name(), event.b_name()}];
    switch (event.kind()) {
      case Event::KIND_BEGIN:
        begin(pair, event);
        break;
      case Event::KIND_END:
        end(event);
        break;
      case Event::KIND_NEAR:
        // Where it begins it is as near as the walk's step left it; who comes to touch has no
        // least.
        if (event.phase() == Event::PHASE_MIN) noteDistance(pair, event);
        break;
      case Event::KIND_BLOCKED:
        pair.blocked.push_back(happeningOf(event));
        break;
      case Event::KIND_ENTER:
        pair.enters.push_back(happeningOf(event));
        break;
      case Event::KIND_LEAVE:
        pair.leaves.push_back(happeningOf(event));
        break;
      case Event::KIND_LEFT_WORLD:
        pair.falls.push_back(happeningOf(event));
        break;
      default:
        break;
    }
  }

  void begin(PairRecord& pair, const Event& event) {
    auto& list = isGround(event) ? pair.ground : pair.contacts;
    live_[{event.a(), event.b()}] = {&list, list.size()};
    list.push_back(happeningOf(event));
    noteDistance(pair, event);
  }

  void end(const Event& event) {
    const auto found = live_.find({event.a(), event.b()});
    if (found == live_.end()) return;
    (*found->second.first)[found->second.second].ended = event.time();
    live_.erase(found);
  }

  void noteDistance(PairRecord& pair, const Event& event) const {
    if (isGround(event)) return;
    if (pair.nearest && pair.nearest->distance <= event.distance()) return;
    pair.nearest =
        Nearest{event.distance(), event.tick(), event.time(), vectorFrom(event.point_b())};
  }

  void add(const v1::Notice& notice, double time) {
    if (!isEnd(notice)) return;
    OrderEnd end;
    end.kind = notice.kind();
    end.avatar = notice.avatar();
    end.tag = notice.tag();
    end.repeat = ended_[{notice.avatar(), notice.tag(), isLeaving(notice)}]++;
    end.tick = notice.tick();
    end.time = time;
    end.position = vectorFrom(notice.position());
    end.obstacle = notice.obstacle_name();
    end.text = notice.text();
    run_.orders.push_back(std::move(end));
  }

  /// What is dropped was not told in older recordings, and has no outcome to compare.
  static bool isEnd(const v1::Notice& notice) {
    return notice.kind() != v1::Notice::KIND_CAPTURE && notice.kind() != v1::Notice::KIND_DROPPED;
  }
  /// It ends no order that is counted.
  static bool isLeaving(const v1::Notice& notice) { return notice.kind() == v1::Notice::KIND_LEFT; }

  RecordedRun run_;
  const std::uint64_t since_;
  std::set<std::string> rigid_;         ///< names of the free bodies
  std::map<std::uint32_t, Vec3> feet_;  ///< by entity, as of the last tick
  /// Where a contact that lasts stands, by the entities; lists of a std::map's values stay.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::vector<Happening>*, std::size_t>>
      live_;
  std::map<std::tuple<std::string, std::uint64_t, bool>, std::uint32_t> ended_;
};

/// After the first start.
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

WalkMoment endOf(const RecordedWalk& walk) {
  return {walk.runs.size() - 1, walk.runs.back().ticks};
}

RecordedWalk readWalk(const std::filesystem::path& file, const WalkPart& part) {
  protocol::RecordingReader reader(file, part.run);
  RecordedWalk walk;
  walk.file = file;
  walk.run = part.run;
  std::optional<RunGatherer> run;
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (run) walk.runs.push_back(run->finish());
      run.emplace(*start, walk.runs.empty() ? part.since : 0);
      continue;
    }
    if (!run) throw RecordingError(file.string() + ": does not begin with its scene");
    if (const auto* names = std::get_if<v1::RecordedNames>(&*item))
      addNames(walk, run->scene(), *names);
    const auto wanted = [&](const auto& told) {
      return !part.until || WalkMoment{walk.runs.size(), told.tick()} <= *part.until;
    };
    const auto* events = std::get_if<v1::TickEvents>(&*item);
    if (events && wanted(*events)) run->add(*events);
    const auto* state = std::get_if<v1::State>(&*item);
    if (state && wanted(*state)) run->add(*state);
  }
  if (!run) throw RecordingError(file.string() + ": no recording of Enfilade begins in it");
  walk.runs.push_back(run->finish());
  while (part.until && walk.runs.size() > part.until->run + 1) walk.runs.pop_back();
  walk.closed = reader.complete();
  walk.wholeBytes = reader.wholeBytes();
  return walk;
}

}  // namespace enfilade::server
