#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "protocol/recording/recording.hpp"
#include "server/diff/walk_difference.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using PairKey = std::pair<std::string, std::string>;
using OrderKey = std::tuple<std::string, std::uint64_t, bool, std::uint32_t>;

using NameMap = std::unordered_map<std::string, std::string>;

std::string lookedUp(const NameMap& map, const std::string& key) {
  const auto found = map.find(key);
  return found == map.end() ? key : found->second;
}

/// What names mean, and what is in which model. A thing is an object, by its path in the earlier
/// model, or an avatar, by its name; a body is its first object.
class Names {
 public:
  Names(const RecordedWalk& before, const RecordedWalk& after) : before_(before), after_(after) {
    if (!before.objects || !after.objects) return;
    NameMap pathOf;
    for (const auto& [path, globalId] : *before.objects)
      if (!globalId.empty()) pathOf.emplace(globalId, path);
    for (const auto& [path, globalId] : *after.objects) {
      const auto found = globalId.empty() ? pathOf.end() : pathOf.find(globalId);
      if (found != pathOf.end() && found->second != path) renamed_[path] = found->second;
    }
    for (const auto& [path, earlier] : renamed_) taken_.insert(earlier);
    for (const auto& [path, globalId] : *after.objects) later_.insert(thingOfPath(path));
  }

  std::string thingOfEarlier(const std::string& name) const {
    return lookedUp(before_.bodies, name);
  }
  std::string thingOfLater(const std::string& name) const {
    const std::string path = lookedUp(after_.bodies, name);
    return after_.objects && after_.objects->contains(path) ? thingOfPath(path) : path;
  }

  /// `thing` of a walk that has it.
  Model modelOf(const std::string& thing) const {
    if (!before_.objects || !after_.objects) return Model::unknown;
    const bool inBefore = before_.objects->contains(thing), inAfter = later_.contains(thing);
    if (inBefore && inAfter) return Model::both;
    return inBefore ? Model::before : inAfter ? Model::after : Model::unknown;  // an avatar
  }

 private:
  std::string thingOfPath(const std::string& later) const {
    const auto found = renamed_.find(later);
    if (found != renamed_.end()) return found->second;
    // The earlier object of this path goes by another one now.
    return taken_.contains(later) ? later + "\n" : later;
  }

