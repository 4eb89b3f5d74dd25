// What a World holds: plain data, acted on by orders.cpp, motion.cpp, contacts.cpp and tick.cpp.
// Private to scene/.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "scene/model/hasher.hpp"
#include "scene/world/avatars/chain.hpp"
#include "scene/world/bodies/body.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/dynamic_bodies.hpp"
#include "scene/world/world.hpp"

namespace enfilade::scene {

/// How a walk goes: measured as the shortest distance to its way point so far.
struct WalkProgress {
  std::size_t leg = 0;      ///< index of the way point that is walked to
  double nearest = -1;      ///< metres, over the ground or, flying, in space; -1: not measured yet
  double patienceLeft = 0;  ///< seconds
};

struct Avatar {
  EntityId id = 0;
  std::shared_ptr<const AvatarShape> shape;
  std::shared_ptr<const Spawn> madeOf;  ///< the order that gave it parts or links; null: a prism
  Vec3 feet = Vec3::Zero();             ///< world, metres
  Vec3 gaze = Vec3::UnitX();            ///< unit
  double eyeHeight = 0;
  double fallSpeed = 0;  ///< metres per second, downwards > 0
  bool grounded = false;
  EntityId standsOn = 0;  ///< what it came to stand on; 0 when it is not grounded
  bool flying = false;
  bool jumping = false;
  double standing = 0;  ///< metres, the prism's height as spawned; 0 where parts make the shape
  double height = 0;    ///< metres, the prism's height now
  double radius = 0;    ///< metres, the prism's
  std::vector<AvatarPart> base;  ///< what of `shape` is no link; empty without a chain
  Chain chain;
  Vec3 drive = Vec3::Zero();  ///< velocity asked for by Drive
  WalkProgress walk;
  double waitLeft = -1;  ///< seconds; negative: not waiting
  double hangsFor = 0;   ///< seconds that a jump, or who wants to, is in the air and does not move

  // What the last motion left.
  Vec3 lastMove = Vec3::Zero();
  Vec3 asked = Vec3::Zero();  ///< metres
  bool resting = false;       ///< stands, wants nothing, and nobody is near: nothing to work out
  bool stirred = false;       ///< its shape or place was changed since: it does not rest this tick
  EntityId stoppedBy = 0;
  bool pairsChanged =
      true;  ///< the broad phase gave it or took from it a partner since it gathered
  collision::Decision atStop;  ///< with `stoppedBy`, where the move ended
  bool blockedTold = false;    ///< driven against something, which was told when it began

  // Caches from tick to tick. They change no verdict, but the last bits of distances and so of the
  // way: they follow from the commands, as all else does, and a copy of a world must copy them.
  collision::MoverId mover = 0;
  Box reach;                        ///< what it can meet in this tick
  Box gathered;                     ///< where `obstacles` are complete
  std::vector<Obstacle> obstacles;  ///< ascending (entity, part)
  bool meetsBodies = false;         ///< some of them are parts of bodies
  std::vector<Contact> contacts;    ///< ascending `other`; also part of the state
};

struct QueuedOrder {
  Order order;
  std::uint64_t tag = 0;
};

/// When ticks are audited, and whose turn it is (audit.cpp).
struct AuditTurn {
  std::uint32_t everyTicks = 0;  ///< 0: never
  collision::MoverId next = 0;   ///< the first mover that has its turn, if it is still there
};

/// Two that meet: who tells it, and the other.
using EntityPair = std::pair<EntityId, EntityId>;
using BodyContacts = std::vector<std::pair<EntityPair, Contact>>;  ///< ascending by their pairs

struct WorldState {
  WorldState(std::shared_ptr<const Scene> still, const Lengths& l);

  std::shared_ptr<const Scene> scene;
  Lengths lengths;
  std::uint64_t tick = 0;
  std::uint64_t hash = 0;  ///< chained over all ticks, seeded by scene and lengths

  std::vector<Command> incoming;  ///< since the last tick
  std::size_t waiting = 0;        ///< orders and way points in `incoming` and `queues`, at least
  std::map<std::string, std::deque<QueuedOrder>> queues;
  std::map<std::string, Avatar> avatars;
  std::vector<std::string> avatarNames;  ///< of entity id scene objects + 1 + index, kept for ever

  std::vector<BodyCommand> incomingForBodies;  ///< since the last tick
  std::vector<Body> bodies;                    ///< as Model::bodies; never grows or shrinks
  std::map<EntityId, std::uint32_t> bodyOfId;  ///< index into `bodies`
  BodyContacts bodyContacts;                   ///< as told: a, b
  /// Pairs of driven bodies that were asked for so far, and whether they are mounted on one another
  /// (mounting.hpp): it follows from the scene.
  std::map<EntityPair, bool> mounted;
  std::vector<std::uint32_t> kinematics, triggers;  ///< indices into `bodies`, ascending
  std::vector<std::uint32_t> goingBodies;           ///< kinematic, in this tick; ascending
  RigidStage rigids;                                ///< free bodies

