#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "protocol/recording.hpp"
#include "server/diff/walk_difference.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {
namespace {

using PairKey = std::pair<std::string, std::string>;
using OrderKey = std::tuple<std::string, std::uint64_t, bool, std::uint32_t>;

/// The names of the later walk as the earlier one has them, and what is in which model.
class Names {
 public:
  Names(const RecordedWalk& before, const RecordedWalk& after)
      : before_(before.objects), after_(after.objects) {
    addBodies(before, bodiesBefore_);
    addBodies(after, bodiesAfter_);
    if (!before_ || !after_) return;
    std::unordered_map<std::string, std::string> pathOf;
    for (const auto& [path, globalId] : *before_)
      if (!globalId.empty()) pathOf.emplace(globalId, path);
    for (const auto& [path, globalId] : *after_) {
      const auto found = globalId.empty() ? pathOf.end() : pathOf.find(globalId);
      if (found != pathOf.end() && found->second != path) renamed_[path] = found->second;
    }
    for (const auto& [path, earlier] : renamed_) taken_.insert(earlier);
  }

  /// The same for the same thing in both walks.
  std::string keyOfLater(const std::string& name) const {
    const auto found = renamed_.find(name);
    if (found != renamed_.end()) return found->second;
    // The earlier object of this path goes by another one now.
    return taken_.contains(name) ? name + "\n" : name;
  }

  /// `name` as a walk has it where it occurs.
  Model modelOf(const std::string& name, bool later) const {
    if (!before_ || !after_) return Model::unknown;
    const auto inBefore = [&](const std::string& n) {
      return before_->contains(n) || bodiesBefore_.contains(n);
    };
    const auto inAfter = [&](const std::string& n) {
      return after_->contains(n) || bodiesAfter_.contains(n);
    };
    if (later) {
      if (!inAfter(name)) return Model::unknown;  // an avatar
      return inBefore(keyOfLater(name)) ? Model::both : Model::after;
    }
    if (!inBefore(name)) return Model::unknown;
    return taken_.contains(name) || inAfter(name) ? Model::both : Model::before;
  }

 private:
  static void addBodies(const RecordedWalk& walk, std::set<std::string>& names) {
    for (const v1::Body& body : walk.runs.front().start.scene().bodies()) names.insert(body.name());
  }

  const std::optional<std::unordered_map<std::string, std::string>>&before_, &after_;
  std::set<std::string> bodiesBefore_, bodiesAfter_;
  std::unordered_map<std::string, std::string> renamed_;  ///< later path to earlier path
  std::set<std::string> taken_;                           ///< earlier paths of those
};

std::vector<Happening> PairRecord::*listOf(HappeningKind kind) {
  switch (kind) {
    case HappeningKind::blocked:
      return &PairRecord::blocked;
    case HappeningKind::fall:
      return &PairRecord::falls;
    case HappeningKind::enter:
      return &PairRecord::enters;
    case HappeningKind::leave:
      return &PairRecord::leaves;
    case HappeningKind::ground:
      return &PairRecord::ground;
    default:
      return &PairRecord::contacts;
  }
}

/// What was new makes it worse: to stand on something else, or to come into a trigger, does not.
bool countsAsWorse(HappeningKind kind) {
  return kind == HappeningKind::contact || kind == HappeningKind::blocked ||
         kind == HappeningKind::fall;
}

/// Compares one run of both walks.
class RunComparison {
 public:
  RunComparison(const RecordedRun& before, const RecordedRun& after, const Names& names,
                std::size_t run, WalkDifference& into)
      : before_(before), after_(after), names_(names), run_(run), into_(into) {}

  void compare() {
    std::map<PairKey, std::pair<const PairRecord*, const PairRecord*>> pairs;
    for (const auto& [names, pair] : before_.pairs) pairs[names].first = &pair;
    for (const auto& [names, pair] : after_.pairs)
      pairs[{names_.keyOfLater(names.first), names_.keyOfLater(names.second)}].second = &pair;
    static const PairRecord kNothing;
    for (const auto& [key, both] : pairs)
      comparePair(both.first ? *both.first : kNothing, both.second ? *both.second : kNothing, key);
    compareOrders();
  }

 private:
  void comparePair(const PairRecord& before, const PairRecord& after, const PairKey& key) {
    const std::size_t told = into_.happenings.size();
    for (std::size_t i = 0; i < kHappeningKinds; ++i)
      compareHappenings(before, after, static_cast<HappeningKind>(i));
    const bool oneSided = std::any_of(into_.happenings.begin() + static_cast<std::ptrdiff_t>(told),
                                      into_.happenings.end(), [](const HappeningChange& change) {
                                        return change.kind == HappeningKind::contact &&
                                               !(change.before && change.after);
                                      });
    // A contact that is new or gone says it already.
    if (!oneSided) compareClearance(before, after, key);
  }

