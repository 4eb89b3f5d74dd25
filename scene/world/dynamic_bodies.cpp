// Free bodies in the tick. Before the broad phase each awake one says what it can reach; after the
// avatars the solver moves them among all that they meet there:
//  - still objects, their triangles;
//  - other free bodies, also those that sleep and may be woken, and what of them these lean on;
//  - kinematic bodies, which have moved already, as driven from where they were before;
//  - avatars, which have moved already too: they stand, and push by what they want and could not
//    do.
// A body goes no farther in a tick than it said it can reach: what stands beyond was not asked for.
#include <algorithm>
#include <thread>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

/// Metres, or of the radius, whichever is less, that a body may go in a tick beyond its own speed
/// when something sets it in motion.
constexpr double kSpareReach = 0.1, kSpareOfRadius = 0.3;
/// The same by which the broad phase's box is larger than it needs to be, so as to move less often.
constexpr double kSpareBox = 0.02, kSpareBoxOfRadius = 0.4;
constexpr std::size_t kWorthThreads = 64;  // bodies: fewer are done before a thread is woken
constexpr std::size_t kBodyBlock = 32;     // bodies that a thread takes at a time
constexpr int kThreads = 2;
constexpr double kBelowScene = 50;     // metres: who falls so far has left the world
constexpr double kBesideScene = 1000;  // metres: or flew so far

DynamicsStep settingsOf(const Lengths& lengths) {
  DynamicsStep step;
  step.solver.seconds = lengths.tick;
  step.solver.substeps = kSolverSubsteps;
  step.solver.gravity = {0, -lengths.gravity, 0};
  step.solver.epsilon = lengths.epsilon;
  return step;
}

bool isSolid(const Body& body) {
  return body.spec->kind != BodyKind::trigger;
}

// ---- solids ------------------------------------------------------------------------------------

Solid solidOf(const Body& body) {
  Solid solid;
  for (const collision::Hull& hull : body.shape->parts) solid.parts.push_back(partOfHull(hull));
  solid.radius = body.shape->radius;
  solid.motion.friction = body.spec->friction;
  solid.motion.centre = body.position;
  solid.motion.rotation = body.orientation;
  if (body.spec->kind == BodyKind::rigid) {
    solid.motion.inverseMass = 1 / body.shape->mass;
    solid.motion.inertia = body.shape->inertia;
    solid.motion.inverseInertia = body.shape->inertia.inverse();
    solid.motion.restitution = body.spec->restitution;
    solid.motion.velocity = body.velocity, solid.motion.spin = body.spin;
  }
  placeSolid(solid);
  return solid;
}

/// The index of the entity's solid; it is made when it is first met.
template <class Make>
std::uint32_t solidFor(RigidStage& stage, EntityId entity, std::uint32_t part, Make make) {
  const auto [at, isNew] = stage.solids.try_emplace({entity, part}, 0);
  if (!isNew) return at->second;
  if (stage.vacant.empty()) {
    at->second = static_cast<std::uint32_t>(stage.dynamics.solids.size());
    stage.dynamics.solids.emplace_back();
    stage.entities.emplace_back();
    stage.bodyOf.push_back(kNoRigid);
  } else {
    at->second = stage.vacant.back();
    stage.vacant.pop_back();
  }
  stage.dynamics.solids[at->second] = make();
  stage.entities[at->second] = entity;
  return at->second;
}

std::uint32_t solidForBody(WorldState& world, std::uint32_t body) {
  RigidStage& stage = world.rigids;
  std::uint32_t& solid = stage.solidOf[body];
  if (solid == kNoRigid) {
    solid = solidFor(stage, world.bodies[body].id, 0, [&] { return solidOf(world.bodies[body]); });
    stage.bodyOf[solid] = body;
  }
  return solid;
}

/// kNoRigid: the mover is an avatar.
std::uint32_t bodyAt(const RigidStage& stage, collision::MoverId mover) {
  return mover < stage.bodyAt.size() ? stage.bodyAt[mover] : kNoRigid;
}

