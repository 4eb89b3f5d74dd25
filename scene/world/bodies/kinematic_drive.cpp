// What kinematic bodies are about: commands, closers, doors that are walked into; and from that
// where each wants to be at the end of the tick.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "scene/world/contacts/excluded_pairs.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

constexpr double kTimeRounding = 1e-9;  // seconds: sums of ticks against whole delays

/// Where a path is at a time between its first key and its last.
BodyPlace placeOnPath(const std::vector<PathKey>& keys, double time) {
  const auto after = std::upper_bound(keys.begin() + 1, keys.end() - 1, time,
                                      [](double t, const PathKey& key) { return t < key.time; });
  const PathKey &a = *(after - 1), &b = *after;
  return placeBetween({a.offset, a.turn}, {b.offset, b.turn}, (time - a.time) / (b.time - a.time));
}

BodyPlace placeOf(const BodySpec& spec, double coordinate) {
  switch (spec.kind) {
    case BodyKind::hinged:
      return {Vec3::Zero(), coordinate};
    case BodyKind::path:
      return placeOnPath(spec.keys, coordinate);
    default:
      return {coordinate * spec.axis, 0};
  }
}

double openEnd(const BodySpec& spec) {
  const auto [low, high] = limitsOf(spec);
  return high - spec.closed >= spec.closed - low ? high : low;
}

void goTo(Body& body, double target, double speed) {
  BodyDrive& drive = body.drive;
  drive.target = target;
  drive.speed = speed;
  drive.going = goesRound(*body.spec) || target != drive.coordinate;
  drive.closesIn = -1;
}

void follow(Body& body, const BodyCommand& command) {
  const double speed = command.speed.value_or(body.spec->speed);
  switch (command.action) {
    case BodyCommand::Action::open:
    case BodyCommand::Action::run:
      return goTo(body, openEnd(*body.spec), speed);
    case BodyCommand::Action::close:
      return goTo(body, body.spec->closed, speed);
    case BodyCommand::Action::to:
      return goTo(body, command.to, speed);
    case BodyCommand::Action::level:
      return goTo(body, body.spec->stops[command.level], speed);
    case BodyCommand::Action::stop:
      body.drive.going = false;
      body.drive.rate = 0;
      body.drive.closesIn = -1;
  }
}

/// A door that is walked into opens away from who does, or the other way where it only opens so.
void openFor(Body& body, const Contact& contact) {
  const BodySpec& spec = *body.spec;
  if (spec.openedBy != OpenedBy::touch || body.drive.going) return;
  const Vec3 push = contact.decision.normal;  // from the avatar to the body
  const Vec3 arm = contact.decision.pointB - body.position;
  const double way = spec.kind == BodyKind::hinged ? spec.axis.dot(arm.cross(push)) : 0;
  double target = openEnd(spec);
  if (way != 0) target = way > 0 ? spec.high : spec.low;
  goTo(body, target == spec.closed ? openEnd(spec) : target, spec.speed);
}

void openForWalkers(WorldState& world) {
  for (const auto& [name, avatar] : world.avatars) {
    const auto found = world.bodyOfId.find(avatar.stoppedBy);
    if (avatar.stoppedBy == 0 || found == world.bodyOfId.end()) continue;
    Body& body = world.bodies[found->second];
    for (const Contact& contact : avatar.contacts)
      if (contact.other == body.id) openFor(body, contact);
  }
}

/// A closer waits while the door stands open, and then closes it.
void runCloser(Body& body, double tick) {
  BodyDrive& drive = body.drive;
  if (!body.spec->closesAfter || drive.going || drive.coordinate == body.spec->closed) return;
  if (drive.closesIn < 0) drive.closesIn = *body.spec->closesAfter;
  drive.closesIn -= tick;
  if (drive.closesIn <= kTimeRounding) {
    goTo(body, body.spec->closed, body.spec->speed);
  }
}