  const RecordedWalk &before_, &after_;
  NameMap renamed_;                        ///< later path to earlier path, where they differ
  std::unordered_set<std::string> taken_;  ///< earlier paths of those
  std::unordered_set<std::string> later_;  ///< things of the later model
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
    static const PairRecord kNothing;
    std::map<PairKey, Pair> pairs;
    for (const auto& [names, record] : before_.pairs) {
      Pair& pair = pairs[{names_.thingOfEarlier(names.first), names_.thingOfEarlier(names.second)}];
      pair = {&record, &kNothing, names, {}};
    }
    for (const auto& [names, record] : after_.pairs) {
      Pair& pair = pairs[{names_.thingOfLater(names.first), names_.thingOfLater(names.second)}];
      if (!pair.before) pair.before = &kNothing;
      pair.after = &record;
      pair.names = names;
    }
    for (auto& [things, pair] : pairs) {
      pair.inModel = names_.modelOf(things.second);
      comparePair(pair);
    }
    compareOrders();
  }

 private:
  struct Pair {
    const PairRecord *before = nullptr, *after = nullptr;
    PairKey names;  ///< as the later walk has them, or the earlier where only that does
    Model inModel = Model::unknown;
  };

  void comparePair(const Pair& pair) {
    const std::size_t told = into_.happenings.size();
    for (std::size_t i = 0; i < kHappeningKinds; ++i)
      compareHappenings(pair, static_cast<HappeningKind>(i));
    const bool oneSided = std::any_of(into_.happenings.begin() + static_cast<std::ptrdiff_t>(told),
                                      into_.happenings.end(), [](const HappeningChange& change) {
                                        return change.kind == HappeningKind::contact &&
                                               !(change.before && change.after);
                                      });
    // A contact that is new or gone says it already.
    if (!oneSided) compareClearance(pair);
  }

  void compareHappenings(const Pair& pair, HappeningKind kind) {
    const PairRecord &before = *pair.before, &after = *pair.after;
    const auto& was = before.*listOf(kind);
    const auto& is = after.*listOf(kind);
    const auto changeOf = [&](std::optional<Happening> one, std::optional<Happening> other) {
      return this->changeOf(kind, pair.inModel, std::move(one), std::move(other));
    };
    std::vector<bool> wasFound(was.size()), isFound(is.size());
    for (const auto& [i, j] : matchedHappenings(was, is)) {
      wasFound[i] = isFound[j] = true;
      HappeningChange change = changeOf(was[i], is[j]);
      if (change.shift > into_.tolerance || was[i].tick != is[j].tick) add(std::move(change));
    }
    for (std::size_t i = 0; i < was.size(); ++i) {
      if (wasFound[i]) continue;
      HappeningChange change = changeOf(was[i], std::nullopt);
      if (after.nearest) change.otherwise = after.nearest->distance;
      add(std::move(change));
    }
    for (std::size_t j = 0; j < is.size(); ++j) {
      if (isFound[j]) continue;
      HappeningChange change = changeOf(std::nullopt, is[j]);
      if (before.nearest) change.otherwise = before.nearest->distance;
      change.worse = countsAsWorse(kind);
      add(std::move(change));
    }
  }

  HappeningChange changeOf(HappeningKind kind, Model inModel, std::optional<Happening> before,
                           std::optional<Happening> after) const {
    HappeningChange change;
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

  void add(HappeningChange change) { into_.happenings.push_back(std::move(change)); }

  static double nearMiss(const RecordedRun& run) { return run.start.lengths().near_miss(); }

  /// What one walk would not have told is not compared.
  static std::optional<Nearest> within(const std::optional<Nearest>& nearest, double radius) {
    return nearest && nearest->distance <= radius ? nearest : std::nullopt;
  }

  /// Where one walk told nothing of the pair, it was farther than what that one tells.
  void compareClearance(const Pair& pair) {
    const double contact = 2 * before_.start.lengths().epsilon();
    const double radius = std::max(contact, std::min(nearMiss(before_), nearMiss(after_)));
    const auto was = within(pair.before->nearest, radius), is = within(pair.after->nearest, radius);
    if (!was && !is) return;
    double least = (is ? is->distance : radius) - (was ? was->distance : radius);
    if (!was) least = std::min(least, 0.0);
    if (!is) least = std::max(least, 0.0);
    if (!(std::abs(least) > into_.tolerance)) return;
    ClearanceChange change;
    std::tie(change.a, change.b) = pair.names;
    change.before = was;
    change.after = is;
    change.least = least;
    change.inModel = pair.inModel;
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
  explicit States(const RecordedWalk& walk) : reader_(walk.file, walk.run) { next(); }

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
std::map<std::pair<std::size_t, std::string>, WayChange> partedWays(const RecordedWalk& before,
                                                                    const RecordedWalk& after) {
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
  auto parted = partedWays(into.before, into.after);
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

const v1::RecordingParent& parentOf(const RecordedWalk& walk) {
  return walk.runs.front().start.parent();
}

/// Beside a branch: which of several runs it left, of the file that it says it left.
std::optional<std::uint32_t> runLeftBy(const RecordedWalk& branch, const RecordedWalk& walk) {
  const v1::RecordingParent& parent = parentOf(branch);
  const std::uint32_t run = std::max(parent.run(), 1U);
  const bool left = branch.runs.front().start.has_parent() &&
                    std::filesystem::path(parent.file()).filename() == walk.file.filename();
  return left && walk.runs.size() > 1 && run <= walk.runs.size() ? run : walk.run;
}

/// Compared is what both tell. A branch tells nothing of what was before it, and of a recording
/// that was cut off nobody knows how it went on.
void readBoth(const std::filesystem::path& before, const std::filesystem::path& after,
              std::optional<std::uint32_t> run, WalkDifference& into) {
  into.before = readWalk(before, {run});
  into.after = readWalk(after);
  WalkPart was{runLeftBy(into.after, into.before)}, is{runLeftBy(into.before, into.after)};
  if (was.run != into.before.run) into.before = readWalk(before, was);
  if (is.run != into.after.run) into.after = readWalk(after, is);
  was.since = is.since = std::max(parentOf(into.before).tick(), parentOf(into.after).tick());
  for (const RecordedWalk* walk : {&into.before, &into.after})
    if (!walk->closed && (!was.until || endOf(*walk) < *was.until)) was.until = endOf(*walk);
  is.until = was.until;
  if (was.since == 0 && !was.until) return;
  into.before = readWalk(before, was);
  into.after = readWalk(after, is);
}

}  // namespace

bool WalkDifference::none() const {
  if (before.runs.size() != after.runs.size()) return false;
  for (std::size_t i = 0; i < before.runs.size(); ++i)
    if (before.runs[i].ticks != after.runs[i].ticks) return false;
  return happenings.empty() && orders.empty() && clearances.empty() && ways.empty();
}

WalkDifference compareWalks(const std::filesystem::path& before, const std::filesystem::path& after,
                            double tolerance, std::optional<std::uint32_t> runBefore) {
  WalkDifference difference;
  difference.tolerance = tolerance;
  readBoth(before, after, runBefore, difference);
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