Solid& solidOfRigid(RigidStage& stage, std::uint32_t body) {
  return stage.dynamics.solids[stage.solidOf[body]];
}

std::uint32_t solidForStill(WorldState& world, std::uint32_t object) {
  return solidFor(world.rigids, object + 1, 0,
                  [&] { return stillSolid(world.scene->parts(object)); });
}

/// Gives the solid of an avatar's part its shape.
void dress(Solid& solid, const std::shared_ptr<const collision::Hull>& hull) {
  solid.hull = hull;
  solid.parts = {partOfHull(*hull)};
  solid.radius = hull->radius;
}

/// Places the solid of an avatar's part where the avatar is now, to the last bit.
std::uint32_t solidForPart(WorldState& world, const Avatar& avatar, std::uint32_t index,
                           const Wish& wish) {
  RigidStage& stage = world.rigids;
  const AvatarPart& part = avatar.shape->parts[index];
  const std::uint32_t i = solidFor(stage, avatar.id, index, [] { return Solid{}; });
  Solid& solid = stage.dynamics.solids[i];
  const Vec3 before = solid.position;
  if (solid.hull != part.hull) {
    dress(solid, part.hull);
    forgetPairsOf(stage.dynamics, i);
  }
  const collision::ConvexBody placed = bodyAt(part, avatar.feet);
  solid.position = solid.motion.centre = placed.translation;
  if (part.rotation != solid.rotation) solid.jumped += 2 * solid.radius;
  solid.rotation = part.rotation;
  solid.motion.rotation = collision::Quat(part.rotation);
  solid.jumped += (solid.position - before).norm() * (1 + 0x1p-40);
  const auto wanted = wish.find(world.avatarNames[avatar.id - world.firstAvatarId()]);
  const Vec3 velocity = wanted == wish.end() ? Vec3(Vec3::Zero()) : wanted->second;
  solid.pushVelocity = velocity;
  solid.mostPush = velocity.isZero(0) ? 0 : world.lengths.pushForce;
  // Who leans on somebody that goes on does not sleep; on somebody that stands it may.
  solid.restless = !(velocity.isZero(0) && avatar.lastMove.isZero(0) && avatar.chain.speed == 0);
  return i;
}

// ---- who may meet whom -------------------------------------------------------------------------

using PairKeys = std::vector<PartPairKey>;

void addPair(std::uint32_t solid, std::uint32_t part, std::uint32_t other, std::uint32_t otherPart,
             PairKeys& keys) {
  if (solid < other) {
    keys.push_back({solid, other, part, otherPart});
  } else {
    keys.push_back({other, solid, otherPart, part});
  }
}

/// Where a part of a body comes in this tick.
Box reachOfPart(const WorldState& world, const Body& body, std::uint32_t part) {
  double spare = lookoutOf(world.lengths);
  // From where it is after the tick: twice as far as from where it was before, if it came back.
  if (isKinematic(body.spec->kind)) spare += 2 * body.plan.farthest;
  if (body.spec->kind == BodyKind::rigid)
    spare +=
        world.rigids.dynamics.solids[world.rigids.solidOf[bodyAt(world.rigids, body.mover)]].leash;
  return grown(body.partBoxes[part], spare);
}

/// Where the free bodies come in this tick, side by side.
struct Reaches {
  /// Of each solid that is a free body's: its sphere, and where its parts' boxes begin.
  std::vector<ReachSphere> spheres;
  std::vector<std::uint32_t> firstBox;
  std::vector<Box> boxes;  ///< of parts, wider than what they reach by the lookout

  std::span<const Box> boxesOf(std::uint32_t solid) const {
    return std::span(boxes).subspan(firstBox[solid], firstBox[solid + 1] - firstBox[solid]);
  }
};