/// The signed rate for this tick: speeds up and slows down by the spec's acceleration.
double nextRate(const Body& body, double gap, double tick) {
  const BodyDrive& drive = body.drive;
  const double sense = gap < 0 ? -1 : 1;
  const double a = body.spec->acceleration;
  if (a == 0) return sense * drive.speed;
  const double along = std::min(sense * drive.rate + a * tick, drive.speed);
  return sense * std::min(along, std::sqrt(2 * a * std::abs(gap)));
}

/// Where it wants to be at the end of the tick, and how fast that is.
std::pair<double, double> nextCoordinate(const Body& body, double tick) {
  const BodyDrive& drive = body.drive;
  if (goesRound(*body.spec)) {
    const double next = drive.coordinate + drive.speed * tick;
    return {std::fmod(next, body.spec->keys.back().time), drive.speed};
  }
  const double gap = drive.target - drive.coordinate;
  const double rate = nextRate(body, gap, tick);
  if (std::abs(rate) * tick >= std::abs(gap) && rate * gap >= 0) return {drive.target, 0};
  const auto [low, high] = limitsOf(*body.spec);
  return {std::clamp(drive.coordinate + rate * tick, low, high), rate};
}

/// Radians that a path that loops turns by in each lap: 0, or whole turns.
double turnOfLap(const BodySpec& spec) {
  return spec.keys.back().turn - spec.keys.front().turn;
}

/// Where a path that loops is `time` seconds after a lap began; turns count on from lap to lap, and
/// those of lap number `counted` are the keys'.
BodyPlace placeOnLoop(const BodySpec& spec, double time, double counted) {
  const double lap = spec.keys.back().time, at = std::fmod(time, lap);
  BodyPlace place = placeOf(spec, at);
  place.turn += (std::round((time - at) / lap) - counted) * turnOfLap(spec);
  return place;
}

/// By as many laps more or less that it is nearest to `place`.
double sameTurnNear(const BodyPlace& place, double turn, const BodySpec& spec) {
  const double lap = turnOfLap(spec);
  return lap == 0 ? turn : turn - std::round((turn - place.turn) / lap) * lap;
}

/// Where a path comes through, at the end of each of the solver's substeps; the last is the goal.
void planPath(Body& body, double tick) {
  BodyPlan& plan = body.plan;
  const BodySpec& spec = *body.spec;
  const double now = body.drive.coordinate;
  const bool loops = goesRound(spec);
  const double way =
      loops ? body.drive.speed * tick : plan.coordinate - now;  // seconds of the path
  const double counted =
      loops ? std::round((now + way - plan.coordinate) / spec.keys.back().time) : 0;
  plan.stretches = kSolverSubsteps;
  for (std::size_t i = 1; i < kSolverSubsteps; ++i) {
    const double at = now + static_cast<double>(i) / kSolverSubsteps * way;
    plan.places[i] = loops ? placeOnLoop(spec, at, counted) : placeOf(spec, at);
  }
  plan.places[kSolverSubsteps] = placeOf(spec, plan.coordinate);
  if (!loops) return;
  double& turn = body.drive.place.turn;
  turn = sameTurnNear(placeOnLoop(spec, now, counted), turn, spec);
  plan.places[0].turn = turn;
}

/// Of a path that does not go evenly.
double swingOf(const BodyPlan& plan, double radius, double tick) {
  if (plan.stretches == 1) return 0;
  const BodyPlace &start = plan.places[0], &end = plan.places[plan.stretches];
  const auto n = static_cast<double>(plan.stretches);
  const Vec3 evenMove = (end.offset - start.offset) / n;
  const double evenTurn = (end.turn - start.turn) / n;
  double most = 0;
  for (std::size_t i = 0; i < plan.stretches; ++i) {
    const BodyPlace &from = plan.places[i], &to = plan.places[i + 1];
    most = std::max(most, (to.offset - from.offset - evenMove).norm() +
                              std::abs(to.turn - from.turn - evenTurn) * radius);
  }
  return n * most / tick;
}

