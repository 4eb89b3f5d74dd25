// Algorithm (Lin 1993, section 5.1, for avatars under any command):
// 1. Search: all entities that may come into contact with an avatar within some time enter the
//    schedule, each with the time that its box proves. One bound covers all others until then.
// 2. In each tick, the pairs whose proof ends leave the schedule. Their exact distance and the
//    speed limits of both give a new proof (motion_limits.hpp). Boxes that are far apart suffice.
// 3. The search is repeated when its time is over.
// A proof covers all commands, so commands do not invalidate it. These events do:
//  - An avatar joins or is teleported: it is paired with all avatars that it may reach before their
//    next search.
//  - An avatar leaves: its pairs go.
//  - An avatar steps onto or off a dynamic body: its pairs are due at once, because distant bodies
//    may carry it. (A proof excludes what dynamic bodies carry, see ContactHorizon::unbounded.)
//  - Another world, a seek, a restart: reset(), or a gap of ticks.
// Crouching and standing up do not: a proof allows for the full height. Nothing sets the pose of an
// avatar or a kinematic body but the tick.
// Departure from Lin 1993: pairs in contact are not in the heap. They are examined in each tick in
// which one of the two moved.
#include "scene/world/queries/contact_horizon.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "collision/assert.hpp"
#include "scene/world/queries/proximity_query.hpp"

namespace enfilade::scene {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Search times are doubled until an entity is found; then the search ends in any case.
constexpr double kMaxSearchSeconds = 3600;
/// Work limit for one pair; above it the boxes must suffice.
constexpr std::size_t kMaxWorkPerPair = 40'000;
/// Work of a pair in addition to its distance.
constexpr std::size_t kPairWork = 8;
/// Fraction of the search time that boxes must prove, so that no exact distance is needed.
constexpr double kBoxesSuffice = 0.5;

EntityId getOther(const collision::PairSchedule::BodyPair& pair, EntityId one) {
  return pair.first == one ? pair.second : pair.first;
}

bool isEarlier(const ContactHorizon::Approach& x, const ContactHorizon::Approach& y) {
  // The entity 0 comes last among equal times.
  return std::tuple(x.notBefore, x.entity == 0, x.entity) <
         std::tuple(y.notBefore, y.entity == 0, y.entity);
}

bool isEqual(const ContactHorizon& x, const ContactHorizon& y) {
  const auto same = [](const ContactHorizon::Approach& p, const ContactHorizon::Approach& q) {
    return p.entity == q.entity && p.notBefore == q.notBefore;
  };
  return std::ranges::equal(x.approaches, y.approaches, same) && x.touching == y.touching &&
         x.unbounded.entity == y.unbounded.entity && x.unbounded.gap == y.unbounded.gap;
}

}  // namespace

double ContactHorizon::notBefore() const {
  return approaches.empty() ? kInfinity : approaches.front().notBefore;
}

ContactHorizons::ContactHorizons(std::shared_ptr<const Scene> scene, const WorldSettings& settings)
    : ContactHorizons(std::move(scene), settings, Options()) {}

ContactHorizons::ContactHorizons(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                                 const Options& options)
    : settings_(settings),
      options_(options),
      // Without joints, so that all avatars have the same.
      searchSeconds_(options.searchDistance / computeAvatarSpeedLimit(AvatarSnapshot(), settings)),
      state_(std::move(scene), settings) {}

void ContactHorizons::reset() {
  state_.reset();
  tracked_.clear();
  schedule_ = {};
  touching_.clear();
  examined_.clear();
  horizons_.clear();
}

void ContactHorizons::update(const std::shared_ptr<const Snapshot>& snapshot) {
  if (state_.snapshot() && snapshot->tick != state_.snapshot()->tick + 1) reset();
  workLeft_ = options_.maxWork;
  state_.update(snapshot);
  removeLeftAvatars();
  updateSelection();
  restartUnbounded();
  searchDue();
  examineDue();
  for (auto& [avatar, tracked] : tracked_) composeHorizon(avatar, tracked);
}