  collision::SortAndSweep broadPhase;
  std::map<collision::MoverId, std::string> avatarOfMover;
  std::map<collision::MoverId, std::uint32_t> bodyOfMover;
  std::shared_ptr<const Snapshot> snapshot;
  AuditTurn audit;  ///< no part of the state: it changes nothing that is told of the world

  EntityId firstAvatarId() const {
    return static_cast<EntityId>(scene->model().objects.size()) + 1;
  }
};

/// As refusal() of world.hpp (order_refusals.cpp).
std::optional<std::string> refusalOf(const Command& command, const Lengths& lengths);

/// How much an order counts among kMostWaiting: its way points, and itself (orders.cpp).
std::size_t sizeOf(const Order& order);

// ---- the stages of the tick --------------------------------------------------------------------

/// Where an avatar wants to go in this tick.
using Wish = std::map<std::string, Vec3>;  ///< velocity, metres per second

/// Takes in commands and starts or goes on with what the queues ask for (orders.cpp).
Wish followOrders(WorldState& world, TickReport& report, QueryCount& count);
/// Tells which walks arrived or are blocked after the motion, and who fell out of the scene
/// (orders.cpp).
void judgeWalks(WorldState& world, TickReport& report, QueryCount& count);

// Kinematic bodies: body_drive.cpp plans, body_motion.cpp moves.
/// Where it is in the beginning.
void startDrive(Body& body);
/// Why the body cannot take the command.
std::optional<std::string> refusalOf(const Body& body, const BodyCommand& command,
                                     const Lengths& lengths);
/// Takes in the commands for bodies.
void followBodyCommands(WorldState& world);
/// Where each kinematic body wants to be at the end of the tick, and its reach.
void planBodies(WorldState& world);
/// For the snapshot: as Model::bodies; what the last one had when no body moved.
std::shared_ptr<const std::vector<BodyView>> viewsOfBodies(const WorldState& world);
/// How much farther the avatar may be pushed or carried in this tick than its reach, metres.
double pushRoom(const WorldState& world, const Avatar& avatar);
/// Moves them as far as what is in the way yields; riders are carried.
void moveBodies(WorldState& world, TickReport& report, QueryCount& count);
/// A kinematic body is still on its way, and not blocked.
bool isBusy(const Body& body);

// Free bodies (rigid_bodies.cpp).
/// Who helps in this tick; null where there are too few seeds to be worth it.
Workers* workersFor(RigidStage& stage);
/// All are awake in the beginning, so that what was authored in the air falls.
void startRigids(WorldState& world);
/// What each awake one can reach in this tick.
void planRigids(WorldState& world);
/// Wakes the free bodies that touch the avatar: it goes, or is another shape.
void wakeLeaning(WorldState& world, const Avatar& avatar);
/// Nothing of the avatar is left among the solids.
void forgetAvatar(WorldState& world, const Avatar& avatar);
/// The solver, and the sweep that keeps them out of avatars and one another.
void moveRigids(WorldState& world, const Wish& wish, TickReport& report, QueryCount& count);

/// How far contacts and near misses look, metres.
inline double lookoutOf(const Lengths& lengths) {
  return 2 * lengths.epsilon + lengths.nearMiss;
}

/// The box that an avatar can reach in this tick with the given velocity (motion.cpp).
Box reachOf(const WorldState& world, const Avatar& avatar, const Vec3& velocity);
/// Where the feet may go in this tick: nothing was collected beyond the reach, and what the joints
/// may swing is left to them (motion.cpp).
Box feetRoomOf(const Lengths& lengths, const Avatar& avatar);
/// Box tests that the audit of one tick may make, if they suffice for one avatar: some 2 ms, as a
/// test takes 5 ns (brute force does not foresee its branches).
inline constexpr std::size_t kMostAuditTests = 400'000;
/// Whether this tick is audited, and the audit: right after the update of the broad phase, before
/// anybody moves on or leaves (audit.cpp).
bool auditIsDue(const WorldState& world);
TickAudit auditTick(WorldState& world, std::size_t mostBoxTests = kMostAuditTests);
/// Collects what the avatar can meet inside its reach, unless what was collected before serves
/// (obstacles.cpp).
void gatherObstacles(WorldState& world, Avatar& avatar);
/// Appends the parts of a body that `reach` meets, where they are now (obstacles.cpp).
void gatherParts(const WorldState& world, std::uint32_t body, const Box& reach,
                 std::vector<Obstacle>& obstacles);
/// Whether none of the avatar's partners that can move did so, or may do so in this tick
/// (obstacles.cpp).
bool nobodyMovesNear(const WorldState& world, const Avatar& avatar);
/// Others moved since the obstacles were collected: they take their place of now (obstacles.cpp).
void followOthers(const WorldState& world, Avatar& avatar);
/// Walks, slides, steps, falls (motion.cpp).
void moveAvatar(WorldState& world, Avatar& avatar, const Vec3& velocity, QueryCount& count);

/// Moves the joints of a chain towards their targets (joint_motion.cpp).
void moveJoints(WorldState& world, Avatar& avatar, QueryCount& count);

/// What decides how an avatar goes on, for the state hash, and what it shows (avatar_state.cpp).
void hashAvatar(const Avatar& avatar, Hasher& hash);
AvatarView viewOf(const std::string& name, const Avatar& avatar);

/// Penetrating before touching before separated, then by distance (contacts.cpp).
bool nearer(const collision::Decision& a, const collision::Decision& b);
/// Below which distances two are told, metres: `contact` <= `limit` (contacts.cpp).
struct Nearness {
  double contact;  ///< 2 epsilon: they are in contact (seed 5.1.1)
  double limit;    ///< a contact or a near miss
};
Nearness nearnessOf(const Lengths& lengths);
/// An event of this tick, told by `a`.
ContactEvent eventOf(const WorldState& world, ContactEvent::Kind kind, EntityId a,
                     const Contact& contact);
/// Tells the contact or near miss of `a` that began; `before`: of last tick, or null
/// (contacts.cpp).
void tellBegin(const WorldState& world, EntityId a, const Contact* before, Contact& now,
               std::vector<ContactEvent>& events);
/// Tells what ended of `before`; `now`: of this tick, or null. `parted` gives how they stand to one
/// another when `now` is null.
void tellEnd(const WorldState& world, EntityId a, const Contact& before, const Contact* now,
             const std::function<collision::Decision()>& parted, std::vector<ContactEvent>& events);
/// Of driven bodies that moved, but for what they are mounted on (driven_contacts.cpp).
struct DrivenContacts {
  BodyContacts now;  ///< near, or near until now
  /// What they touched on their way only, clear of it before and after the tick.
  BodyContacts onTheWay;
};
DrivenContacts drivenContacts(WorldState& world, const Nearness& nearness, QueryCount& count);
/// Where the pair is, or would be.
BodyContacts::iterator placeOf(BodyContacts& contacts, const EntityPair& pair);
/// Null: there is none.
const Contact* contactOf(const WorldState& world, const EntityPair& pair);
/// Contacts of bodies with what is no avatar (body_contacts.cpp).
void findBodyContacts(WorldState& world, TickReport& report, QueryCount& count);
void endBodyContacts(WorldState& world, ContactEvent::Reason reason,
                     std::vector<ContactEvent>& events);
/// Finds who touches what now and what began and ended (contacts.cpp).
void findContacts(WorldState& world, TickReport& report, QueryCount& count);
/// A blocked move is told when its walk ends so: what stopped it last, and how near that is now
/// (contacts.cpp).
void tellBlocked(const WorldState& world, Avatar& avatar, TickReport& report, QueryCount& count);
/// Takes an avatar out of the world, its contacts ended and told (orders.cpp).
void removeAvatar(WorldState& world, const std::string& name, std::vector<ContactEvent>& events);
/// Who is in which trigger now, and who came and went (triggers.cpp).
void watchTriggers(WorldState& world, TickReport& report, QueryCount& count);
/// Tells that `who` leaves all triggers.
void leaveTriggers(WorldState& world, EntityId who, ContactEvent::Reason reason,
                   std::vector<ContactEvent>& events);
/// Ends all contacts of `avatar` and those of others with it (contacts.cpp).
void endContactsOf(WorldState& world, Avatar& avatar, ContactEvent::Reason reason,
                   std::vector<ContactEvent>& events);

/// All that `box` may meet, but for the avatar `except` (spawn.cpp).
std::vector<Obstacle> obstaclesIn(const WorldState& world, const Box& box, EntityId except);
/// Whether a new avatar may stand at the order's place; gives it its shape and sets its feet a hair
/// above what it would touch. Returns why not; else what is worth telling comes in `told`, or ""
/// (spawn.cpp).
std::optional<std::string> placeAvatar(const WorldState& world, const Spawn& order, Avatar& avatar,
                                       std::string& told, QueryCount& count);
/// Gives an avatar the shape, chain and height of its spawn order (spawn.cpp).
void shapeAvatar(const Spawn& order, const Lengths& lengths, Avatar& avatar);

// ---- for checkpoints, which tell a copy of a world what cannot be worked out -------------------

/// Where a mover's part is now; what is still stays as it is (obstacles.cpp).
void placeObstacle(const WorldState& world, Obstacle& obstacle);
/// The solid of an entity's part as it is when the solver first meets it; of an avatar with its
/// hull, to be placed (rigid_bodies.cpp).
Solid unmetSolid(const WorldState& world, EntityId entity, std::uint32_t part);
/// Of the last tick (tick.cpp).
std::shared_ptr<const Snapshot> makeSnapshot(const WorldState& world);

}  // namespace enfilade::scene