void plan(Body& body, double tick) {
  BodyPlan& plan = body.plan;
  plan = {};
  plan.places[0] = body.drive.place;
  plan.coordinate = body.drive.coordinate;
  if (!body.drive.going) return;
  std::tie(plan.coordinate, body.drive.rate) = nextCoordinate(body, tick);
  if (body.spec->kind == BodyKind::path)
    planPath(body, tick);
  else
    plan.places[1] = placeOf(*body.spec, plan.coordinate);
  for (std::size_t i = 1; i <= plan.stretches; ++i)
    plan.farthest =
        std::max(plan.farthest, farthestWay(*body.shape, plan.places[0], plan.places[i]));
  plan.swing = swingOf(plan, body.shape->radius, tick);
}

}  // namespace

collision::Pose startPoseOf(const BodySpec& spec) {
  return poseAt(spec, placeOf(spec, 0));
}

void startDrive(Body& body) {
  BodyDrive& drive = body.drive;
  drive.speed = body.spec->speed;
  drive.place = placeOf(*body.spec, 0);
  drive.going = body.spec->kind == BodyKind::path && body.spec->runs;
  drive.target = drive.going ? openEnd(*body.spec) : 0;
  const collision::Pose pose = startPoseOf(*body.spec);
  placeBody(body, pose.translation, pose.rotation);
}

void followBodyCommands(WorldState& world) {
  for (const BodyCommand& command : world.incomingForBodies) {
    for (Body& body : world.bodies)
      if (body.spec->name == command.body) follow(body, command);
  }
  world.incomingForBodies.clear();
  openForWalkers(world);
}

void planBodies(WorldState& world) {
  const double lookout = lookoutOf(world.lengths);
  world.goingBodies.clear();
  for (const std::uint32_t i : world.kinematics) {
    Body& body = world.bodies[i];
    const bool reachedOut = body.moved || body.plan.farthest > 0;
    body.moved = false;
    body.velocity = body.spin = Vec3::Zero();
    body.positionBefore = body.position;
    body.orientationBefore = body.orientation;
    runCloser(body, world.lengths.tick);
    plan(body, world.lengths.tick);
    if (body.drive.going) world.goingBodies.push_back(i);
    if (body.plan.farthest == 0 && !reachedOut) continue;
    body.reach = boxOf(body);
    if (body.plan.farthest > 0) body.reach = grown(body.reach, body.plan.farthest + lookout);
    world.broadPhase.move(body.mover, body.reach);
  }
}

double pushRoom(const WorldState& world, const Avatar& avatar) {
  std::vector<std::uint32_t> rest = world.goingBodies;
  double room = 0;
  // What one pushes may come into the way of another: at most as many rounds as bodies.
  for (bool more = !rest.empty(); more;) {
    more = false;
    const Box within = grown(avatar.reach, room);
    std::erase_if(rest, [&](std::uint32_t i) {
      const Body& body = world.bodies[i];
      if (!overlaps(within, body.reach)) return false;
      room += body.plan.farthest + 4 * world.lengths.epsilon;
      return more = true;
    });
  }
  // Free bodies push and carry, too, as far as they are driven themselves.
  double carried = 0;
  for (const auto& partner : world.broadPhase.partners(avatar.mover)) {
    const auto found = partner.moves ? world.bodyOfMover.find(partner.id) : world.bodyOfMover.end();
    if (found != world.bodyOfMover.end())
      carried = std::max(carried, world.bodies[found->second].driven);
  }
  return carried > 0 ? room + carried + 4 * world.lengths.epsilon : room;
}

bool isBusy(const Body& body) {
  const BodyDrive& drive = body.drive;
  // What a path that goes round shakes never rests, as little as the path itself.
  if (!isKinematic(body.spec->kind)) return !body.asleep && body.driven == 0;
  if (goesRound(*body.spec)) return false;
  return (drive.going && body.blockedBy == 0) || drive.closesIn >= 0;
}