// ---- pairs --------------------------------------------------------------------------------------

ContactHorizons::Tracked* ContactHorizons::findTracked(EntityId entity) {
  const auto at = tracked_.find(entity);
  return at == tracked_.end() ? nullptr : &at->second;
}

void ContactHorizons::markDirty(const BodyPair& pair) {
  for (const EntityId entity : {pair.first, pair.second})
    if (Tracked* tracked = findTracked(entity)) tracked->dirty = true;
}

void ContactHorizons::endTouching(const BodyPair& pair) {
  if (touching_.erase(pair) == 0) return;
  for (const EntityId entity : {pair.first, pair.second})
    if (Tracked* tracked = findTracked(entity)) tracked->touching.erase(getOther(pair, entity));
}

void ContactHorizons::setTime(const BodyPair& pair, double time) {
  endTouching(pair);
  schedule_.set(pair.first, pair.second, time);
  markDirty(pair);
}

void ContactHorizons::setTouching(const BodyPair& pair) {
  schedule_.remove(pair.first, pair.second);
  if (!touching_.insert(pair).second) return;
  for (const EntityId entity : {pair.first, pair.second})
    if (Tracked* tracked = findTracked(entity)) tracked->touching.insert(getOther(pair, entity));
  markDirty(pair);
}

void ContactHorizons::removePair(const BodyPair& pair) {
  schedule_.remove(pair.first, pair.second);
  endTouching(pair);
  examined_.erase(pair);
  markDirty(pair);
}

void ContactHorizons::removePairs(EntityId avatar, bool keepTracked) {
  std::vector<BodyPair> pairs;
  for (const Entry& entry : schedule_.findEntries(avatar)) pairs.push_back(entry.pair);
  for (const BodyPair& pair : touching_)
    if (pair.first == avatar || pair.second == avatar) pairs.push_back(pair);
  for (const BodyPair& pair : pairs)
    if (!keepTracked || !isTracked(getOther(pair, avatar))) removePair(pair);
}

bool ContactHorizons::spendWork(std::size_t cost) {
  if (workLeft_ < cost) {
    ++statistics_.postponed;
    return false;
  }
  workLeft_ -= cost;
  return true;
}

// ---- avatars ------------------------------------------------------------------------------------

void ContactHorizons::removeLeftAvatars() {
  for (const EntityId avatar : state_.left()) {
    tracked_.erase(avatar);
    horizons_.erase(avatar);
    removePairs(avatar, false);
  }
}

void ContactHorizons::updateSelection() {
  if (selected_)
    for (auto at = tracked_.begin(); at != tracked_.end();) {
      const EntityId avatar = at->first;
      if (selected_->contains(avatar)) {
        ++at;
        continue;
      }
      at = tracked_.erase(at);
      horizons_.erase(avatar);
      removePairs(avatar, true);
    }
  for (const AvatarSnapshot& avatar : state_.snapshot()->avatars)
    if (!selected_ || selected_->contains(avatar.id))
      tracked_.try_emplace(avatar.id, Tracked{now(), true, {}});
}

/// Earlier bounds do not cover avatars that joined or were teleported, nor those that a distant
/// body may now carry.
void ContactHorizons::restartUnbounded() {
  for (const EntityId id : state_.unbounded()) {
    schedule_.scheduleBodyNow(id, now());
    if (Tracked* own = findTracked(id)) own->restUntil = now();
    for (const auto& [avatar, tracked] : tracked_) {
      const BodyPair pair = collision::PairSchedule::makePair(avatar, id);
      if (avatar == id || tracked.restUntil <= now() || touching_.contains(pair)) continue;
      const double seconds = std::min(tracked.restUntil - now(), kMaxSearchSeconds);
      const double speed =
          state_.computeMaxSpeedWithin(avatar, seconds) + state_.computeMaxSpeedWithin(id, seconds);
      const double time = state_.computeBoxSeparatedUntil(avatar, id, speed);
      if (now() + time < tracked.restUntil) setTime(pair, now() + std::min(time, seconds));
    }
  }
}

