#include "scene/world/bodies/candidate_pairs.hpp"

#include <algorithm>
#include <map>
#include <span>
#include <utility>

#include "collision/assert.hpp"
#include "scene/world/bodies/body_state.hpp"
#include "scene/world/bodies/physics_bodies.hpp"

namespace enfilade::scene {
namespace {

using PairKeys = std::vector<PartPairKey>;

void addPairKey(std::uint32_t physicsBody, std::uint32_t part, std::uint32_t other,
                std::uint32_t otherPart, PairKeys& keys) {
  if (physicsBody < other) {
    keys.push_back({physicsBody, other, part, otherPart});
  } else {
    keys.push_back({other, physicsBody, otherPart, part});
  }
}

/// Parts x parts above which a front of the part trees costs less than testing all pairs.
constexpr std::size_t kMaxPairsWithoutFront = 32;

/// Bound of a body's motion in this tick, plus the contact margin, metres.
double computeBoundsMargin(const WorldData& world, const Body& body) {
  double margin = computeContactQueryMargin(world.settings);
  // Relative to the final pose: twice the maximum displacement, in case it moved there and back.
  if (isKinematic(body.spec->kind)) margin += 2 * body.kinematicTarget.maxDisplacement;
  if (isDynamic(body.spec->kind))
    margin += world.dynamicBodies.physicsWorld
                  .bodies[world.dynamicBodies.physicsBodyOf[world.findBodyByProxy(body.proxy)]]
                  .maxStepDisplacement;
  return margin;
}

/// Bounds of the motion of all rigid bodies in this tick.
struct SweptBounds {
  /// By physics body of a rigid body: its bounding sphere, and the first box of its parts.
  std::vector<MotionSphere> spheres;
  std::vector<std::uint32_t> firstBox;
  std::vector<double> margins;  ///< by physics body: metres by which its boxes are inflated
  std::vector<Aabb> boxes;      ///< of parts, inflated

