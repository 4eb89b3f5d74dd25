#include "scene/physics/solver_rows.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "scene/physics/graph_coloring.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kBlocksPerTask = 16;        // rows in one task
constexpr std::size_t kConstraintsPerTask = 256;  // constraints in one task

SolverBody makeSolverBody(const BodyMotion& motion) {
  return {motion.velocity,
          motion.angularVelocity,
          Vec3::Zero(),
          Vec3::Zero(),
          motion.inverseMass,
          motion.inverseMass == 0 ? Mat3(Mat3::Zero()) : computeWorldInverseInertia(motion)};
}

void fillContactPoint(const ContactConstraint& constraint, const ContactConstraintPoint& point,
                      const SolverBody& a, const SolverBody& b, std::size_t lane,
                      ContactConstraintPointW& block) {
  const Jacobian normal(constraint.normal, point.armA.cross(constraint.normal),
                        point.armB.cross(constraint.normal), a, b);
  block.normal.set(lane, normal);
  block.effectiveMass.set(
      lane, invertOrZero(computeResponse(normal, normal, a.inverseMass + b.inverseMass)));
  block.separation.set(lane, point.separation);
  block.approachSpeed.set(lane, normal.relativeVelocity(a, b));
  block.impulse.set(lane, point.impulse);
  block.motorImpulse.set(lane, point.motorImpulse);
}

/// Returns two tangents that depend on the normal alone.
std::array<Vec3, 2> computeTangents(const Vec3& normal) {
  int minIndex = 0;
  normal.cwiseAbs().minCoeff(&minIndex);
  const Vec3 first = normal.cross(Vec3::Unit(minIndex)).normalized();
  return {first, normal.cross(first)};
}

void fillFriction(const ContactConstraint& constraint, const SolverBody& a, const SolverBody& b,
                  std::size_t lane, FrictionW& block) {
  Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
  for (const ContactConstraintPoint& point : constraint.activePoints())
    armA += point.armA, armB += point.armB;
  armA /= static_cast<double>(constraint.pointCount),
      armB /= static_cast<double>(constraint.pointCount);
  const auto [tangent1, tangent2] = computeTangents(constraint.normal);
  const Jacobian jacobian1(tangent1, armA.cross(tangent1), armB.cross(tangent1), a, b);
  const Jacobian jacobian2(tangent2, armA.cross(tangent2), armB.cross(tangent2), a, b);
  block.tangent1.set(lane, tangent1), block.tangent2.set(lane, tangent2);
  block.angular1.set(lane, jacobian1), block.angular2.set(lane, jacobian2);
  const double masses = a.inverseMass + b.inverseMass;
  const double k11 = computeResponse(jacobian1, jacobian1, masses);
  const double k12 = computeResponse(jacobian1, jacobian2, masses);
  const double k22 = computeResponse(jacobian2, jacobian2, masses);
  const double inverseDeterminant = invertOrZero(k11 * k22 - k12 * k12);
  block.effectiveMass11.set(lane, k22 * inverseDeterminant),
      block.effectiveMass12.set(lane, -k12 * inverseDeterminant),
      block.effectiveMass22.set(lane, k11 * inverseDeterminant);
  block.tangentImpulse1.set(lane, constraint.tangentImpulse.dot(tangent1)),
      block.tangentImpulse2.set(lane, constraint.tangentImpulse.dot(tangent2));
  double arm = 0;
  for (const ContactConstraintPoint& point : constraint.activePoints())
    arm += (point.armB - armB).norm();
  block.torsionArm.set(lane, arm / static_cast<double>(constraint.pointCount));
  const Vec3 responseA = a.inverseInertia * constraint.normal,
             responseB = b.inverseInertia * constraint.normal;
  block.torsionResponseA.set(lane, responseA), block.torsionResponseB.set(lane, responseB);
  block.torsionMass.set(
      lane, invertOrZero(constraint.normal.dot(responseA) + constraint.normal.dot(responseB)));
  block.torsionImpulse.set(lane, constraint.torsionImpulse);
}

void fillBody(std::uint32_t body, std::size_t lane, const SolverContext& context,
              ConstraintBodyW& side) {
  ENFILADE_ASSERT(body + 1 < context.bodies.size());  // not the dummy
  side.bodies[lane] = body;
  side.isDynamic[lane] = context.bodies[body].isDynamic();
  side.inverseMass.set(lane, context.bodies[body].inverseMass);
}

void fillLane(const ContactConstraint& constraint, std::size_t lane, ContactConstraintW& block,
              SolverContext& context) {
  ENFILADE_ASSERT(constraint.pointCount > 0 && constraint.pointCount <= block.pointCount);
  const SolverBody &a = context.bodies[constraint.a], &b = context.bodies[constraint.b];
  fillBody(constraint.a, lane, context, block.a);
  fillBody(constraint.b, lane, context, block.b);
  block.frictionCoefficient.set(lane, constraint.friction),
      block.restitution.set(lane, constraint.restitution);
  block.hasFriction |= constraint.friction > 0, block.hasRestitution |= constraint.restitution != 0;
  block.targetSpeed.set(lane, constraint.targetSpeed);
  block.maxMotorImpulse.set(
      lane, constraint.maxPushForce * context.seconds / static_cast<double>(constraint.pointCount));
  block.hasMotor |= constraint.maxPushForce != 0;
  block.normal.set(lane, constraint.normal);
  fillFriction(constraint, a, b, lane, block.frictionRows);
  for (std::uint32_t i = 0; i < constraint.pointCount; ++i)
    fillContactPoint(constraint, constraint.points[i], a, b, lane,
                     context.points[block.firstPoint + i]);
}

