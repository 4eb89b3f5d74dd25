#include "scene/world/bodies/body_state.hpp"

namespace enfilade::scene {
namespace {

BodySnapshot makeBodySnapshot(const Body& body, std::uint32_t index) {
  BodySnapshot snapshot;
  snapshot.id = body.id;
  snapshot.index = index;
  snapshot.pose = {body.orientation, body.position};
  snapshot.displaced = body.isRotated || body.position != body.shape->origin;
  snapshot.jointPosition = body.drive.jointPosition;
  snapshot.velocity = body.velocity;
  snapshot.angularVelocity = body.angularVelocity;
  snapshot.velocityDeviation = body.moved ? body.kinematicTarget.velocityDeviation : 0;
  snapshot.moving = body.moved || (isDynamic(body.spec->kind) && !body.asleep);
  snapshot.blockedBy = body.blockedBy;
  return snapshot;
}

bool matchesSnapshot(const Body& body, const BodySnapshot& snapshot) {
  return !snapshot.moving && !body.moved && (body.asleep || isKinematic(body.spec->kind)) &&
         snapshot.blockedBy == body.blockedBy && snapshot.jointPosition == body.drive.jointPosition;
}

}  // namespace

void hashBodies(const WorldData& world, Hasher& hash) {
  for (const Body& body : world.bodies) {
    const KinematicDrive& drive = body.drive;
    if (!body.occupants.empty()) {
      hash.add((std::uint64_t{body.id} << 32) | body.occupants.size());
      for (const EntityId id : body.occupants) hash.add(std::uint64_t{id});
    }
    if (!body.moved && !drive.moving && drive.autoCloseIn < 0) continue;
    hash.add(std::uint64_t{body.id});
    hash.add(body.position);
    for (const double number :
         {body.orientation.w(), body.orientation.x(), body.orientation.y(), body.orientation.z()})
      hash.add(number);
    hash.add(body.velocity);
    hash.add(body.angularVelocity);
    for (const double number :
         {drive.jointPosition, drive.jointVelocity, drive.target, drive.speed, drive.autoCloseIn})
      hash.add(number);
    hash.add((std::uint64_t{body.blockedBy} << 1) | std::uint64_t{drive.moving});
  }
}

std::shared_ptr<const std::vector<BodySnapshot>> makeBodySnapshots(const WorldData& world) {
  if (world.snapshot) {
    const std::vector<BodySnapshot>& last = *world.snapshot->bodies;
    bool same = true;
    for (std::size_t i = 0; same && i < last.size(); ++i)
      same = matchesSnapshot(world.bodies[i], last[i]);
    if (same) return world.snapshot->bodies;
  }
  auto snapshots = std::make_shared<std::vector<BodySnapshot>>();
  for (const Body& body : world.bodies)
    snapshots->push_back(makeBodySnapshot(body, static_cast<std::uint32_t>(snapshots->size())));
  return snapshots;
}

void updatePartBoxes(const WorldData& world, Body& body) {
  if (!world.broadPhase.getOverlaps(body.proxy).empty()) makePartBoxes(body);
}

bool isBodyBusy(const Body& body) {
  const KinematicDrive& drive = body.drive;
  // A body that a looping path shakes never rests, and the path itself neither.
  if (!isKinematic(body.spec->kind)) return !body.asleep && body.kinematicPushBound == 0;
  if (isLoopingPath(*body.spec)) return false;
  return (drive.moving && body.blockedBy == 0) || drive.autoCloseIn >= 0;
}

}  // namespace enfilade::scene
