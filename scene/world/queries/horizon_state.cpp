#include "scene/world/queries/horizon_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/assert.hpp"
#include "collision/motion/time_to_contact.hpp"

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kBoxesPerLeaf = 4;
/// Exceeds the rounding of sums of speeds, and of simulated times.
constexpr double kRoundUp = 1 + 1e-12;

const BodySpec& getSpec(const Scene& scene, const BodySnapshot& body) {
  return scene.model().bodies[body.index];
}

bool hasMoved(const AvatarSnapshot& before, const AvatarSnapshot& now) {
  return before.footPosition != now.footPosition || before.shape != now.shape ||
         before.groundEntity != now.groundEntity || before.height != now.height;
}

bool hasMoved(const BodySnapshot& before, const BodySnapshot& now) {
  return before.pose.translation != now.pose.translation ||
         before.pose.rotation.coeffs() != now.pose.rotation.coeffs();
}

/// Rounds down to a multiple of a sixteenth of the next power of two; to 0 below a millimetre.
double roundDown(double distance) {
  if (!(distance >= 1e-3)) return 0;
  int exponent = 0;
  const double fraction = std::frexp(distance, &exponent);  // 0.5 to 1
  return std::ldexp(std::floor(16 * fraction) / 16, exponent);
}

/// Rounding of boxes with these coordinates, metres; as in proximity_query.cpp.
double computeBoxRounding(const Aabb& box) {
  return 1e-9 * (1 + std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff()));
}

}  // namespace

HorizonState::HorizonState(std::shared_ptr<const Scene> scene, const WorldSettings& settings)
    : scene_(std::move(scene)),
      settings_(settings),
      index_(scene_),
      staticTree_(collision::buildBoxTree(scene_->staticBoxes(), kBoxesPerLeaf)) {}

bool HorizonState::isConsecutive(const Snapshot& next) const {
  return snapshot_ && next.tick == snapshot_->tick + 1;
}

void HorizonState::update(std::shared_ptr<const Snapshot> snapshot) {
  ENFILADE_ASSERT(snapshot && snapshot->bodies);
  const bool consecutive = isConsecutive(*snapshot);
  if (!consecutive) kinematicMotion_ = 0;
  updateBodies(*snapshot, consecutive);
  updateAvatars(*snapshot, consecutive);
  speeds_.clear();
  snapshot_ = std::move(snapshot);
}

void HorizonState::updateBodies(const Snapshot& next, bool consecutive) {
  if (consecutive && snapshot_->bodies == next.bodies) return;
  const SceneAt at{index_, next};
  bodies_.resize(next.bodies->size());
  pushers_.clear();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const BodySnapshot& body = (*next.bodies)[i];
    const BodySpec& spec = getSpec(*scene_, body);
    BodyState& state = bodies_[i];
    const bool moved = !consecutive || hasMoved((*snapshot_->bodies)[i], body);
    if (moved) {
      state.lastMotion = next.tick;
      state.box = computeBodyAabb(at, body);
      state.speed = computeBodySpeedLimit(spec, scene_->bodyShape(i)->radius, settings_);
    }
    if (!isKinematic(spec.kind)) continue;
    pushers_.push_back({state.box, state.speed});
    if (moved) kinematicMotion_ = next.tick;
  }
}

void HorizonState::updateAvatars(const Snapshot& next, bool consecutive) {
  unbounded_.clear();
  left_.clear();
  if (!consecutive) avatarMotion_.clear();
  const SceneAt before{index_, consecutive ? *snapshot_ : next}, now{index_, next};
  for (const auto& [id, tick] : avatarMotion_)
    if (!findAvatarSnapshot(now, id)) left_.push_back(id);
  for (const EntityId id : left_) avatarMotion_.erase(id);
  for (const AvatarSnapshot& avatar : next.avatars) {
    const auto [known, isNew] = avatarMotion_.try_emplace(avatar.id, next.tick);
    const AvatarSnapshot* last = isNew ? nullptr : findAvatarSnapshot(before, avatar.id);
    if (last && hasMoved(*last, avatar)) known->second = next.tick;
    if (!last || last->teleports != avatar.teleports ||
        (standsOnDynamicBody(now, avatar) && !standsOnDynamicBody(before, *last)))
      unbounded_.push_back(avatar.id);
  }
}

std::uint64_t HorizonState::lastMotion(EntityId entity) const {
  if (const auto avatar = avatarMotion_.find(entity); avatar != avatarMotion_.end())
    return avatar->second;
  const BodySnapshot* body = findBodySnapshot(sceneAt(), entity);
  return body ? bodies_[body->index].lastMotion : 0;
}

Aabb HorizonState::computeBox(EntityId entity) const {
  if (const AvatarSnapshot* avatar = findAvatarSnapshot(sceneAt(), entity))
    return placeBoxOutward(avatar->shape->box, avatar->footPosition);
  if (const BodySnapshot* body = findBodySnapshot(sceneAt(), entity))
    return bodies_[body->index].box;
  const auto& objects = scene_->solidObjects();
  ENFILADE_ASSERT(std::ranges::is_sorted(objects));
  const auto at = std::lower_bound(objects.begin(), objects.end(), entity - 1);
  ENFILADE_ASSERT(at != objects.end() && *at == entity - 1);
  return scene_->staticBoxes()[static_cast<std::size_t>(at - objects.begin())];
}

