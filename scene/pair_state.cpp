// 1. An entity becomes placed trees of convex parts: of a still object its hulls and its triangles,
//    of a body its parts, of an avatar each part by itself, since each is placed by itself.
// 2. Those two are looked at with a clearance (collision/part_tree.*) that begins at twice the gap
//    of their boxes and doubles until something is found; what is found is the nearest when it is
//    nearer than the clearance, else it is the next clearance.
// 3. Before which time they cannot touch follows from the distance and from bounds of their motion
//    (seed 5.1, collision/continuous.*). The gap along the separating normal holds for two convex
//    bodies; entities of more parts may meet elsewhere first, so theirs is bounded along the
//    relative velocity, by which no gap closes faster.
#include "scene/pair_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace enfilade::scene {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kFirstClearance = 1e-3;  // metres
constexpr int kMostDoublings = 64;        // from there beyond any scene

/// An entity's parts as they stand. Nobody else holds the trees.
struct Placement {
  std::vector<collision::PartTree> trees;
  std::vector<collision::PlacedParts> placed;
  Box box;

  void add(collision::PartTree tree, const Mat3& rotation, const Vec3& translation) {
    trees.push_back(std::move(tree));
    placed.push_back({nullptr, rotation, translation});
  }
  void finish() {
    for (std::size_t i = 0; i < trees.size(); ++i) {
      placed[i].parts = &trees[i];
      for (std::uint32_t part = 0; part < trees[i].size(); ++part)
        box.include(collision::boxOf(placed[i], part));
    }
  }
  std::size_t parts() const {
    std::size_t sum = 0;
    for (const collision::PartTree& tree : trees) sum += tree.size();
    return sum;
  }
  collision::ConvexBody body(std::uint32_t link, std::uint32_t part) const {
    return {trees[link].vertices(part), placed[link].translation, &placed[link].rotation,
            trees[link].hull(part)};
  }
};

EntityId firstAvatar(const SceneThen& then) {
  return static_cast<EntityId>(then.scene.model().objects.size()) + 1;
}

const AvatarView* avatarOf(const SceneThen& then, EntityId id) {
  const auto& avatars = then.snapshot.avatars;
  const auto found = std::find_if(avatars.begin(), avatars.end(),
                                  [&](const AvatarView& avatar) { return avatar.id == id; });
  return found == avatars.end() ? nullptr : &*found;
}

const BodyView* bodyOf(const SceneThen& then, EntityId id) {
  const auto& bodies = *then.snapshot.bodies;
  const auto found = std::find_if(bodies.begin(), bodies.end(),
                                  [&](const BodyView& body) { return body.id == id; });
  return found == bodies.end() ? nullptr : &*found;
}

Placement placementOf(const SceneThen& then, EntityId entity) {
  Placement placement;
  const auto hull = [](const collision::Hull& one) { return collision::PartTree({one}); };
  if (const AvatarView* avatar = avatarOf(then, entity)) {
    for (const AvatarPart& part : avatar->shape->parts)
      placement.add(hull(*part.hull), part.rotation, avatar->feet + part.offset);
  } else if (const BodyView* body = bodyOf(then, entity)) {
    placement.add(collision::PartTree(then.scene.shapeOfBody(body->index)->parts),
                  body->pose.rotation.toRotationMatrix(), body->pose.translation);
  } else {
    const ObjectParts& parts = then.scene.parts(entity - 1);
    if (!parts.localHulls.empty())
      placement.add(collision::PartTree(parts.localHulls), Mat3::Identity(), parts.origin);
    if (!parts.localTriangles.triangles().empty())
      placement.add(collision::PartTree(parts.localTriangles.triangles()), Mat3::Identity(),
                    parts.origin);
  }
  placement.finish();
  return placement;
}

double gapOf(const Box& a, const Box& b) {
  return (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).norm();
}

/// nullopt: too many parts near. An empty decision: all are farther apart than `clearance`.
using MaybeParts = std::optional<std::optional<collision::PartsDecision>>;
MaybeParts decideWithin(const Placement& a, const Placement& b, double clearance,
                        collision::PartsCache& cache) {
  if (collision::overlappingParts(a.placed, b.placed, clearance, cache).size() > kMostPairsOfParts)
    return std::nullopt;
  return collision::decideParts(a.placed, b.placed, clearance, cache);
}

std::optional<collision::PartsDecision> nearestParts(const Placement& a, const Placement& b) {
  collision::PartsCache cache;
  double clearance = std::max(kFirstClearance, 2 * gapOf(a.box, b.box));
  for (int i = 0; i < kMostDoublings; ++i) {
    const MaybeParts found = decideWithin(a, b, clearance, cache);
    if (!found) return std::nullopt;
    if (*found && (*found)->decision.distance <= clearance) return **found;
    clearance = std::max(2 * clearance, *found ? (*found)->decision.distance : 0);
  }
  return std::nullopt;
}

