#include "scene/physics/solver_rows.hpp"

#include <algorithm>

#include "scene/physics/graph_coloring.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kBlock = 16;     // rows that a thread takes at a time
constexpr std::size_t kPatches = 256;  // and patches

Mover moverOf(const RigidBody& body) {
  return {body.velocity,    body.spin,
          Vec3::Zero(),     Vec3::Zero(),
          body.inverseMass, body.inverseMass == 0 ? Mat3(Mat3::Zero()) : worldInverseInertia(body)};
}

void fillPoint(const ContactPatch& patch, const PatchPoint& point, const Mover& a, const Mover& b,
               std::size_t lane, PointBlock& block) {
  const Direction normal(patch.normal, point.armA.cross(patch.normal),
                         point.armB.cross(patch.normal), a, b);
  block.normal.put(lane, normal);
  block.mass.put(lane, inverted(response(normal, normal, a.inverseMass + b.inverseMass)));
  block.separation.put(lane, point.separation);
  block.arrival.put(lane, normal.speed(a, b));
  block.impulse.put(lane, point.impulse);
  block.push.put(lane, point.push);
}

/// Two tangents that depend on the normal alone.
std::array<Vec3, 2> tangents(const Vec3& normal) {
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vec3 first = normal.cross(Vec3::Unit(least)).normalized();
  return {first, normal.cross(first)};
}

void fillRub(const ContactPatch& patch, const Mover& a, const Mover& b, std::size_t lane,
             RubBlock& block) {
  Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
  for (const PatchPoint& point : patch.list()) armA += point.armA, armB += point.armB;
  armA /= static_cast<double>(patch.size), armB /= static_cast<double>(patch.size);
  const auto [alongFirst, alongSecond] = tangents(patch.normal);
  const Direction first(alongFirst, armA.cross(alongFirst), armB.cross(alongFirst), a, b);
  const Direction second(alongSecond, armA.cross(alongSecond), armB.cross(alongSecond), a, b);
  block.alongFirst.put(lane, alongFirst), block.alongSecond.put(lane, alongSecond);
  block.first.put(lane, first), block.second.put(lane, second);
  const double masses = a.inverseMass + b.inverseMass;
  const double k11 = response(first, first, masses);
  const double k12 = response(first, second, masses);
  const double k22 = response(second, second, masses);
  const double over = inverted(k11 * k22 - k12 * k12);
  block.m11.put(lane, k22 * over), block.m12.put(lane, -k12 * over),
      block.m22.put(lane, k11 * over);
  block.rub1.put(lane, patch.rub.dot(alongFirst)), block.rub2.put(lane, patch.rub.dot(alongSecond));
  double arm = 0;
  for (const PatchPoint& point : patch.list()) arm += (point.armB - armB).norm();
  block.arm.put(lane, arm / static_cast<double>(patch.size));
  const Vec3 turnA = a.inverseInertia * patch.normal, turnB = b.inverseInertia * patch.normal;
  block.turnA.put(lane, turnA), block.turnB.put(lane, turnB);
  block.twistMass.put(lane, inverted(patch.normal.dot(turnA) + patch.normal.dot(turnB)));
  block.twist.put(lane, patch.twist);
}

void fillSide(std::uint32_t mover, std::size_t lane, const System& system, BlockSide& side) {
  side.movers[lane] = mover;
  side.yields[lane] = system.movers[mover].yields();
  side.inverseMass.put(lane, system.movers[mover].inverseMass);
}

void fillLane(const ContactPatch& patch, std::size_t lane, PatchBlock& block, System& system) {
  const Mover &a = system.movers[patch.a], &b = system.movers[patch.b];
  fillSide(patch.a, lane, system, block.a);
  fillSide(patch.b, lane, system, block.b);
  block.friction.put(lane, patch.friction), block.restitution.put(lane, patch.restitution);
  block.rubs |= patch.friction > 0, block.bounces |= patch.restitution != 0;
  block.pushSpeed.put(lane, patch.pushSpeed);
  block.mostPush.put(lane, patch.mostPush * system.seconds / static_cast<double>(patch.size));
  block.pushes |= patch.mostPush != 0;
  block.normal.put(lane, patch.normal);
  fillRub(patch, a, b, lane, block.rub);
  for (std::uint32_t i = 0; i < patch.size; ++i)
    fillPoint(patch, patch.points[i], a, b, lane, system.points[block.firstPoint + i]);
}