double HorizonState::computeMaxAvatarSpeed(const AvatarSnapshot& avatar, double seconds) const {
  const auto [known, isNew] = speeds_.try_emplace({avatar.id, seconds}, 0);
  if (!isNew) return known->second;
  return known->second = computeAvatarSpeedWithin(
             avatar, pushers_, standsOnDynamicBody(sceneAt(), avatar), settings_, seconds);
}

double HorizonState::computeMaxSpeedWithin(EntityId entity, double seconds) const {
  if (const AvatarSnapshot* avatar = findAvatarSnapshot(sceneAt(), entity))
    return computeMaxAvatarSpeed(*avatar, seconds);
  const BodySnapshot* body = findBodySnapshot(sceneAt(), entity);
  return body ? bodies_[body->index].speed : 0;
}

double HorizonState::getGrowthLimit(EntityId entity) const {
  const AvatarSnapshot* avatar = findAvatarSnapshot(sceneAt(), entity);
  return avatar ? computeGrowthLimit(*avatar) : 0;
}

double HorizonState::computeTime(EntityId a, EntityId b, double gap, double speed) const {
  return computeTime(gap, getGrowthLimit(a) + getGrowthLimit(b), speed);
}

double HorizonState::computeTime(double gap, double growth, double speed) const {
  const double toContact = gap - (computeContactThreshold(settings_) + growth) * kRoundUp;
  return collision::computeTimeToContact(toContact, {speed * kRoundUp, 0});
}

double HorizonState::computeBoxSeparatedUntil(EntityId a, EntityId b, double speed) const {
  return computeBoxSeparatedUntil(computeBox(a), computeBox(b),
                                  getGrowthLimit(a) + getGrowthLimit(b), speed);
}

double HorizonState::computeBoxSeparatedUntil(const Aabb& own, const Aabb& other, double growth,
                                              double speed) const {
  return computeTime(computeGap(own, other) - computeBoxRounding(own), growth, speed);
}

void HorizonState::findStaticNeighbours(const AvatarSnapshot& avatar, double speed, double seconds,
                                        std::vector<Neighbour>& neighbours) const {
  const Aabb own = placeBoxOutward(avatar.shape->box, avatar.footPosition);
  const double growth = computeGrowthLimit(avatar);
  const double reach = speed * seconds * kRoundUp + growth +
                       2 * computeContactThreshold(settings_) + computeBoxRounding(own);
  const auto box = collision::toFloatAabb(inflate(own, reach), staticTree_.origin);
  collision::forEachOverlappingLeaf(
      staticTree_, box, [&](std::uint32_t first, std::uint32_t count) {
        for (std::uint32_t item = first; item < first + count; ++item) {
          const std::uint32_t index = staticTree_.order[item];
          const double earliest =
              computeBoxSeparatedUntil(own, scene_->staticBoxes()[index], growth, speed);
          if (earliest < seconds)
            neighbours.push_back({scene_->solidObjects()[index] + 1, earliest});
        }
      });
}

std::vector<HorizonState::Neighbour> HorizonState::findNeighbours(const AvatarSnapshot& avatar,
                                                                  double seconds) const {
  std::vector<Neighbour> neighbours;
  const double speed = computeMaxAvatarSpeed(avatar, seconds);
  findStaticNeighbours(avatar, speed, seconds, neighbours);
  const Aabb own = placeBoxOutward(avatar.shape->box, avatar.footPosition);
  const auto consider = [&](EntityId id, const Aabb& box, double growth, double otherSpeed) {
    const double earliest =
        computeBoxSeparatedUntil(own, box, computeGrowthLimit(avatar) + growth, speed + otherSpeed);
    if (earliest < seconds) neighbours.push_back({id, earliest});
  };
  for (const BodySnapshot& body : *snapshot_->bodies)
    if (isKinematic(getSpec(*scene_, body).kind))
      consider(body.id, bodies_[body.index].box, 0, bodies_[body.index].speed);
  for (const AvatarSnapshot& other : snapshot_->avatars)
    if (other.id != avatar.id)
      consider(other.id, placeBoxOutward(other.shape->box, other.footPosition),
               computeGrowthLimit(other), computeMaxAvatarSpeed(other, seconds));
  return neighbours;
}

std::size_t HorizonState::boundedCount() const {
  return scene_->solidObjects().size() + pushers_.size() + snapshot_->avatars.size();
}

HorizonState::NearestBody HorizonState::findNearestDynamicBody(const AvatarSnapshot& avatar) const {
  NearestBody nearest{0, std::numeric_limits<double>::infinity()};
  const Aabb own = placeBoxOutward(avatar.shape->box, avatar.footPosition);
  for (const BodySnapshot& body : *snapshot_->bodies) {
    if (!isDynamic(getSpec(*scene_, body).kind)) continue;
    const double gap = computeGap(own, bodies_[body.index].box);
    if (gap < nearest.gap) nearest = {body.id, gap};
  }
  if (nearest.entity == 0) return {};
  return {nearest.entity, roundDown(nearest.gap - computeBoxRounding(own))};
}

}  // namespace enfilade::scene