void refineInto(PairState& state, const Placement& a, const Placement& b,
                const collision::PartPair& pair) {
  constexpr double kRelative = 1e-15;
  collision::FeatureCache cache;
  const collision::Refinement exact =
      collision::refine(a.body(pair.linkA, pair.partA), b.body(pair.linkB, pair.partB), cache);
  state.decision.verdict = exact.verdict;
  state.decision.decidedBy = exact.decidedBy;
  state.decision.distance = exact.distance;
  state.decision.errorBound = kRelative * exact.distance;
  state.decision.pointA = exact.pointA;
  state.decision.pointB = exact.pointB;
  if (exact.distance > 0) state.decision.normal = exact.closest.normalized();
  state.penetration = exact.penetration;
}

NoAnswer withoutParts(const std::string& field) {
  return {field, "is nothing that can be touched: it has no area, or is only drawn"};
}

NoAnswer tooManyParts() {
  return {"b", "has more than " + std::to_string(kMostPairsOfParts) +
                   " pairs of parts in one place with a: ask for smaller pieces"};
}

bool isOnlyDrawn(const SceneThen& then, EntityId entity) {
  return entity < firstAvatar(then) && !bodyOf(then, entity) &&
         then.scene.model().objects[entity - 1].use == Object::Use::drawn;
}

std::variant<Placement, NoAnswer> solidOf(const SceneThen& then, EntityId entity,
                                          const char* field) {
  if (isOnlyDrawn(then, entity)) return withoutParts(field);
  Placement placement = placementOf(then, entity);
  if (placement.parts() == 0) return withoutParts(field);
  return placement;
}

/// All that may be near a box, but for triggers, which are not solid.
std::vector<EntityId> candidatesIn(const SceneThen& then, const Box& box, EntityId except) {
  std::vector<EntityId> ids;
  const auto& solids = then.scene.solidObjects();
  for (std::size_t i = 0; i < solids.size(); ++i)
    if (collision::overlaps(then.scene.stillBoxes()[i], box)) ids.push_back(solids[i] + 1);
  for (const BodyView& body : *then.snapshot.bodies)
    if (then.scene.model().bodies[body.index].kind != BodyKind::trigger) ids.push_back(body.id);
  for (const AvatarView& avatar : then.snapshot.avatars) ids.push_back(avatar.id);
  std::erase(ids, except);
  return ids;
}

// ---- time to contact ----------------------------------------------------------------------------

/// How one may move from now on.
struct Motion {
  collision::MotionBounds bounds;
  double anyway = 0;    ///< m/s, beside that, in any direction
  bool bounded = true;  ///< else nothing is known
};

Motion motionOf(const AvatarView& avatar, const Lengths& lengths, Assume assume) {
  Motion motion;
  const double reach =
      avatar.shape->box.min.cwiseAbs().cwiseMax(avatar.shape->box.max.cwiseAbs()).norm();
  // Each joint turns all that hangs on it about a place within reach, or pushes it.
  motion.anyway = static_cast<double>(avatar.joints.size()) * lengths.jointSpeedLimit *
                  std::max(1.0, 2 * reach);
  if (assume == Assume::anyCommand) {
    motion.anyway += lengths.speedLimit + 2 * lengths.stepHeight / lengths.tick;
    return motion;
  }
  motion.bounds.velocity = avatar.move.made / lengths.tick;
  if (!avatar.grounded && !avatar.flying) motion.bounds.acceleration = lengths.gravity;
  return motion;
}

Motion motionOf(const SceneThen& then, const BodyView& body, const Lengths& lengths,
                Assume assume) {
  const BodyKind kind = then.scene.model().bodies[body.index].kind;
  const double radius = then.scene.shapeOfBody(body.index)->radius;
  Motion motion;
  if (kind == BodyKind::trigger) return motion;
  if (assume == Assume::anyCommand) {
    motion.bounded = kind != BodyKind::rigid && kind != BodyKind::path;
    motion.anyway = lengths.speedLimit * std::max(1.0, radius);
    return motion;
  }
  if (!body.moving) return motion;
  motion.bounds.velocity = body.velocity;
  motion.bounds.angularVelocity = body.spin;
  motion.bounds.radius = radius;
  // What turns along a way is drawn towards its middle.
  motion.bounds.acceleration = body.spin.norm() * body.velocity.norm();
  if (kind == BodyKind::rigid) motion.bounds.acceleration += lengths.gravity;
  return motion;
}

Motion motionOf(const SceneThen& then, EntityId entity, const Lengths& lengths, Assume assume) {
  if (const AvatarView* avatar = avatarOf(then, entity)) return motionOf(*avatar, lengths, assume);
  if (const BodyView* body = bodyOf(then, entity)) return motionOf(then, *body, lengths, assume);
  return {};
}

