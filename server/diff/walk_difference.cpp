#include "server/diff/walk_difference.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "protocol/recording/recording.hpp"
#include "server/diff/align_events.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using PairKey = std::pair<std::string, std::string>;
using OrderKey = std::tuple<std::string, std::uint64_t, bool, std::uint32_t>;

using NameMap = std::unordered_map<std::string, std::string>;

std::string lookUpName(const NameMap& map, const std::string& key) {
  const auto found = map.find(key);
  return found == map.end() ? key : found->second;
}

/// Maps names between both models. An entity is an object, identified by its path in the earlier
/// model, or an avatar, by its name. A body is identified by its first object.
class NameMapping {
 public:
  NameMapping(const RecordedWalk& before, const RecordedWalk& after)
      : before_(before), after_(after) {
    if (!before.objects || !after.objects) return;
    NameMap pathById;
    for (const auto& [path, globalId] : *before.objects)
      if (!globalId.empty()) pathById.emplace(globalId, path);
    for (const auto& [path, globalId] : *after.objects) {
      const auto found = globalId.empty() ? pathById.end() : pathById.find(globalId);
      if (found != pathById.end() && found->second != path) renamed_[path] = found->second;
    }
    for (const auto& [path, earlier] : renamed_) takenPaths_.insert(earlier);
    for (const auto& [path, globalId] : *after.objects) laterEntities_.insert(mapPath(path));
  }

  std::string mapEarlierName(const std::string& name) const {
    return lookUpName(before_.bodies, name);
  }
  std::string mapLaterName(const std::string& name) const {
    const std::string path = lookUpName(after_.bodies, name);
    return after_.objects && after_.objects->contains(path) ? mapPath(path) : path;
  }

  /// Finds the models that contain `entity`.
  ModelSide findModel(const std::string& entity) const {
    if (!before_.objects || !after_.objects) return ModelSide::unknown;
    const bool inBefore = before_.objects->contains(entity),
               inAfter = laterEntities_.contains(entity);
    if (inBefore && inAfter) return ModelSide::both;
    return inBefore  ? ModelSide::before
           : inAfter ? ModelSide::after
                     : ModelSide::unknown;  // an avatar
  }

 private:
  std::string mapPath(const std::string& later) const {
    const auto found = renamed_.find(later);
    if (found != renamed_.end()) return found->second;
    // Another object of the later model maps to this earlier path.
    return takenPaths_.contains(later) ? later + "\n" : later;
  }

  const RecordedWalk &before_, &after_;
  NameMap renamed_;                                ///< later path to earlier path, if different
  std::unordered_set<std::string> takenPaths_;     ///< earlier paths of renamed_
  std::unordered_set<std::string> laterEntities_;  ///< entities of the later model
};

std::vector<WalkEvent> PairRecord::*getEventList(WalkEventKind kind) {
  switch (kind) {
    case WalkEventKind::blocked:
      return &PairRecord::blocked;
    case WalkEventKind::fall:
      return &PairRecord::falls;
    case WalkEventKind::enter:
      return &PairRecord::enters;
    case WalkEventKind::leave:
      return &PairRecord::leaves;
    case WalkEventKind::ground:
      return &PairRecord::ground;
    default:
      return &PairRecord::contacts;
  }
}

/// True if a new event of this kind is a regression. New ground and triggers are not.
bool countsAsRegression(WalkEventKind kind) {
  return kind == WalkEventKind::contact || kind == WalkEventKind::blocked ||
         kind == WalkEventKind::fall;
}

/// Compares one run of both walks.
class RunComparison {
 public:
  RunComparison(const RecordedRun& before, const RecordedRun& after, const NameMapping& names,
                std::size_t run, WalkDifference& into)
      : before_(before), after_(after), names_(names), run_(run), into_(into) {}

  void compare() {
    static const PairRecord kNothing;
    std::map<PairKey, Pair> pairs;
    for (const auto& [names, record] : before_.pairs) {
      Pair& pair = pairs[{names_.mapEarlierName(names.first), names_.mapEarlierName(names.second)}];
      pair = {&record, &kNothing, names, {}};
    }
    for (const auto& [names, record] : after_.pairs) {
      Pair& pair = pairs[{names_.mapLaterName(names.first), names_.mapLaterName(names.second)}];
      if (!pair.before) pair.before = &kNothing;
      pair.after = &record;
      pair.names = names;
    }
    for (auto& [entities, pair] : pairs) {
      pair.inModel = names_.findModel(entities.second);
      comparePair(pair);
    }
    compareOrders();
  }