namespace {

BodyView viewOf(const Body& body, std::uint32_t index) {
  BodyView view;
  view.id = body.id;
  view.index = index;
  view.pose = {body.orientation, body.position};
  view.displaced = body.turned || body.position != body.shape->origin;
  view.coordinate = body.drive.coordinate;
  view.velocity = body.velocity;
  view.spin = body.spin;
  view.swing = body.moved ? body.plan.swing : 0;
  view.moving = body.moved || (body.spec->kind == BodyKind::rigid && !body.asleep);
  view.blockedBy = body.blockedBy;
  return view;
}

bool isAsViewed(const Body& body, const BodyView& view) {
  return !view.moving && !body.moved && (body.asleep || isKinematic(body.spec->kind)) &&
         view.blockedBy == body.blockedBy && view.coordinate == body.drive.coordinate;
}

}  // namespace

std::shared_ptr<const std::vector<BodyView>> viewsOfBodies(const WorldState& world) {
  if (world.snapshot) {
    const std::vector<BodyView>& last = *world.snapshot->bodies;
    bool same = true;
    for (std::size_t i = 0; same && i < last.size(); ++i)
      same = isAsViewed(world.bodies[i], last[i]);
    if (same) return world.snapshot->bodies;
  }
  auto views = std::make_shared<std::vector<BodyView>>();
  for (const Body& body : world.bodies)
    views->push_back(viewOf(body, static_cast<std::uint32_t>(views->size())));
  return views;
}

namespace {

std::string commandsOf(const BodySpec& spec) {
  if (spec.kind == BodyKind::lift) return "give to, level or stop";
  if (spec.kind != BodyKind::path) return "give open, close, to or stop";
  return spec.loops ? "give run or stop" : "give to, run or stop";
}

}  // namespace

std::optional<std::string> refusalOf(const Body& body, const BodyCommand& command,
                                     const Lengths& lengths) {
  using Action = BodyCommand::Action;
  const BodySpec& spec = *body.spec;
  const std::string kind = wordOf(spec.kind);
  if (!isKinematic(spec.kind))
    return "body '" + spec.name + "' is " + kind + ": it takes no commands";
  const bool door = spec.kind == BodyKind::hinged || spec.kind == BodyKind::sliding;
  const auto [low, high] = limitsOf(spec);
  if ((command.action == Action::open || command.action == Action::close) && !door)
    return "body '" + spec.name + "' is no door but " + kind + ": " + commandsOf(spec);
  if (command.action == Action::run && spec.kind != BodyKind::path)
    return "run is for paths; body '" + spec.name + "' is " + kind + ": " + commandsOf(spec);
  if (command.action == Action::to && goesRound(spec))
    return "to: body '" + spec.name + "' goes round; " + commandsOf(spec);
  if (command.action == Action::to && !(command.to >= low && command.to <= high))
    return "to is " + std::to_string(command.to) + "; it must lie in " + std::to_string(low) +
           ".." + std::to_string(high) + (spec.kind == BodyKind::hinged ? " radians" : "");
  if (command.action == Action::level && command.level >= spec.stops.size())
    return "level is " + std::to_string(command.level) + "; body '" + spec.name + "' has " +
           std::to_string(spec.stops.size()) + " stops, counted from 0";
  if (!command.speed) return std::nullopt;
  if (auto why = refusalOfSpeed(*command.speed)) return why;
  const double fastest = *command.speed * fastestPointOf(spec, body.shape->radius);
  if (fastest <= lengths.speedLimit) return std::nullopt;
  return "speed is " + std::to_string(*command.speed) + ", by which a point goes " +
         std::to_string(fastest) + " m/s; none may be faster than " +
         std::to_string(lengths.speedLimit) + " m/s";
}

}  // namespace enfilade::scene