Reaches reachesOf(const WorldState& world, Workers* workers) {
  const RigidStage& stage = world.rigids;
  Reaches reaches;
  reaches.firstBox.push_back(0);
  for (const std::uint32_t body : stage.bodies)
    reaches.firstBox.push_back(reaches.firstBox.back() +
                               static_cast<std::uint32_t>(world.bodies[body].partBoxes.size()));
  reaches.spheres.resize(stage.bodies.size());
  reaches.boxes.resize(reaches.firstBox.back());
  shareAmong(workers, stage.bodies.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Body& body = world.bodies[stage.bodies[i]];
      reaches.spheres[i] = reachSphere(stage.dynamics.solids[i]);
      for (std::uint32_t part = 0; part < body.partBoxes.size(); ++part)
        reaches.boxes[reaches.firstBox[i] + part] = reachOfPart(world, body, part);
    }
  });
  return reaches;
}

/// Whether a body is a free one, by its solid. Others have theirs once they are met.
bool isFree(const RigidStage& stage, std::uint32_t body) {
  return stage.solidOf[body] < stage.bodies.size();
}

/// What the broad phase says of some seeds.
struct PartnersOfFree {
  PairKeys pairs;  ///< of parts of free bodies
  /// A seed, and something that is no free body.
  std::vector<std::pair<std::uint32_t, collision::SortAndSweep::Partner>> others;
};

/// Appends the pairs of parts of two free bodies.
void addFreePair(const RigidStage& stage, std::uint32_t body, std::uint32_t met,
                 const Reaches& reaches, double lookout, PairKeys& keys) {
  const std::uint32_t solid = stage.solidOf[body], other = stage.solidOf[met];
  if (!mayMeet(reaches.spheres[solid], reaches.spheres[other], lookout)) return;
  const std::span<const Box> parts = reaches.boxesOf(solid), others = reaches.boxesOf(other);
  for (std::uint32_t part = 0; part < parts.size(); ++part)
    for (std::uint32_t otherPart = 0; otherPart < others.size(); ++otherPart)
      if (overlaps(parts[part], others[otherPart])) addPair(solid, part, other, otherPart, keys);
}

void addPartners(const WorldState& world, std::uint32_t seed, const Reaches& reaches,
                 std::span<const std::uint8_t> isSeed, PartnersOfFree& found) {
  const RigidStage& stage = world.rigids;
  const double lookout = lookoutOf(world.lengths);
  for (const auto& partner : world.broadPhase.partners(world.bodies[seed].mover)) {
    const std::uint32_t met = partner.moves ? bodyAt(stage, partner.id) : kNoRigid;
    if (met == kNoRigid || !isFree(stage, met)) {
      found.others.emplace_back(seed, partner);
    } else if (met > seed || isSeed[met] == 0) {  // of two seeds the first adds the pair
      addFreePair(stage, seed, met, reaches, lookout, found.pairs);
    }
  }
}

PartnersOfFree partnersOfSeeds(const WorldState& world, const Reaches& reaches, Workers* workers) {
  const RigidStage& stage = world.rigids;
  std::vector<std::uint8_t> isSeed(world.bodies.size(), 0);
  for (const std::uint32_t i : stage.seeds) isSeed[i] = 1;
  std::vector<PartnersOfFree> blocks(stage.seeds.size() / kBodyBlock + 1);
  shareAmong(workers, stage.seeds.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i)
      addPartners(world, stage.seeds[i], reaches, isSeed, blocks[from / kBodyBlock]);
  });
  PartnersOfFree all = std::move(blocks.front());
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    all.pairs.insert(all.pairs.end(), blocks[i].pairs.begin(), blocks[i].pairs.end());
    all.others.insert(all.others.end(), blocks[i].others.begin(), blocks[i].others.end());
  }
  return all;
}

/// Collects the pairs of free bodies with what is none.
struct PairWriter {
  WorldState& world;
  const Wish& wish;
  const Reaches& reaches;
  PairKeys keys = {};