  void compareHappenings(const PairRecord& before, const PairRecord& after, HappeningKind kind) {
    const auto& was = before.*listOf(kind);
    const auto& is = after.*listOf(kind);
    std::vector<bool> wasFound(was.size()), isFound(is.size());
    for (const auto& [i, j] : matchedHappenings(was, is)) {
      wasFound[i] = isFound[j] = true;
      HappeningChange change = changeOf(kind, was[i], is[j]);
      if (change.shift > into_.tolerance || was[i].tick != is[j].tick) add(std::move(change));
    }
    for (std::size_t i = 0; i < was.size(); ++i) {
      if (wasFound[i]) continue;
      HappeningChange change = changeOf(kind, was[i], std::nullopt);
      if (after.nearest) change.otherwise = after.nearest->distance;
      add(std::move(change));
    }
    for (std::size_t j = 0; j < is.size(); ++j) {
      if (isFound[j]) continue;
      HappeningChange change = changeOf(kind, std::nullopt, is[j]);
      if (before.nearest) change.otherwise = before.nearest->distance;
      change.worse = countsAsWorse(kind);
      add(std::move(change));
    }
  }

  HappeningChange changeOf(HappeningKind kind, std::optional<Happening> before,
                           std::optional<Happening> after) const {
    HappeningChange change;
    change.kind = kind;
    change.run = run_;
    change.inModel = after ? names_.modelOf(after->b, true) : names_.modelOf(before->b, false);
    if (before && after) {
      change.shift = (after->point - before->point).norm();
      change.delay = after->time - before->time;
    }
    change.before = std::move(before);
    change.after = std::move(after);
    return change;
  }

  void add(HappeningChange change) { into_.happenings.push_back(std::move(change)); }

  static double nearMiss(const RecordedRun& run) { return run.start.lengths().near_miss(); }

  /// Where one walk told nothing of the pair, it was farther than what that one tells.
  void compareClearance(const PairRecord& before, const PairRecord& after, const PairKey& key) {
    if (!before.nearest && !after.nearest) return;
    const double was = before.nearest ? before.nearest->distance : nearMiss(before_);
    const double is = after.nearest ? after.nearest->distance : nearMiss(after_);
    double least = is - was;
    if (!before.nearest) least = std::min(least, 0.0);
    if (!after.nearest) least = std::max(least, 0.0);
    if (!(std::abs(least) > into_.tolerance)) return;
    ClearanceChange change;
    change.a = key.first;
    change.b = key.second.substr(0, key.second.find('\n'));
    change.before = before.nearest;
    change.after = after.nearest;
    change.least = least;
    change.inModel = names_.modelOf(change.b, !before.nearest);
    change.run = run_;
    change.worse = least < 0;
    into_.clearances.push_back(std::move(change));
  }

  static std::map<OrderKey, const OrderEnd*> ordersOf(const RecordedRun& run) {
    std::map<OrderKey, const OrderEnd*> orders;
    for (const OrderEnd& end : run.orders)
      orders[{end.avatar, end.tag, end.kind == v1::Notice::KIND_LEFT, end.repeat}] = &end;
    return orders;
  }

  static bool wentWell(const OrderEnd& end) {
    return end.kind != v1::Notice::KIND_BLOCKED && end.kind != v1::Notice::KIND_REFUSED &&
           !(end.kind == v1::Notice::KIND_LEFT && !end.text.empty());
  }

  void compareOrders() {
    const auto before = ordersOf(before_), after = ordersOf(after_);
    for (const auto& [key, was] : before) {
      const auto found = after.find(key);
      compareOrder(was, found == after.end() ? nullptr : found->second);
    }
    for (const auto& [key, is] : after)
      if (!before.contains(key)) compareOrder(nullptr, is);
  }

  void compareOrder(const OrderEnd* was, const OrderEnd* is) {
    if (was && is && was->kind == is->kind && was->tick == is->tick && was->text == is->text)
      return;
    OrderChange change;
    if (was) change.before = *was;
    if (is) change.after = *is;
    const bool wasWell = was && wentWell(*was), isWell = is && wentWell(*is);
    const bool leaving = (was ? was : is)->kind == v1::Notice::KIND_LEFT;
    change.worse =
        leaving ? is && !isWell && !(was && !wasWell) : (wasWell && !isWell) || (!was && !isWell);
    change.run = run_;
    into_.orders.push_back(std::move(change));
  }

  const RecordedRun &before_, &after_;
  const Names& names_;
  std::size_t run_;
  WalkDifference& into_;
};

/// The states of a recording, one after the other.
class States {
 public:
  explicit States(const std::filesystem::path& file) : reader_(file) { next(); }