 private:
  struct Pair {
    const PairRecord *before = nullptr, *after = nullptr;
    PairKey names;  ///< names in the later walk, else in the earlier
    ModelSide inModel = ModelSide::unknown;
  };

  void comparePair(const Pair& pair) {
    const std::size_t oldEventCount = into_.events.size();
    for (std::size_t i = 0; i < kWalkEventKinds; ++i)
      compareEvents(pair, static_cast<WalkEventKind>(i));
    const bool oneSided = std::any_of(
        into_.events.begin() + static_cast<std::ptrdiff_t>(oldEventCount), into_.events.end(),
        [](const WalkEventChange& change) {
          return change.kind == WalkEventKind::contact && !(change.before && change.after);
        });
    // A new or removed contact already covers the clearance.
    if (!oneSided) compareClearance(pair);
  }

  void compareEvents(const Pair& pair, WalkEventKind kind) {
    const PairRecord &before = *pair.before, &after = *pair.after;
    const auto& old = before.*getEventList(kind);
    const auto& now = after.*getEventList(kind);
    const auto newChange = [&](std::optional<WalkEvent> one, std::optional<WalkEvent> other) {
      return this->makeChange(kind, pair.inModel, std::move(one), std::move(other));
    };
    std::vector<bool> wasFound(old.size()), isFound(now.size());
    for (const auto& [i, j] : alignEvents(old, now)) {
      wasFound[i] = isFound[j] = true;
      WalkEventChange change = newChange(old[i], now[j]);
      if (change.shift > into_.tolerance || old[i].tick != now[j].tick)
        addChange(std::move(change));
    }
    for (std::size_t i = 0; i < old.size(); ++i) {
      if (wasFound[i]) continue;
      WalkEventChange change = newChange(old[i], std::nullopt);
      if (after.nearest) change.otherDistance = after.nearest->distance;
      addChange(std::move(change));
    }
    for (std::size_t j = 0; j < now.size(); ++j) {
      if (isFound[j]) continue;
      WalkEventChange change = newChange(std::nullopt, now[j]);
      if (before.nearest) change.otherDistance = before.nearest->distance;
      change.worse = countsAsRegression(kind);
      addChange(std::move(change));
    }
  }

  WalkEventChange makeChange(WalkEventKind kind, ModelSide inModel, std::optional<WalkEvent> before,
                             std::optional<WalkEvent> after) const {
    WalkEventChange change;
    change.kind = kind;
    change.run = run_;
    change.inModel = inModel;
    if (before && after) {
      change.shift = (after->point - before->point).norm();
      change.delay = after->time - before->time;
    }
    change.before = std::move(before);
    change.after = std::move(after);
    return change;
  }

  void addChange(WalkEventChange change) { into_.events.push_back(std::move(change)); }

  static double getNearMissDistance(const RecordedRun& run) {
    return run.start.lengths().near_miss();
  }

  /// Drops distances that the other walk would not have reported.
  static std::optional<Nearest> limitToRadius(const std::optional<Nearest>& nearest,
                                              double radius) {
    return nearest && nearest->distance <= radius ? nearest : std::nullopt;
  }

  /// Compares the clearance of a pair. A missing one was larger than the near miss distance.
  void compareClearance(const Pair& pair) {
    const double contact = 2 * before_.start.lengths().epsilon();
    const double radius =
        std::max(contact, std::min(getNearMissDistance(before_), getNearMissDistance(after_)));
    const auto old = limitToRadius(pair.before->nearest, radius),
               now = limitToRadius(pair.after->nearest, radius);
    if (!old && !now) return;
    double minChange = (now ? now->distance : radius) - (old ? old->distance : radius);
    if (!old) minChange = std::min(minChange, 0.0);
    if (!now) minChange = std::max(minChange, 0.0);
    if (!(std::abs(minChange) > into_.tolerance)) return;
    ClearanceChange change;
    std::tie(change.a, change.b) = pair.names;
    change.before = old;
    change.after = now;
    change.minChange = minChange;
    change.inModel = pair.inModel;
    change.run = run_;
    change.worse = minChange < 0;
    into_.clearances.push_back(std::move(change));
  }

  static std::map<OrderKey, const FinishedOrder*> indexOrders(const RecordedRun& run) {
    std::map<OrderKey, const FinishedOrder*> orders;
    for (const FinishedOrder& end : run.orders)
      orders[{end.avatar, end.tag, end.kind == v1::Notice::KIND_LEFT, end.repeat}] = &end;
    return orders;
  }