  void add(std::uint32_t seed, const collision::SortAndSweep::Partner& partner) {
    const std::uint32_t solid = world.rigids.solidOf[seed];
    if (!partner.moves) {
      addStill(world.bodies[seed], solid, world.scene->solidObjects()[partner.id]);
    } else if (const std::uint32_t met = bodyAt(world.rigids, partner.id); met == kNoRigid) {
      addAvatar(solid, world.avatars.at(world.avatarOfMover.at(partner.id)));
    } else if (isSolid(world.bodies[met])) {
      addDriven(solid, met);
    }
  }
  void addStill(const Body& body, std::uint32_t solid, std::uint32_t object) {
    const ObjectParts& parts = world.scene->parts(object);
    std::vector<std::uint32_t> found;
    parts.query(body.reach, found);
    if (found.empty()) return;
    const std::uint32_t other = solidForStill(world, object);
    for (const std::uint32_t met : found) addMet(solid, parts.box(met), other, met);
  }
  void addDriven(std::uint32_t solid, std::uint32_t index) {
    const Body& met = world.bodies[index];
    const std::uint32_t other = solidForBody(world, index);
    for (std::uint32_t part = 0; part < met.partBoxes.size(); ++part)
      addMet(solid, reachOfPart(world, met, part), other, part);
  }
  void addAvatar(std::uint32_t solid, const Avatar& avatar) {
    for (std::uint32_t i = 0; i < avatar.shape->parts.size(); ++i) {
      const std::uint32_t other = solidForPart(world, avatar, i, wish);
      addMet(solid, boxAt(avatar.shape->parts[i].box, avatar.feet), other, 0);
    }
  }
  void addMet(std::uint32_t solid, const Box& box, std::uint32_t other, std::uint32_t otherPart) {
    const std::span<const Box> parts = reaches.boxesOf(solid);
    for (std::uint32_t part = 0; part < parts.size(); ++part)
      if (overlaps(parts[part], box)) addPair(solid, part, other, otherPart, keys);
  }
};

void gatherPairs(WorldState& world, const Wish& wish, Workers* workers) {
  const Reaches reaches = reachesOf(world, workers);
  PartnersOfFree found = partnersOfSeeds(world, reaches, workers);
  PairWriter writer{world, wish, reaches};
  for (const auto& [seed, partner] : found.others) writer.add(seed, partner);
  // Ascending already, but where somebody is woken.
  if (!std::ranges::is_sorted(found.pairs)) std::ranges::sort(found.pairs);
  std::ranges::sort(writer.keys);
  PairKeys keys(found.pairs.size() + writer.keys.size());
  std::ranges::merge(found.pairs, writer.keys, keys.begin());
  setPairs(world.rigids.dynamics, keys, workers);
}

/// Bodies that are awake, and those that may be woken.
std::vector<std::uint32_t> findSeeds(const WorldState& world) {
  const std::vector<std::uint32_t>& all = world.rigids.bodies;
  const auto isAwake = [&](std::uint32_t i) { return !world.bodies[i].asleep; };
  if (std::ranges::all_of(all, isAwake)) return all;
  std::vector<std::uint8_t> isSeed(world.bodies.size(), 0);
  std::vector<std::uint32_t> open;
  const auto add = [&](std::uint32_t body) {
    if (world.bodies[body].spec->kind != BodyKind::rigid || isSeed[body]) return;
    isSeed[body] = 1;
    open.push_back(body);
  };
  const auto addAround = [&](collision::MoverId mover) {
    for (const auto& partner : world.broadPhase.partners(mover)) {
      if (!partner.moves) continue;
      const std::uint32_t body = bodyAt(world.rigids, partner.id);
      if (body != kNoRigid) add(body);
    }
  };
  for (const std::uint32_t i : all)
    if (isAwake(i)) add(i);
  for (const std::uint32_t i : world.goingBodies) addAround(world.bodies[i].mover);
  for (const auto& [name, avatar] : world.avatars)
    if (world.bodyOfId.contains(avatar.stoppedBy)) add(world.bodyOfId.at(avatar.stoppedBy));
  // What one that wakes leans on wakes too. Each body is added once.
  while (!open.empty()) {
    const std::uint32_t body = open.back();
    open.pop_back();
    addAround(world.bodies[body].mover);
  }
  std::vector<std::uint32_t> seeds;
  for (const std::uint32_t i : all)
    if (isSeed[i]) seeds.push_back(i);
  return seeds;
}