// ---- search -------------------------------------------------------------------------------------

/// Replaces the pairs of an avatar by those with its neighbours. A pair that an avatar no longer
/// needs stays if the other's last search relies on it.
void ContactHorizons::replacePairs(const AvatarSnapshot& avatar, Tracked& tracked,
                                   const std::vector<HorizonState::Neighbour>& neighbours) {
  std::map<BodyPair, double> earliest;
  for (const auto& neighbour : neighbours)
    earliest[collision::PairSchedule::makePair(avatar.id, neighbour.entity)] = neighbour.earliest;
  for (const Entry& entry : schedule_.findEntries(avatar.id)) {
    const auto other = tracked_.find(getOther(entry.pair, avatar.id));
    const bool needed = other != tracked_.end() && tracked.restUntil < other->second.restUntil;
    if (!earliest.contains(entry.pair) && !needed) removePair(entry.pair);
  }
  for (const auto& [pair, time] : earliest) {
    if (touching_.contains(pair)) continue;
    const double known = schedule_.findTime(pair.first, pair.second).value_or(now());
    setTime(pair, std::max(known, now() + time));
  }
}

void ContactHorizons::searchAround(const AvatarSnapshot& avatar, Tracked& tracked) {
  const auto isApart = [&](const HorizonState::Neighbour& neighbour) {
    return !touching_.contains(collision::PairSchedule::makePair(avatar.id, neighbour.entity));
  };
  double seconds = searchSeconds_;
  std::vector<HorizonState::Neighbour> neighbours;
  bool foundAll = false;
  while (true) {
    neighbours = state_.findNeighbours(avatar, seconds);
    foundAll = neighbours.size() + 1 == state_.boundedCount();
    if (foundAll || seconds >= kMaxSearchSeconds || std::ranges::any_of(neighbours, isApart)) break;
    seconds *= 2;
  }
  ++statistics_.searches;
  workLeft_ -= std::min(workLeft_, neighbours.size());
  tracked.restUntil = foundAll ? kInfinity : now() + seconds;
  tracked.dirty = true;
  replacePairs(avatar, tracked, neighbours);
}

void ContactHorizons::searchDue() {
  const SceneAt at = state_.sceneAt();
  for (auto& [id, tracked] : tracked_) {
    if (tracked.restUntil > now() + settings_.tickDuration) continue;
    if (spendWork(kPairWork)) searchAround(*findAvatarSnapshot(at, id), tracked);
  }
}

// ---- examination --------------------------------------------------------------------------------

/// True if the last examination of the pair still holds, measured from now.
bool ContactHorizons::isUnchanged(const BodyPair& pair, bool touching) const {
  const auto last = examined_.find(pair);
  if (last == examined_.end()) return false;
  const std::uint64_t tick = last->second.tick;
  return state_.lastMotion(pair.first) <= tick && state_.lastMotion(pair.second) <= tick &&
         (touching || state_.lastKinematicMotion() <= tick);
}

/// Examines the pairs whose proof does not cover the next tick, those that wait longest first.
void ContactHorizons::examineDue() {
  std::vector<Entry> due;
  const double until = options_.examineAll ? kInfinity : now() + settings_.tickDuration;
  while (const auto entry = schedule_.popDue(until)) due.push_back(*entry);
  for (const BodyPair& pair : touching_)
    if (options_.examineAll || !isUnchanged(pair, true)) due.push_back({now(), pair});
  for (const Entry& entry : due) renewProof(entry);
}

void ContactHorizons::renewProof(const Entry& due) {
  const auto& [a, b] = due.pair;
  if (!options_.examineAll && isUnchanged(due.pair, false) && !touching_.contains(due.pair))
    return setTime(due.pair, now() + examined_.at(due.pair).wait);
  const double speed = state_.computeMaxSpeedWithin(a, searchSeconds_) +
                       state_.computeMaxSpeedWithin(b, searchSeconds_);
  const double boxTime = std::min(state_.computeBoxSeparatedUntil(a, b, speed), searchSeconds_);
  if (!options_.examineAll && boxTime >= kBoxesSuffice * searchSeconds_) {
    ++statistics_.boxChecks;
    return setTime(due.pair, now() + boxTime);
  }
  examine(due, boxTime, speed);
}