/// Nothing pushed in the last step, and nobody pushes.
bool isIdle(const ContactPatch& patch) {
  const auto pushes = [](const PatchPoint& point) { return point.impulse != 0 || point.push != 0; };
  return patch.mostPush == 0 && patch.twist == 0 && patch.rub.isZero(0) &&
         std::ranges::none_of(patch.list(), pushes);
}

void fillBlock(std::span<const ContactPatch> patches, PatchBlock& block, System& system) {
  const auto nobody = static_cast<std::uint32_t>(system.movers.size()) - 1;
  PatchBlock filled{};
  filled.patches = block.patches, filled.firstPoint = block.firstPoint, filled.size = block.size;
  filled.idle = true;
  block = filled;
  std::ranges::fill(system.points.subspan(block.firstPoint, block.size), PointBlock{});
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    block.a.movers[lane] = block.b.movers[lane] = nobody;
    if (block.patches[lane] == kNoPatch) continue;
    const ContactPatch& patch = patches[block.patches[lane]];
    if (patch.size == 0) continue;
    fillLane(patch, lane, block, system);
    block.idle &= isIdle(patch);
  }
}

/// Which patches go side by side: those that push, then those that do not yet, and of each those
/// with most points first.
constexpr std::uint8_t kLastKind = 2 * ContactPatch::kMostPoints;
std::uint8_t kindOf(const ContactPatch& patch) {
  return static_cast<std::uint8_t>((isIdle(patch) ? 2 : 1) * ContactPatch::kMostPoints -
                                   patch.size);
}

/// Fills `blocks` with the patches of one colour, `most` to each.
void layOutColour(std::span<const ContactPatch> patches, std::span<const std::uint8_t> kinds,
                  std::span<const std::uint32_t> colour, std::size_t most,
                  std::span<PatchBlock> blocks) {
  std::size_t count = 0;
  const auto add = [&](std::uint32_t patch) {
    PatchBlock& block = blocks[count / most];
    if (count % most == 0) block.patches.fill(kNoPatch), block.size = 0;
    block.patches[count++ % most] = patch;
    block.size = std::max(block.size, static_cast<std::uint32_t>(patches[patch].size));
  };
  if (most == 1) {
    for (const std::uint32_t patch : colour) add(patch);
    return;
  }
  for (std::uint8_t kind = 0; kind <= kLastKind; ++kind)
    for (const std::uint32_t patch : colour)
      if (kinds[patch] == kind) add(patch);
}

/// Which blocks stand where, and which points are theirs. The rest is left as it is.
void layOut(std::span<const ContactPatch> patches, System& system, Workers& workers) {
  std::vector<std::uint8_t> moves(system.movers.size()), kinds(patches.size());
  for (std::size_t i = 0; i < moves.size(); ++i) moves[i] = system.movers[i].yields();
  workers.share(patches.size(), kPatches, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) kinds[k] = kindOf(patches[k]);
  });
  const Colouring colouring = colourPatches(patches, moves);
  std::uint32_t from = 0, size = 0;
  system.colours.clear();
  // The last colour's may share bodies: each is alone.
  const auto mostOf = [&](std::size_t colour) {
    return colour + 1 == colouring.ends.size() ? std::size_t{1} : kLanes;
  };
  for (std::size_t i = 0; i < colouring.ends.size(); ++i) {
    const std::size_t most = mostOf(i);
    size += static_cast<std::uint32_t>((colouring.ends[i] - from + most - 1) / most);
    system.colours.push_back(size);
    from = colouring.ends[i];
  }
  system.blocks = system.blockRoom.take(size);
  std::uint32_t block = 0;
  from = 0;
  for (std::size_t i = 0; i < colouring.ends.size(); ++i) {
    layOutColour(patches, kinds, std::span(colouring.order).subspan(from, colouring.ends[i] - from),
                 mostOf(i), system.blocks.subspan(block, system.colours[i] - block));
    block = system.colours[i];
    from = colouring.ends[i];
  }
  std::uint32_t points = 0;
  for (PatchBlock& laid : system.blocks) {
    laid.firstPoint = points;
    points += laid.size;
  }
  system.points = system.pointRoom.take(points);
}

}  // namespace

void setUp(std::span<const RigidBody> bodies, std::span<const ContactPatch> patches, System& system,
           Workers& workers) {
  system.movers.resize(bodies.size() + 1);
  system.movers.back() = moverOf({});
  workers.share(bodies.size(), kBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) system.movers[i] = moverOf(bodies[i]);
  });
  layOut(patches, system, workers);
  workers.share(system.blocks.size(), kBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) fillBlock(patches, system.blocks[k], system);
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