// ---- before and after the solver ---------------------------------------------------------------

/// Places the solid of a kinematic body; the solver comes there too, but for rounding.
void placeDriven(Solid& solid, const Vec3& position, const collision::Quat& orientation) {
  if (solid.motion.centre == position && solid.motion.rotation.coeffs() == orientation.coeffs())
    return;
  const Vec3 before = solid.position;
  const Mat3 turned = solid.rotation;
  solid.motion.centre = position;
  solid.motion.rotation = orientation;
  placeSolid(solid);
  solid.jumped += (1 + 0x1p-40) * ((solid.position - before).norm() +
                                   (solid.rotation - turned).norm() * solid.radius);
}

/// The motion in each substep of what goes on a path.
std::vector<Gait> gaitsOf(const Body& body, double tick) {
  std::vector<Gait> gaits;
  const BodyPlan& plan = body.plan;
  if (plan.stretches != kSolverSubsteps || !body.moved) return gaits;
  const double seconds = tick / kSolverSubsteps;
  for (std::size_t i = 0; i < kSolverSubsteps; ++i) {
    const BodyPlace &from = plan.places[i], &to = plan.places[i + 1];
    gaits.push_back(
        {(to.offset - from.offset) / seconds, (to.turn - from.turn) / seconds * body.spec->axis});
  }
  return gaits;
}

/// Kinematic bodies have moved: their solids go from where they were to where they are.
void driveSolids(WorldState& world) {
  for (const std::uint32_t i : world.kinematics) {
    const Body& body = world.bodies[i];
    if (world.rigids.solidOf[i] == kNoRigid) continue;
    Solid& solid = solidOfRigid(world.rigids, i);
    placeDriven(solid, body.positionBefore, body.orientationBefore);
    solid.motion.velocity = body.velocity;
    solid.motion.spin = body.spin;
    solid.gaits = gaitsOf(body, world.lengths.tick);
  }
}

/// They stand where the body says, to the last bit.
void settleDriven(WorldState& world) {
  for (const std::uint32_t i : world.kinematics) {
    const Body& body = world.bodies[i];
    if (world.rigids.solidOf[i] == kNoRigid) continue;
    placeDriven(solidOfRigid(world.rigids, i), body.position, body.orientation);
  }
}

void takeOver(Body& body, const Solid& solid) {
  body.moved = solid.position != body.position ||
               solid.motion.rotation.coeffs() != body.orientation.coeffs();
  if (body.moved) placeBody(body, solid.motion.centre, solid.motion.rotation);
  body.velocity = solid.motion.velocity;
  body.spin = solid.motion.spin;
  body.asleep = solid.asleep;
}

std::vector<std::pair<EntityId, EntityId>> meetingsOfAvatars(const WorldState& world) {
  std::vector<std::pair<EntityId, EntityId>> met;
  if (world.avatars.empty()) return met;
  const RigidStage& stage = world.rigids;
  for (const NearPair& pair : stage.dynamics.pairs)  // a free one is before an avatar
    if (pair.met && stage.entities[pair.key.b] >= world.firstAvatarId())
      met.emplace_back(stage.entities[pair.key.b], stage.entities[pair.key.a]);
  std::ranges::sort(met);
  met.erase(std::unique(met.begin(), met.end()), met.end());
  return met;
}