  std::span<const Aabb> findPartBoxes(std::uint32_t physicsBody) const {
    return std::span(boxes).subspan(firstBox[physicsBody],
                                    firstBox[physicsBody + 1] - firstBox[physicsBody]);
  }
};

/// Bodies that overlap nothing keep empty boxes.
SweptBounds computeSweptBounds(WorldData& world, ThreadPool* threadPool) {
  const DynamicBodies& dynamicBodies = world.dynamicBodies;
  SweptBounds bounds;
  bounds.firstBox.push_back(0);
  for (const std::uint32_t body : dynamicBodies.bodyIndices)
    bounds.firstBox.push_back(bounds.firstBox.back() + getPartCount(world.bodies[body]));
  bounds.spheres.resize(dynamicBodies.bodyIndices.size());
  bounds.margins.resize(dynamicBodies.bodyIndices.size());
  bounds.boxes.resize(bounds.firstBox.back());
  parallelForOrSerial(threadPool, dynamicBodies.bodyIndices.size(), kBodiesPerTask,
                      [&](std::size_t from, std::size_t to) {
                        for (std::size_t i = from; i < to; ++i) {
                          Body& body = world.bodies[dynamicBodies.bodyIndices[i]];
                          bounds.spheres[i] =
                              computeMotionSphere(dynamicBodies.physicsWorld.bodies[i]);
                          bounds.margins[i] = computeBoundsMargin(world, body);
                          updatePartBoxes(world, body);
                          if (!body.boxes.hasParts) continue;
                          for (std::uint32_t part = 0; part < getPartCount(body); ++part)
                            bounds.boxes[bounds.firstBox[i] + part] =
                                inflate(body.boxes.parts[part], bounds.margins[i]);
                        }
                      });
  return bounds;
}

/// True for rigid bodies: their physics bodies are the first ones.
bool isDynamic(const DynamicBodies& dynamicBodies, std::uint32_t body) {
  return dynamicBodies.physicsBodyOf[body] < dynamicBodies.bodyIndices.size();
}

/// Broad-phase overlaps of some active bodies.
struct ActiveBodyOverlaps {
  PairKeys pairs;  ///< of parts of two rigid bodies
  /// An active body, and an overlap with anything but a rigid body.
  std::vector<std::pair<std::uint32_t, collision::ProxyOverlap>> others;
};

/// A body of the solver, and the bounds of the motion of its parts in this tick.
struct MovingParts {
  const Body& body;
  std::uint32_t physicsBody;
  std::span<const Aabb> boxes;  ///< of its parts, inflated by `margin`
  double margin;                ///< metres
};

MovingParts getMovingParts(const WorldData& world, const SweptBounds& bounds, std::uint32_t body) {
  const std::uint32_t physicsBody = world.dynamicBodies.physicsBodyOf[body];
  return {world.bodies[body], physicsBody, bounds.findPartBoxes(physicsBody),
          bounds.margins[physicsBody]};
}

collision::CompoundView makeView(const Body& body) {
  return {&body.shape->tree, body.rotation, body.position, {}};  // the parts are not asked for
}

/// Adds the pairs of parts whose bounds overlap. `fronts`: of `a`.
void addPartPairs(const MovingParts& a, const MovingParts& b, PartFronts& fronts, PairKeys& keys) {
  // The box of a body with one part may be a cube, which its tree does not contain.
  const bool areCompounds = a.boxes.size() > 1 && b.boxes.size() > 1;
  if (areCompounds && a.boxes.size() * b.boxes.size() > kMaxPairsWithoutFront) {
    const collision::CompoundView viewA = makeView(a.body), viewB = makeView(b.body);
    std::vector<collision::PartPair> pairs;
    collision::findOverlappingParts({viewA, a.boxes, a.margin}, {viewB, b.boxes, b.margin},
                                    fronts[b.physicsBody], pairs);
    for (const auto& [part, otherPart] : pairs)
      addPairKey(a.physicsBody, part, b.physicsBody, otherPart, keys);
    return;
  }
  for (std::uint32_t part = 0; part < a.boxes.size(); ++part)
    for (std::uint32_t otherPart = 0; otherPart < b.boxes.size(); ++otherPart)
      if (overlaps(a.boxes[part], b.boxes[otherPart]))
        addPairKey(a.physicsBody, part, b.physicsBody, otherPart, keys);
}

void addOverlaps(WorldData& world, std::uint32_t activeBody, const SweptBounds& bounds,
                 std::span<const std::uint8_t> isActive, ActiveBodyOverlaps& found) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  const MovingParts active = getMovingParts(world, bounds, activeBody);
  const double margin = computeContactQueryMargin(world.settings);
  // No other call uses the fronts of the active body. Those without an overlap are dropped.
  PartFronts& fronts = dynamicBodies.partFronts[active.physicsBody];
  PartFronts oldFronts = std::exchange(fronts, {});
  for (const auto& overlap : world.broadPhase.getOverlaps(active.body.proxy)) {
    const std::uint32_t otherBody = overlap.isDynamic ? world.findBodyByProxy(overlap.id) : kNoBody;
    if (otherBody != kNoBody)
      fronts.insert(oldFronts.extract(dynamicBodies.physicsBodyOf[otherBody]));
    if (otherBody == kNoBody || !isDynamic(dynamicBodies, otherBody)) {
      found.others.emplace_back(activeBody, overlap);
    } else if (otherBody > activeBody ||
               isActive[otherBody] == 0) {  // the first of two active ones adds the pair
      const MovingParts other = getMovingParts(world, bounds, otherBody);
      if (mayMeet(bounds.spheres[active.physicsBody], bounds.spheres[other.physicsBody], margin))
        addPartPairs(active, other, fronts, found.pairs);
    }
  }
}

ActiveBodyOverlaps collectOverlaps(WorldData& world, const SweptBounds& bounds,
                                   ThreadPool* threadPool) {
  DynamicBodies& dynamicBodies = world.dynamicBodies;
  dynamicBodies.partFronts.resize(dynamicBodies.bodyIndices.size());
  std::vector<std::uint8_t> isActive(world.bodies.size(), 0);
  for (const std::uint32_t i : dynamicBodies.activeBodies) isActive[i] = 1;
  std::vector<ActiveBodyOverlaps> blocks(dynamicBodies.activeBodies.size() / kBodiesPerTask + 1);
  parallelForOrSerial(threadPool, dynamicBodies.activeBodies.size(), kBodiesPerTask,
                      [&](std::size_t from, std::size_t to) {
                        for (std::size_t i = from; i < to; ++i)
                          addOverlaps(world, dynamicBodies.activeBodies[i], bounds, isActive,
                                      blocks[from / kBodiesPerTask]);
                      });
  ActiveBodyOverlaps all = std::move(blocks.front());
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    all.pairs.insert(all.pairs.end(), blocks[i].pairs.begin(), blocks[i].pairs.end());
    all.others.insert(all.others.end(), blocks[i].others.begin(), blocks[i].others.end());
  }
  return all;
}

bool isSolid(const Body& body) {
  return !isTrigger(body.spec->kind);
}

/// Collects the pairs of a rigid body with anything but a rigid body.
struct PairCollector {
  WorldData& world;
  const SweptBounds& bounds;
  PairKeys keys = {};
  std::map<std::uint32_t, std::vector<Aabb>> kinematicBoxes = {};  ///< by body: of parts, inflated