void ContactHorizons::examine(const Entry& due, double boxTime, double speed) {
  // Without work left, the old proof stays: it claims less. So does a contact.
  const bool isTouching = touching_.contains(due.pair);
  if (!spendWork(kPairWork)) {
    if (!isTouching) setTime(due.pair, due.time);
    return;
  }
  const std::size_t granted = std::min(workLeft_, kMaxWorkPerPair);
  std::size_t work = granted;
  const auto found =
      computePairProximity(state_.sceneAt(), due.pair.first, due.pair.second, false, work);
  workLeft_ -= granted - work;
  if (const auto* proximity = std::get_if<PairProximity>(&found))
    return storeExamination(due.pair, proximity->separation, speed);
  const bool tooComplex = granted == kMaxWorkPerPair;
  if (!tooComplex) ++statistics_.postponed;
  if (!isTouching) setTime(due.pair, tooComplex ? now() + boxTime : due.time);
}

void ContactHorizons::storeExamination(const BodyPair& pair,
                                       const collision::SeparationResult& separation,
                                       double speed) {
  ++statistics_.examinations;
  const double gap = separation.distance - separation.errorBound;
  const bool apart = separation.verdict == collision::Verdict::separated;
  Examined& examined = examined_[pair];
  examined.tick = state_.snapshot()->tick;
  examined.wait = std::min(state_.computeTime(pair.first, pair.second, gap, speed), searchSeconds_);
  if (apart && gap >= computeContactThreshold(settings_))
    setTime(pair, now() + examined.wait);
  else
    setTouching(pair);
}

// ---- horizons -----------------------------------------------------------------------------------

void ContactHorizons::composeHorizon(EntityId avatar, Tracked& tracked) {
  ContactHorizon horizon;
  horizon.avatar = avatar;
  horizon.changedTick = state_.snapshot()->tick;
  horizon.unbounded = state_.findNearestDynamicBody(*findAvatarSnapshot(state_.sceneAt(), avatar));
  const auto [known, isNew] = horizons_.try_emplace(avatar);
  const HorizonState::NearestBody& body = known->second.unbounded;
  if (!isNew && !tracked.dirty && body.entity == horizon.unbounded.entity &&
      body.gap == horizon.unbounded.gap)
    return;
  tracked.dirty = false;
  horizon.touching.assign(tracked.touching.begin(), tracked.touching.end());
  for (const Entry& entry : schedule_.findEntries(avatar))
    if (entry.time <= tracked.restUntil)
      horizon.approaches.push_back({getOther(entry.pair, avatar), entry.time});
  if (tracked.restUntil < kInfinity) horizon.approaches.push_back({0, tracked.restUntil});
  const std::size_t count = std::min(horizon.approaches.size(), ContactHorizon::kMaxApproaches);
  std::ranges::partial_sort(horizon.approaches,
                            horizon.approaches.begin() + static_cast<std::ptrdiff_t>(count),
                            isEarlier);
  horizon.approaches.resize(count);
  if (isNew || !isEqual(known->second, horizon)) known->second = std::move(horizon);
}

void ContactHorizons::validate() const {
  schedule_.validate();
  std::size_t count = 0;
  for (const auto& [avatar, tracked] : tracked_) {
    for (const Entry& entry : schedule_.findEntries(avatar)) {
      const EntityId other = getOther(entry.pair, avatar);
      if (touching_.contains(entry.pair))
        throw std::logic_error("a touching pair is in the schedule");
      count += isTracked(other) && other < avatar ? 0 : 1;
    }
    for (const EntityId other : tracked.touching)
      if (!touching_.contains(collision::PairSchedule::makePair(avatar, other)))
        throw std::logic_error("an avatar touches an entity that the pairs do not have");
  }
  if (count != schedule_.size()) throw std::logic_error("a pair has no selected avatar");
}

}  // namespace enfilade::scene