bool hasLeft(const WorldState& world, const Body& body) {
  const Box& bounds = world.scene->bounds();
  const Box within{bounds.min - Vec3(kBesideScene, kBelowScene, kBesideScene),
                   bounds.max + Vec3::Constant(kBesideScene)};
  return !contains(within, Box{body.position, body.position});
}

/// It stays where it is, asleep, and is told.
void catchBody(WorldState& world, Body& body, Solid& solid, TickReport& report) {
  body.left = true;
  body.asleep = solid.asleep = true;
  body.velocity = body.spin = solid.motion.velocity = solid.motion.spin = Vec3::Zero();
  solid.motion.inverseMass = 0;
  Contact nowhere;
  nowhere.decision.pointA = nowhere.decision.pointB = body.position;
  report.contacts.push_back(eventOf(world, ContactEvent::Kind::leftWorld, body.id, nowhere));
}

/// How far each of the free bodies may have to go in this tick out of the way of driven bodies, or
/// with them, metres; also one that is pushed by another.
std::vector<double> drivenAway(const WorldState& world) {
  const std::vector<std::uint32_t>& free = world.rigids.bodies;
  std::vector<double> away(free.size(), 0);
  if (world.goingBodies.empty()) return away;
  std::vector<Box> boxes;
  std::vector<std::size_t> rest, open;
  for (std::size_t k = 0; k < free.size(); ++k) {
    boxes.push_back(boxOf(world.bodies[free[k]]));
    for (const std::uint32_t i : world.goingBodies)
      if (overlaps(world.bodies[i].reach, boxes[k]))
        away[k] = std::max(away[k], world.bodies[i].plan.farthest);
    (away[k] > 0 ? open : rest).push_back(k);
  }
  while (!open.empty() && !rest.empty()) {
    const std::size_t pusher = open.back();
    open.pop_back();
    const Box within = grown(boxes[pusher], away[pusher] + lookoutOf(world.lengths));
    std::erase_if(rest, [&](std::size_t k) {
      if (!overlaps(within, boxes[k])) return false;
      away[k] = away[pusher];
      open.push_back(k);
      return true;
    });
  }
  return away;
}

}  // namespace

void startRigids(WorldState& world) {
  RigidStage& stage = world.rigids;
  stage.solidOf.assign(world.bodies.size(), kNoRigid);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) {
    Body& body = world.bodies[i];
    if (body.mover >= stage.bodyAt.size()) stage.bodyAt.resize(body.mover + 1, kNoRigid);
    stage.bodyAt[body.mover] = i;
    if (body.spec->kind != BodyKind::rigid) continue;
    body.asleep = false;
    body.velocity = body.spec->velocity, body.spin = body.spec->spin;
    stage.bodies.push_back(i);
    solidForBody(world, i);
  }
}

Solid unmetSolid(const WorldState& world, EntityId entity, std::uint32_t part) {
  if (const auto body = world.bodyOfId.find(entity); body != world.bodyOfId.end())
    return solidOf(world.bodies[body->second]);
  if (entity < world.firstAvatarId()) return stillSolid(world.scene->parts(entity - 1));
  const std::string& name = world.avatarNames[entity - world.firstAvatarId()];
  Solid solid;
  dress(solid, world.avatars.at(name).shape->parts[part].hull);
  return solid;
}