  static bool hasSucceeded(const FinishedOrder& end) {
    return end.kind != v1::Notice::KIND_BLOCKED && end.kind != v1::Notice::KIND_REFUSED &&
           !(end.kind == v1::Notice::KIND_LEFT && !end.text.empty());
  }

  void compareOrders() {
    const auto before = indexOrders(before_), after = indexOrders(after_);
    for (const auto& [key, old] : before) {
      const auto found = after.find(key);
      compareOrder(old, found == after.end() ? nullptr : found->second);
    }
    for (const auto& [key, now] : after)
      if (!before.contains(key)) compareOrder(nullptr, now);
  }

  void compareOrder(const FinishedOrder* old, const FinishedOrder* now) {
    if (old && now && old->kind == now->kind && old->tick == now->tick && old->text == now->text)
      return;
    OrderChange change;
    if (old) change.before = *old;
    if (now) change.after = *now;
    const bool wasWell = old && hasSucceeded(*old), isWell = now && hasSucceeded(*now);
    const bool leaving = (old ? old : now)->kind == v1::Notice::KIND_LEFT;
    change.worse =
        leaving ? now && !isWell && !(old && !wasWell) : (wasWell && !isWell) || (!old && !isWell);
    change.run = run_;
    into_.orders.push_back(std::move(change));
  }

  const RecordedRun &before_, &after_;
  const NameMapping& names_;
  std::size_t run_;
  WalkDifference& into_;
};

/// Reads the states of a recording in order.
class StateReader {
 public:
  explicit StateReader(const RecordedWalk& walk) : reader_(walk.file, walk.run) { next(); }

  bool isAtEnd() const { return !state_; }
  std::pair<std::size_t, std::uint64_t> position() const { return {run_, state_->tick()}; }
  const v1::State& state() const { return *state_; }

  void next() {
    state_.reset();
    while (auto item = reader_.next()) {
      if (std::holds_alternative<v1::RecordingStart>(*item)) ++run_;
      if (auto* state = std::get_if<v1::State>(&*item)) {
        state_ = std::move(*state);
        return;
      }
    }
  }

 private:
  protocol::RecordingReader reader_;
  std::optional<v1::State> state_;
  std::size_t run_ = 0;  ///< number of the run, from 1
};

/// Compares the avatars' positions in all common ticks.
std::map<std::pair<std::size_t, std::string>, PathChange> findPathChanges(
    const RecordedWalk& before, const RecordedWalk& after) {
  std::map<std::pair<std::size_t, std::string>, PathChange> changes;
  StateReader a(before), b(after);
  while (!a.isAtEnd() && !b.isAtEnd()) {
    if (a.position() < b.position()) {
      a.next();
      continue;
    }
    if (b.position() < a.position()) {
      b.next();
      continue;
    }
    for (const v1::AvatarState& old : a.state().avatars()) {
      for (const v1::AvatarState& now : b.state().avatars()) {
        if (now.name() != old.name()) continue;
        const double distance = (vectorFromProto(now.feet()) - vectorFromProto(old.feet())).norm();
        if (!(distance > 0)) break;
        PathChange& path = changes[{a.position().first, old.name()}];
        if (path.firstTick == 0) path.firstTick = a.state().tick();
        if (distance > path.maxDistance) {
          path.maxDistance = distance;
          path.maxDistanceTick = a.state().tick();
        }
        break;
      }
    }
    a.next();
    b.next();
  }
  return changes;
}

void comparePaths(WalkDifference& into) {
  auto changes = findPathChanges(into.before, into.after);
  for (std::size_t run = 0; run < std::min(into.before.runs.size(), into.after.runs.size());
       ++run) {
    const auto &before = into.before.runs[run].avatars, &after = into.after.runs[run].avatars;
    std::set<std::string> avatarNames;
    for (const auto& [name, avatar] : before) avatarNames.insert(name);
    for (const auto& [name, avatar] : after) avatarNames.insert(name);
    for (const std::string& name : avatarNames) {
      const auto found = changes.find({run + 1, name});
      const bool inBoth = before.contains(name) && after.contains(name);
      if (inBoth && found == changes.end()) continue;
      PathChange path = found == changes.end() ? PathChange{} : found->second;
      path.avatar = name;
      path.run = run;
      if (before.contains(name)) path.before = before.at(name);
      if (after.contains(name)) path.after = after.at(name);
      into.paths.push_back(std::move(path));
    }
  }
}