  bool ended() const { return !state_; }
  std::pair<std::size_t, std::uint64_t> place() const { return {run_, state_->tick()}; }
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
  std::size_t run_ = 0;  ///< from 1
};

/// Who is where otherwise, tick by tick, of the ticks that both have.
std::map<std::pair<std::size_t, std::string>, WayChange> partedWays(
    const std::filesystem::path& before, const std::filesystem::path& after) {
  std::map<std::pair<std::size_t, std::string>, WayChange> parted;
  States a(before), b(after);
  while (!a.ended() && !b.ended()) {
    if (a.place() < b.place()) {
      a.next();
      continue;
    }
    if (b.place() < a.place()) {
      b.next();
      continue;
    }
    for (const v1::AvatarState& was : a.state().avatars()) {
      for (const v1::AvatarState& is : b.state().avatars()) {
        if (is.name() != was.name()) continue;
        const double apart = (vectorFrom(is.feet()) - vectorFrom(was.feet())).norm();
        if (!(apart > 0)) break;
        WayChange& way = parted[{a.place().first, was.name()}];
        if (way.firstTick == 0) way.firstTick = a.state().tick();
        if (apart > way.farthest) {
          way.farthest = apart;
          way.farthestTick = a.state().tick();
        }
        break;
      }
    }
    a.next();
    b.next();
  }
  return parted;
}

void compareWays(WalkDifference& into) {
  auto parted = partedWays(into.before.file, into.after.file);
  for (std::size_t run = 0; run < std::min(into.before.runs.size(), into.after.runs.size());
       ++run) {
    const auto &before = into.before.runs[run].avatars, &after = into.after.runs[run].avatars;
    std::set<std::string> everyone;
    for (const auto& [name, avatar] : before) everyone.insert(name);
    for (const auto& [name, avatar] : after) everyone.insert(name);
    for (const std::string& name : everyone) {
      const auto found = parted.find({run + 1, name});
      const bool inBoth = before.contains(name) && after.contains(name);
      if (inBoth && found == parted.end()) continue;
      WayChange way = found == parted.end() ? WayChange{} : found->second;
      way.avatar = name;
      way.run = run;
      if (before.contains(name)) way.before = before.at(name);
      if (after.contains(name)) way.after = after.at(name);
      into.ways.push_back(std::move(way));
    }
  }
}

/// Greater is told earlier, within a kind.
double weightOf(const HappeningChange& change) {
  if (change.before && change.after) return -1e6 + change.shift + 1e-3 * std::abs(change.delay);
  const double lost = change.otherwise.value_or(1e3);
  return change.after ? 1e6 + lost : lost;
}

double timeOf(const HappeningChange& change) {
  return change.after ? change.after->time : change.before->time;
}

/// What blocks comes first, then what is touched; what only changed comes last.
void sortWorstFirst(WalkDifference& into) {
  std::stable_sort(into.happenings.begin(), into.happenings.end(),
                   [](const HappeningChange& x, const HappeningChange& y) {
                     return std::tuple(!x.worse, x.kind, -weightOf(x), timeOf(x)) <
                            std::tuple(!y.worse, y.kind, -weightOf(y), timeOf(y));
                   });
  std::stable_sort(into.orders.begin(), into.orders.end(),
                   [](const OrderChange& x, const OrderChange& y) { return x.worse > y.worse; });
  std::stable_sort(
      into.clearances.begin(), into.clearances.end(),
      [](const ClearanceChange& x, const ClearanceChange& y) { return x.least < y.least; });
}

template <class Changes>
std::size_t worseOf(const Changes& changes) {
  return static_cast<std::size_t>(std::count_if(changes.begin(), changes.end(),
                                                [](const auto& change) { return change.worse; }));
}

}  // namespace

bool WalkDifference::none() const {
  if (before.runs.size() != after.runs.size()) return false;
  for (std::size_t i = 0; i < before.runs.size(); ++i)
    if (before.runs[i].ticks != after.runs[i].ticks) return false;
  return happenings.empty() && orders.empty() && clearances.empty() && ways.empty();
}

/// Of a recording that was cut off nobody knows how it went on: neither is the other one's rest
/// compared.
void readBoth(const std::filesystem::path& before, const std::filesystem::path& after,
              WalkDifference& into) {
  into.before = readWalk(before);
  into.after = readWalk(after);
  const WalkMoment endBefore = endOf(into.before), endAfter = endOf(into.after);
  if (!into.after.closed && endAfter < endBefore) into.before = readWalk(before, endAfter);
  if (!into.before.closed && endBefore < endAfter) into.after = readWalk(after, endBefore);
}

WalkDifference compareWalks(const std::filesystem::path& before, const std::filesystem::path& after,
                            double tolerance) {
  WalkDifference difference;
  difference.tolerance = tolerance;
  readBoth(before, after, difference);
  auto &was = difference.before.runs, &is = difference.after.runs;
  const Names names(difference.before, difference.after);
  for (std::size_t run = 0; run < std::min(was.size(), is.size()); ++run)
    RunComparison(was[run], is[run], names, run, difference).compare();
  compareWays(difference);
  sortWorstFirst(difference);
  difference.worse =
      worseOf(difference.happenings) + worseOf(difference.orders) + worseOf(difference.clearances);
  for (auto* runs : {&was, &is})
    for (RecordedRun& run : *runs) run.pairs.clear();
  return difference;
}

}  // namespace enfilade::server
