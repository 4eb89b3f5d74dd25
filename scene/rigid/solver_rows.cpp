#include "scene/rigid/solver_rows.hpp"

#include "scene/rigid/colours.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kBlock = 16;  // rows that a thread takes at a time

Mover moverOf(const RigidBody& body) {
  return {body.velocity,    body.spin,
          Vec3::Zero(),     Vec3::Zero(),
          body.inverseMass, body.inverseMass == 0 ? Mat3(Mat3::Zero()) : worldInverseInertia(body)};
}

PointRow pointRow(const ContactPatch& patch, const PatchPoint& point, const Mover& a,
                  const Mover& b) {
  PointRow row;
  row.normal =
      Direction(patch.normal, point.armA.cross(patch.normal), point.armB.cross(patch.normal), a, b);
  row.mass = inverted(response(row.normal, row.normal, a.inverseMass + b.inverseMass));
  row.separation = point.separation;
  row.arrival = row.normal.speed(a, b);
  row.impulse = point.impulse;
  row.sum = row.parting = 0;
  row.push = point.push;
  return row;
}

/// Two tangents that depend on the normal alone.
std::array<Vec3, 2> tangents(const Vec3& normal) {
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vec3 first = normal.cross(Vec3::Unit(least)).normalized();
  return {first, normal.cross(first)};
}

RubRow rubRow(const ContactPatch& patch, const Mover& a, const Mover& b) {
  RubRow row;
  Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
  for (const PatchPoint& point : patch.list()) armA += point.armA, armB += point.armB;
  armA /= static_cast<double>(patch.size), armB /= static_cast<double>(patch.size);
  const auto [first, second] = tangents(patch.normal);
  row.first = Direction(first, armA.cross(first), armB.cross(first), a, b);
  row.second = Direction(second, armA.cross(second), armB.cross(second), a, b);
  const double masses = a.inverseMass + b.inverseMass;
  const double k11 = response(row.first, row.first, masses);
  const double k12 = response(row.first, row.second, masses);
  const double k22 = response(row.second, row.second, masses);
  const double over = inverted(k11 * k22 - k12 * k12);
  row.m11 = k22 * over, row.m12 = -k12 * over, row.m22 = k11 * over;
  row.rub1 = patch.rub.dot(first), row.rub2 = patch.rub.dot(second);
  row.arm = 0;
  for (const PatchPoint& point : patch.list()) row.arm += (point.armB - armB).norm();
  row.arm /= static_cast<double>(patch.size);
  row.turnA = a.inverseInertia * patch.normal, row.turnB = b.inverseInertia * patch.normal;
  row.twistMass = inverted(patch.normal.dot(row.turnA) + patch.normal.dot(row.turnB));
  row.twist = patch.twist;
  return row;
}

void fillPatch(const ContactPatch& patch, PatchRow& row, System& system) {
  const Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
  row.friction = patch.friction, row.restitution = patch.restitution;
  row.pushSpeed = patch.pushSpeed;
  row.mostPush = patch.mostPush * system.seconds / static_cast<double>(patch.size);
  row.normal = patch.normal;
  row.rub = rubRow(patch, a, b);
  for (std::uint32_t i = 0; i < row.size; ++i)
    system.points[row.firstPoint + i] = pointRow(patch, patch.points[i], a, b);
}

/// Which rows stand where.
void layOut(std::span<const ContactPatch> patches, System& system) {
  std::vector<std::uint8_t> moves(system.movers.size());
  for (std::size_t i = 0; i < moves.size(); ++i) moves[i] = system.movers[i].yields();
  const Colouring colouring = colourPatches(patches, moves);
  system.colours = colouring.ends;
  system.patches.resize(patches.size());
  std::uint32_t points = 0;
  for (std::size_t k = 0; k < patches.size(); ++k) {
    PatchRow& row = system.patches[k];
    row.patch = colouring.order[k];
    const ContactPatch& patch = patches[row.patch];
    row.a = patch.a, row.b = patch.b;
    row.firstPoint = points;
    row.size = static_cast<std::uint32_t>(patch.size);
    points += row.size;
  }
  system.points.resize(points);
}

}  // namespace

void setUp(std::span<const RigidBody> bodies, std::span<const ContactPatch> patches, System& system,
           Workers& workers) {
  system.movers.resize(bodies.size());
  workers.share(bodies.size(), kBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) system.movers[i] = moverOf(bodies[i]);
  });
  layOut(patches, system);
  workers.share(patches.size(), kBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k)
      fillPatch(patches[system.patches[k].patch], system.patches[k], system);
  });
}

/// The joints' rows for the poses of now; their impulses are the joints'.
void placeJoints(std::span<const RigidBody> bodies, std::span<const Joint> joints, System& system) {
  std::vector<JointRow> rows;
  for (std::uint32_t i = 0; i < joints.size(); ++i)
    appendRows(joints[i], i, bodies, system.seconds, rows);
  system.joints.clear();
  for (const JointRow& row : rows) {
    const Joint& joint = joints[row.joint];
    const Mover &a = system.movers[joint.a], &b = system.movers[joint.b];
    const Direction direction(row.linear, row.angularA, row.angularB, a, b);
    const double mass = inverted(response(direction, direction, a.inverseMass + b.inverseMass));
    system.joints.push_back({row, direction, mass, joint.impulses[row.slot], 0});
  }
}

}  // namespace enfilade::scene