/// Weight for sorting within a kind, heaviest first.
double computeWeight(const WalkEventChange& change) {
  if (change.before && change.after) return -1e6 + change.shift + 1e-3 * std::abs(change.delay);
  const double lost = change.otherDistance.value_or(1e3);
  return change.after ? 1e6 + lost : lost;
}

double getChangeTime(const WalkEventChange& change) {
  return change.after ? change.after->time : change.before->time;
}

/// Sorts: blocked moves first, then contacts; changes that are not regressions last.
void sortWorstFirst(WalkDifference& into) {
  std::stable_sort(into.events.begin(), into.events.end(),
                   [](const WalkEventChange& x, const WalkEventChange& y) {
                     return std::tuple(!x.worse, x.kind, -computeWeight(x), getChangeTime(x)) <
                            std::tuple(!y.worse, y.kind, -computeWeight(y), getChangeTime(y));
                   });
  std::stable_sort(into.orders.begin(), into.orders.end(),
                   [](const OrderChange& x, const OrderChange& y) { return x.worse > y.worse; });
  std::stable_sort(
      into.clearances.begin(), into.clearances.end(),
      [](const ClearanceChange& x, const ClearanceChange& y) { return x.minChange < y.minChange; });
}

template <class Changes>
std::size_t countWorse(const Changes& changes) {
  return static_cast<std::size_t>(std::count_if(changes.begin(), changes.end(),
                                                [](const auto& change) { return change.worse; }));
}

const v1::RecordingParent& getParent(const RecordedWalk& walk) {
  return walk.runs.front().start.parent();
}

/// Finds the run that a branch left, in the recording of its parent.
std::optional<std::uint32_t> findParentRun(const RecordedWalk& branch, const RecordedWalk& walk) {
  const v1::RecordingParent& parent = getParent(branch);
  const std::uint32_t run = std::max(parent.run(), 1U);
  const bool isBranch = branch.runs.front().start.has_parent() &&
                        std::filesystem::path(parent.file()).filename() == walk.file.filename();
  return isBranch && walk.runs.size() > 1 && run <= walk.runs.size() ? run : walk.run;
}

/// Reads the common range of both walks. A branch has no data before its start, and a truncated
/// recording has none after its end.
void readBothWalks(const std::filesystem::path& before, const std::filesystem::path& after,
                   std::optional<std::uint32_t> run, WalkDifference& into) {
  into.before = readWalk(before, {run});
  into.after = readWalk(after);
  WalkRange old{findParentRun(into.after, into.before)},
      now{findParentRun(into.before, into.after)};
  if (old.run != into.before.run) into.before = readWalk(before, old);
  if (now.run != into.after.run) into.after = readWalk(after, now);
  old.afterTick = now.afterTick =
      std::max(getParent(into.before).tick(), getParent(into.after).tick());
  for (const RecordedWalk* walk : {&into.before, &into.after})
    if (!walk->closed && (!old.until || findEnd(*walk) < *old.until)) old.until = findEnd(*walk);
  now.until = old.until;
  if (old.afterTick == 0 && !old.until) return;
  into.before = readWalk(before, old);
  into.after = readWalk(after, now);
}

}  // namespace

bool WalkDifference::isEmpty() const {
  if (before.runs.size() != after.runs.size()) return false;
  for (std::size_t i = 0; i < before.runs.size(); ++i)
    if (before.runs[i].ticks != after.runs[i].ticks) return false;
  return events.empty() && orders.empty() && clearances.empty() && paths.empty();
}

WalkDifference compareWalks(const std::filesystem::path& before, const std::filesystem::path& after,
                            double tolerance, std::optional<std::uint32_t> runBefore) {
  WalkDifference difference;
  difference.tolerance = tolerance;
  readBothWalks(before, after, runBefore, difference);
  auto &old = difference.before.runs, &now = difference.after.runs;
  const NameMapping names(difference.before, difference.after);
  for (std::size_t run = 0; run < std::min(old.size(), now.size()); ++run)
    RunComparison(old[run], now[run], names, run, difference).compare();
  comparePaths(difference);
  sortWorstFirst(difference);
  difference.worse = countWorse(difference.events) + countWorse(difference.orders) +
                     countWorse(difference.clearances);
  for (auto* runs : {&old, &now})
    for (RecordedRun& run : *runs) run.pairs.clear();
  return difference;
}

}  // namespace enfilade::server