collision::ClosingBounds closingOf(const Motion& a, const Motion& b, const Vec3& normal,
                                   bool convex) {
  const Vec3 relative = a.bounds.velocity - b.bounds.velocity;
  const bool along = !convex && relative.norm() > 0;
  // Spins are even, so that any interval will do.
  collision::ClosingBounds closing =
      collision::closingBounds(a.bounds, b.bounds, along ? Vec3(relative.normalized()) : normal, 0);
  closing.speed += a.anyway + b.anyway;
  return closing;
}

}  // namespace

EntityId entityWith(const SceneThen& then, EntityId id) {
  if (id >= firstAvatar(then)) return avatarOf(then, id) ? id : 0;
  for (const BodyView& body : *then.snapshot.bodies) {
    const auto& objects = then.scene.model().bodies[body.index].objects;
    if (id != 0 && std::find(objects.begin(), objects.end(), id - 1) != objects.end())
      return body.id;
  }
  return id;
}

EntityId entityNamed(const SceneThen& then, const std::string& name) {
  for (const AvatarView& avatar : then.snapshot.avatars)
    if (avatar.name == name) return avatar.id;
  for (const BodyView& body : *then.snapshot.bodies)
    if (then.scene.model().bodies[body.index].name == name) return body.id;
  const auto& objects = then.scene.model().objects;
  const auto found = std::find_if(objects.begin(), objects.end(),
                                  [&](const Object& object) { return object.path == name; });
  if (found == objects.end()) return 0;
  return entityWith(then, static_cast<EntityId>(found - objects.begin()) + 1);
}

std::string nameOf(const SceneThen& then, EntityId entity) {
  if (const AvatarView* avatar = avatarOf(then, entity)) return avatar->name;
  if (const BodyView* body = bodyOf(then, entity))
    return then.scene.model().bodies[body->index].name;
  return entity == 0 || entity >= firstAvatar(then) ? ""
                                                    : then.scene.model().objects[entity - 1].path;
}

std::variant<PairState, NoAnswer> stateOfPair(const SceneThen& then, EntityId a, EntityId b,
                                              bool refined) {
  const auto first = solidOf(then, a, "a"), second = solidOf(then, b, "b");
  for (const auto* one : {&first, &second})
    if (const auto* why = std::get_if<NoAnswer>(one)) return *why;
  const auto& placedA = std::get<Placement>(first);
  const auto& placedB = std::get<Placement>(second);
  const auto parts = nearestParts(placedA, placedB);
  if (!parts) return tooManyParts();
  PairState state{a, b, parts->decision, 0};
  if (refined) refineInto(state, placedA, placedB, parts->pair);
  return state;
}

std::variant<Near, NoAnswer> nearTo(const SceneThen& then, EntityId entity, double within) {
  const auto solid = solidOf(then, entity, "entity");
  if (const auto* why = std::get_if<NoAnswer>(&solid)) return *why;
  const auto& own = std::get<Placement>(solid);
  const Box box = collision::grown(own.box, within);
  Near near;
  for (const EntityId id : candidatesIn(then, box, entity)) {
    const Placement other = placementOf(then, id);
    if (other.parts() == 0 || !collision::overlaps(other.box, box)) continue;
    collision::PartsCache cache;
    const MaybeParts parts = decideWithin(own, other, within, cache);
    if (!parts) ++near.leftOut;
    if (!parts || !*parts) continue;
    const collision::PartPair& pair = (*parts)->pair;
    const collision::Decision& decision = (*parts)->decision;
    collision::FeatureCache features;
    const bool nearer =
        decision.verdict != collision::Verdict::separated ||
        collision::isNearerThan(decision, own.body(pair.linkA, pair.partA),
                                other.body(pair.linkB, pair.partB), within, features);
    if (nearer) near.found.push_back({entity, id, decision, 0});
  }
  std::stable_sort(
      near.found.begin(), near.found.end(), [](const PairState& x, const PairState& y) {
        const auto order = [](const PairState& one) {
          return std::tuple(-static_cast<int>(one.decision.verdict), one.decision.distance, one.b);
        };
        return order(x) < order(y);
      });
  return near;
}

std::variant<TimeApart, NoAnswer> timeApart(const SceneThen& then, const Lengths& lengths,
                                            EntityId a, EntityId b, Assume assume, double least) {
  const auto state = stateOfPair(then, a, b);
  if (const auto* why = std::get_if<NoAnswer>(&state)) return *why;
  TimeApart apart;
  apart.now = std::get<PairState>(state);
  const Motion first = motionOf(then, a, lengths, assume),
               second = motionOf(then, b, lengths, assume);
  const bool convex = placementOf(then, a).parts() == 1 && placementOf(then, b).parts() == 1;
  apart.closing = closingOf(first, second, apart.now.decision.normal, convex);
  if (!first.bounded || !second.bounded) {
    apart.closing = {kNever, 0};
    apart.again = {least, least == 0};
    return apart;
  }
  const double distance = apart.now.decision.distance - apart.now.decision.errorBound;
  apart.contact = collision::timeToContact(distance, apart.closing);
  apart.again = collision::wakeUp(distance, apart.closing, least, lengths.epsilon);
  return apart;
}

}  // namespace enfilade::scene