void planRigids(WorldState& world) {
  const double lookout = lookoutOf(world.lengths), tick = world.lengths.tick;
  const std::vector<double> away = drivenAway(world);
  for (std::size_t k = 0; k < away.size(); ++k) {
    const std::uint32_t i = world.rigids.bodies[k];
    Body& body = world.bodies[i];
    Solid& solid = solidOfRigid(world.rigids, i);
    const double driven = away[k];
    body.driven = driven;
    // What is nearer than 2 epsilon is looked at in any case.
    solid.pushed = std::max(0.0, (driven - 2 * world.lengths.epsilon) / tick - solid.fastest());
    const bool stands = body.asleep && driven == 0;
    if (stands && !body.moved && solid.leash == lookout) continue;  // as the tick before
    body.moved = false;
    const double falls = world.lengths.gravity * tick * tick;
    const double spare = std::min(kSpareReach, kSpareOfRadius * solid.radius);
    solid.leash = stands ? lookout : solid.fastest() * tick + falls + std::max(driven, spare);
    const Box needed = grown(boxOf(body), solid.leash + lookout);
    if (!stands && contains(body.reach, needed)) continue;
    body.reach = grown(needed, std::min(kSpareBox, kSpareBoxOfRadius * solid.radius));
    world.broadPhase.move(body.mover, body.reach);
  }
}

void wakeLeaning(WorldState& world, const Avatar& avatar) {
  for (const Contact& contact : avatar.contacts) {
    const auto found = world.bodyOfId.find(contact.other);
    if (found == world.bodyOfId.end()) continue;
    Body& body = world.bodies[found->second];
    if (body.spec->kind != BodyKind::rigid || body.left) continue;
    Solid& solid = solidOfRigid(world.rigids, found->second);
    body.asleep = solid.asleep = false;
    solid.calmFor = 0;
  }
}

void forgetAvatar(WorldState& world, const Avatar& avatar) {
  wakeLeaning(world, avatar);
  RigidStage& stage = world.rigids;
  const auto first = stage.solids.lower_bound({avatar.id, 0});
  const auto end = stage.solids.lower_bound({avatar.id + 1, 0});
  for (auto at = first; at != end; ++at) {
    forgetPairsOf(stage.dynamics, at->second);
    stage.dynamics.solids[at->second] = {};
    stage.entities[at->second] = 0;
    stage.vacant.push_back(at->second);
  }
  stage.solids.erase(first, end);
}

Workers* workersFor(RigidStage& stage) {
  if (stage.seeds.size() < kWorthThreads) return nullptr;
  const int processors = static_cast<int>(std::thread::hardware_concurrency());
  const int threads = std::min(stage.threads > 0 ? stage.threads : kThreads, processors);
  if (threads < 2) return nullptr;
  if (!stage.workers || stage.workersAsked != threads) {
    stage.workers = std::make_unique<Workers>(threads);
    stage.workersAsked = threads;
  }
  return stage.workers.get();
}

void setThreads(World& world, int threads) {
  world.state().rigids.threads = threads;
}

void moveRigids(WorldState& world, const Wish& wish, TickReport& report, QueryCount& count) {
  RigidStage& stage = world.rigids;
  stage.metByAvatars.clear();
  for (const std::uint32_t i : stage.bodies) world.bodies[i].risesBy = 0;
  if (stage.bodies.empty()) return;
  for (const auto& [name, avatar] : world.avatars)
    if (!avatar.lastMove.isZero(0) || avatar.chain.speed > 0) wakeLeaning(world, avatar);
  stage.seeds = findSeeds(world);
  if (stage.seeds.empty()) return;
  Workers* workers = workersFor(stage);
  gatherPairs(world, wish, workers);
  driveSolids(world);
  DynamicsStep settings = settingsOf(world.lengths);
  settings.workers = workers;
  stage.last = step(stage.dynamics, settings);
  settleDriven(world);
  stage.metByAvatars = meetingsOfAvatars(world);
  count.narrow += stage.last.looks + stage.last.proofs;
  report.squeezedBodies = stage.last.squeezed;
  shareAmong(workers, stage.seeds.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      const std::uint32_t i = stage.seeds[k];
      if (!world.bodies[i].left) takeOver(world.bodies[i], solidOfRigid(stage, i));
    }
  });
  for (const std::uint32_t i : stage.seeds) {
    Body& body = world.bodies[i];
    if (!body.left && hasLeft(world, body)) catchBody(world, body, solidOfRigid(stage, i), report);
  }
}

}  // namespace enfilade::scene