  void addOverlap(std::uint32_t activeBody, const collision::ProxyOverlap& overlap) {
    const MovingParts active = getMovingParts(world, bounds, activeBody);
    if (!overlap.isDynamic) {
      addStatic(active, world.scene->solidObjects()[overlap.id]);
    } else if (const std::uint32_t otherBody = world.findBodyByProxy(overlap.id);
               otherBody == kNoBody) {
      addAvatar(active, *world.findAvatarByProxy(overlap.id));
    } else if (isSolid(world.bodies[otherBody])) {
      addKinematic(active, otherBody);
    }
  }
  void addStatic(const MovingParts& active, std::uint32_t object) {
    const CollisionGeometry& parts = world.scene->collisionGeometry(object);
    const Aabb& motionBounds = active.body.motionBounds;
    std::vector<std::uint32_t> found;
    parts.query(motionBounds, found);
    if (found.empty()) return;
    const std::uint32_t other = ensureStaticObject(world, object);
    if (active.boxes.size() == 1 || active.boxes.size() * found.size() <= kMaxPairsWithoutFront) {
      for (const std::uint32_t part : found) addBox(active, parts.box(part), other, part);
      return;
    }
    for (std::uint32_t part = 0; part < active.boxes.size(); ++part) {  // each by the object's tree
      found.clear();
      parts.query(active.boxes[part], found);
      for (const std::uint32_t otherPart : found)
        if (overlaps(motionBounds, parts.box(otherPart)))
          addPairKey(active.physicsBody, part, other, otherPart, keys);
    }
  }
  void addKinematic(const MovingParts& active, std::uint32_t index) {
    Body& body = world.bodies[index];
    const double margin = computeBoundsMargin(world, body);
    std::vector<Aabb>& boxes = kinematicBoxes[index];
    if (boxes.empty()) {
      makePartBoxes(body);
      for (const Aabb& box : body.boxes.parts) boxes.push_back(inflate(box, margin));
    }
    addPartPairs(active, {body, ensureSceneBody(world, index), boxes, margin},
                 world.dynamicBodies.partFronts[active.physicsBody], keys);
  }
  void addAvatar(const MovingParts& active, const Avatar& avatar) {
    for (std::uint32_t i = 0; i < avatar.shape->parts.size(); ++i) {
      const std::uint32_t other = ensureAvatarPart(world, avatar, i);
      addBox(active, placeBox(avatar.shape->parts[i].box, avatar.footPosition), other, 0);
    }
  }
  void addBox(const MovingParts& active, const Aabb& box, std::uint32_t other,
              std::uint32_t otherPart) {
    for (std::uint32_t part = 0; part < active.boxes.size(); ++part)
      if (overlaps(active.boxes[part], box))
        addPairKey(active.physicsBody, part, other, otherPart, keys);
  }
};

}  // namespace

void collectPairs(WorldData& world, ThreadPool* threadPool) {
  const SweptBounds bounds = computeSweptBounds(world, threadPool);
  ActiveBodyOverlaps found = collectOverlaps(world, bounds, threadPool);
  PairCollector collector{world, bounds};
  for (const auto& [activeBody, overlap] : found.others) collector.addOverlap(activeBody, overlap);
  // Ascending already, except where a sleeping body may be woken.
  if (!std::ranges::is_sorted(found.pairs)) std::ranges::sort(found.pairs);
  std::ranges::sort(collector.keys);
  PairKeys keys(found.pairs.size() + collector.keys.size());
  std::ranges::merge(found.pairs, collector.keys, keys.begin());
  ENFILADE_ASSERT(std::ranges::adjacent_find(keys) == keys.end());  // each pair once
  setPairs(world.dynamicBodies.physicsWorld, keys, threadPool);
}

std::vector<std::uint32_t> collectActiveBodies(const WorldData& world) {
  const std::vector<std::uint32_t>& all = world.dynamicBodies.bodyIndices;
  const auto isAwake = [&](std::uint32_t i) { return !world.bodies[i].asleep; };
  if (std::ranges::all_of(all, isAwake)) return all;
  std::vector<std::uint8_t> isActive(world.bodies.size(), 0);
  std::vector<std::uint32_t> pending;
  const auto add = [&](std::uint32_t body) {
    if (!isDynamic(world.bodies[body].spec->kind) || isActive[body]) return;
    isActive[body] = 1;
    pending.push_back(body);
  };
  const auto addNeighbours = [&](collision::ProxyId proxy) {
    for (const auto& overlap : world.broadPhase.getOverlaps(proxy)) {
      if (!overlap.isDynamic) continue;
      const std::uint32_t body = world.findBodyByProxy(overlap.id);
      if (body != kNoBody) add(body);
    }
  };
  for (const std::uint32_t i : all)
    if (isAwake(i)) add(i);
  for (const std::uint32_t i : world.movingBodies) addNeighbours(world.bodies[i].proxy);
  for (const Avatar& avatar : world.avatars)
    if (world.bodyIndexById.contains(avatar.blockedBy))
      add(world.bodyIndexById.at(avatar.blockedBy));
  // Bodies that overlap an active body become active. Each body is added once.
  while (!pending.empty()) {
    const std::uint32_t body = pending.back();
    pending.pop_back();
    addNeighbours(world.bodies[body].proxy);
  }
  std::vector<std::uint32_t> activeBodies;
  for (const std::uint32_t i : all)
    if (isActive[i]) activeBodies.push_back(i);
  return activeBodies;
}

}  // namespace enfilade::scene