/// Returns whether no impulse exists from the last step and no motor acts.
bool isIdle(const ContactConstraint& constraint) {
  const auto hasImpulse = [](const ContactConstraintPoint& point) {
    return point.impulse != 0 || point.motorImpulse != 0;
  };
  return constraint.maxPushForce == 0 && constraint.torsionImpulse == 0 &&
         constraint.tangentImpulse.isZero(0) &&
         std::ranges::none_of(constraint.activePoints(), hasImpulse);
}

void fillConstraint(std::span<const ContactConstraint> constraints, ContactConstraintW& block,
                    SolverContext& context) {
  const auto dummyBody = static_cast<std::uint32_t>(context.bodies.size()) - 1;
  ContactConstraintW filled{};
  filled.constraints = block.constraints, filled.firstPoint = block.firstPoint,
  filled.pointCount = block.pointCount;
  filled.idle = true;
  block = filled;
  std::ranges::fill(context.points.subspan(block.firstPoint, block.pointCount),
                    ContactConstraintPointW{});
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    block.a.bodies[lane] = block.b.bodies[lane] = dummyBody;
    if (block.constraints[lane] == kNoConstraint) continue;
    const ContactConstraint& constraint = constraints[block.constraints[lane]];
    if (constraint.pointCount == 0) continue;
    fillLane(constraint, lane, block, context);
    block.idle &= isIdle(constraint);
  }
}

constexpr std::uint8_t kMaxBatchKey = 2 * ContactConstraint::kMaxPoints;

/// Sort key of a constraint within its color: those with impulses first, and among equals those
/// with most points first.
std::uint8_t computeBatchKey(const ContactConstraint& constraint) {
  return static_cast<std::uint8_t>((isIdle(constraint) ? 2 : 1) * ContactConstraint::kMaxPoints -
                                   constraint.pointCount);
}

/// Fills `blocks` with the constraints of one color, `lanesPerBlock` to each.
void batchColor(std::span<const ContactConstraint> constraints,
                std::span<const std::uint8_t> batchKeys, std::span<const std::uint32_t> color,
                std::size_t lanesPerBlock, std::span<ContactConstraintW> blocks) {
  std::size_t count = 0;
  const auto add = [&](std::uint32_t constraint) {
    ContactConstraintW& block = blocks[count / lanesPerBlock];
    if (count % lanesPerBlock == 0) block.constraints.fill(kNoConstraint), block.pointCount = 0;
    block.constraints[count++ % lanesPerBlock] = constraint;
    block.pointCount =
        std::max(block.pointCount, static_cast<std::uint32_t>(constraints[constraint].pointCount));
  };
  if (lanesPerBlock == 1) {
    for (const std::uint32_t constraint : color) add(constraint);
    return;
  }
  for (std::uint8_t batchKey = 0; batchKey <= kMaxBatchKey; ++batchKey)
    for (const std::uint32_t constraint : color)
      if (batchKeys[constraint] == batchKey) add(constraint);
  ENFILADE_ASSERT(count == color.size());
}

/// Assigns constraints to blocks and points to constraints. The rest of the blocks is not set.
void buildBatches(std::span<const ContactConstraint> constraints, SolverContext& context,
                  ThreadPool& pool) {
  std::vector<std::uint8_t> isDynamic(context.bodies.size()), batchKeys(constraints.size());
  for (std::size_t i = 0; i < isDynamic.size(); ++i) isDynamic[i] = context.bodies[i].isDynamic();
  pool.parallelFor(constraints.size(), kConstraintsPerTask, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) batchKeys[k] = computeBatchKey(constraints[k]);
  });
  const ConstraintColoring coloring = colorConstraints(constraints, isDynamic);
  std::uint32_t from = 0, size = 0;
  context.colorEnds.clear();
  // Constraints of the last color may share bodies: one per block.
  const auto getLanesPerBlock = [&](std::size_t color) {
    return color + 1 == coloring.ends.size() ? std::size_t{1} : kLanes;
  };
  for (std::size_t i = 0; i < coloring.ends.size(); ++i) {
    const std::size_t lanesPerBlock = getLanesPerBlock(i);
    size +=
        static_cast<std::uint32_t>((coloring.ends[i] - from + lanesPerBlock - 1) / lanesPerBlock);
    context.colorEnds.push_back(size);
    from = coloring.ends[i];
  }
  context.constraints = context.constraintBuffer.allocate(size);
  std::uint32_t block = 0;
  from = 0;
  for (std::size_t i = 0; i < coloring.ends.size(); ++i) {
    batchColor(
        constraints, batchKeys, std::span(coloring.order).subspan(from, coloring.ends[i] - from),
        getLanesPerBlock(i), context.constraints.subspan(block, context.colorEnds[i] - block));
    block = context.colorEnds[i];
    from = coloring.ends[i];
  }
  std::uint32_t points = 0;
  for (ContactConstraintW& constraintBlock : context.constraints) {
    constraintBlock.firstPoint = points;
    points += constraintBlock.pointCount;
  }
  context.points = context.pointBuffer.allocate(points);
}

}  // namespace

void prepareConstraints(std::span<const BodyMotion> motions,
                        std::span<const ContactConstraint> constraints, SolverContext& context,
                        ThreadPool& pool) {
  context.bodies.resize(motions.size() + 1);
  context.bodies.back() = makeSolverBody({});
  pool.parallelFor(motions.size(), kBlocksPerTask, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) context.bodies[i] = makeSolverBody(motions[i]);
  });
  buildBatches(constraints, context, pool);
  pool.parallelFor(context.constraints.size(), kBlocksPerTask,
                   [&](std::size_t from, std::size_t to) {
                     for (std::size_t k = from; k < to; ++k)
                       fillConstraint(constraints, context.constraints[k], context);
                   });
}

}  // namespace enfilade::scene
