#include "tests/accuracy/families.hpp"

#include <cmath>

namespace enfilade::accuracy {
namespace {

using collision::testing::drawUniform;
using collision::testing::makeLatticePoints;
using collision::testing::makeRandomPoint;
using collision::testing::makeRandomPoints;
using Points = std::vector<Vec3>;

int drawBelow(Random& random, int count) {
  return static_cast<int>(random() % static_cast<std::uint64_t>(count));
}

bool isChance(Random& random, double part) {
  return drawUniform(random, 0, 1) < part;
}

/// A random value from 10^low to 10^high, uniform in the exponent.
double drawMagnitude(Random& random, double low, double high) {
  const double exponent = drawUniform(random, low, high);
  return std::exp(exponent * 2.302585092994046);
}

Mat3 makeRandomRotation(Random& random) {
  const Vec3 axis = makeRandomPoint(random, 1);
  const double angle = drawUniform(random, 0, 6.28);
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/// A rotation by `angle` about a random axis.
Mat3 makeSmallRotation(Random& random, double angle) {
  return Eigen::AngleAxisd(angle, makeRandomPoint(random, 1).normalized()).toRotationMatrix();
}

/// Orthonormal only to about `steps` ulps: a product of many small rotations, never renormalised.
Mat3 makeDriftedRotation(Random& random, int steps) {
  Mat3 rotation = makeRandomRotation(random);
  const Mat3 step = makeSmallRotation(random, 0.1);
  for (int i = 0; i < steps; ++i) rotation = step * rotation;
  return rotation;
}

void placeTogether(Case& pair, const Mat3& rotation, const Vec3& translation) {
  pair.a.rotation = pair.b.rotation = rotation;
  pair.a.translation = pair.b.translation = translation;
}

/// Lattice points on one side of the plane z = 0, some of them in it.
Points makeLatticeSide(Random& random, int count, double side) {
  Points points = makeLatticePoints(random, count, 3);
  for (Vec3& p : points) p.z() = side * std::abs(p.z());
  const int level = 1 + drawBelow(random, 4);
  for (int i = 0; i < level; ++i) points[static_cast<std::size_t>(i)].z() = 0;
  return points;
}

Points makeBox(const Vec3& low, const Vec3& high) {
  Points points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                        (i & 4) != 0 ? high.z() : low.z());
  return points;
}

Points flattenPoints(Points points) {
  for (Vec3& p : points) p.z() = 0;
  return points;
}

void scalePair(Case& pair, double factor) {
  for (Placed* body : {&pair.a, &pair.b}) {
    for (Vec3& p : body->points) p *= factor;
    body->translation *= factor;
  }
}

Case makeDriftedContact(Random& random) {
  Case pair;
  pair.a.points = makeLatticeSide(random, 6, -1);
  pair.b.points = makeLatticeSide(random, 6, 1);
  placeTogether(pair, makeDriftedRotation(random, 300), makeRandomPoint(random, 5));
  return pair;
}

Case makeSliver(Random& random) {
  Case pair;
  pair.a.points = makeRandomPoints(random, 5, 1);
  const double thickness = drawMagnitude(random, -14, -6);
  for (Vec3& p : pair.a.points) p.z() *= thickness;
  pair.b.points = makeRandomPoints(random, 4, 1);
  if (isChance(random, 0.5))
    for (Vec3& p : pair.b.points) p.z() = 1 + p.z() * thickness;
  pair.b.translation = {0, 0, -1 + thickness * drawUniform(random, -2, 2)};
  const Mat3 rotation = makeRandomRotation(random);
  pair.b.translation = rotation * pair.b.translation;
  pair.a.rotation = pair.b.rotation = rotation;
  return pair;
}

Case makeCoincidentVertices(Random& random) {
  Case pair;
  pair.a.points = makeRandomPoints(random, 5, 1);
  pair.b.points = makeRandomPoints(random, 4, 1);
  const int shared = 1 + drawBelow(random, 3);
  for (int i = 0; i < shared; ++i)
    pair.b.points.push_back(pair.a.points[static_cast<std::size_t>(i)]);
  pair.a.points.push_back(pair.a.points.front());
  placeTogether(pair, makeDriftedRotation(random, 20), makeRandomPoint(random, 3));
  return pair;
}

Case makePolygonsInOnePlane(Random& random) {
  Case pair;
  pair.a.points = flattenPoints(makeLatticePoints(random, 6, 4));
  pair.b.points = flattenPoints(makeLatticePoints(random, 5, 2));
  if (isChance(random, 0.5)) {
    const Vec3 shift(drawBelow(random, 13) - 6, drawBelow(random, 13) - 6, 0);
    for (Vec3& p : pair.b.points) p += shift;
  }
  placeTogether(pair, makeDriftedRotation(random, 50), makeRandomPoint(random, 5));
  return pair;
}

Case makeCollinearSegments(Random& random) {
  Case pair;
  const Vec3 along = makeLatticePoints(random, 1, 5).front() + Vec3(0, 0, 6);
  const Vec3 start = makeLatticePoints(random, 1, 5).front();
  const auto point = [&] { return Vec3(start + (drawBelow(random, 9) - 4) * along); };
  for (int i = 0; i < 2; ++i) pair.a.points.push_back(point());
  for (int i = 0; i < 2; ++i) pair.b.points.push_back(point());
  if (isChance(random, 0.3)) pair.b.points.push_back(pair.b.points[0] + Vec3(1, 2, 0));
  placeTogether(pair, makeDriftedRotation(random, 30), makeRandomPoint(random, 5));
  return pair;
}

Case makeFarOffset(Random& random) {
  Case pair;
  pair.a.points = makeRandomPoints(random, 6, 1);
  pair.b.points = makeRandomPoints(random, 6, 1);
  pair.a.rotation = makeRandomRotation(random);
  pair.b.rotation = makeRandomRotation(random);
  pair.a.translation = makeRandomPoint(random, drawMagnitude(random, 8, 13));
  pair.b.translation = pair.a.translation + makeRandomPoint(random, 1.2);
  return pair;
}

Case makeTinyOrHuge(Random& random) {
  Case pair;
  pair.a.points = makeRandomPoints(random, 6, 1);
  pair.b.points = makeRandomPoints(random, 6, 1);
  pair.a.rotation = makeRandomRotation(random);
  pair.b.rotation = makeRandomRotation(random);
  pair.b.translation = makeRandomPoint(random, 1.5);
  scalePair(pair,
            isChance(random, 0.5) ? drawMagnitude(random, -60, -12) : drawMagnitude(random, 8, 60));
  return pair;
}

Case makeNearParallelFaces(Random& random) {
  Case pair;
  const Vec3 half(drawUniform(random, 0.2, 2), drawUniform(random, 0.2, 2),
                  drawUniform(random, 0.2, 2));
  pair.a.points = makeBox(-half, half);
  pair.b.points = makeBox({-0.5, -0.5, 0}, {0.5, 0.5, 1});
  const double gap = drawMagnitude(random, -17, -4) * (isChance(random, 0.5) ? 1 : -1);
  const Mat3 rotation = makeRandomRotation(random);
  pair.a.rotation = rotation;
  pair.b.rotation = makeSmallRotation(random, drawMagnitude(random, -17, -5)) * rotation;
  pair.b.translation = rotation * Vec3(0, 0, half.z() + gap);
  return pair;
}

Case makeDeepInside(Random& random) {
  Case pair;
  const double size = drawMagnitude(random, -6, 0);
  pair.a.points = makeBox({-1, -1, -1}, {1, 1, 1});
  pair.b.points = isChance(random, 0.5) ? makeRandomPoints(random, 5, size)
                                        : makeBox(Vec3::Constant(-size), Vec3::Constant(size));
  if (isChance(random, 0.3))
    pair.b.points.resize(1 + static_cast<std::size_t>(drawBelow(random, 4)));
  if (isChance(random, 0.5)) pair.a.rotation = makeRandomRotation(random);
  if (isChance(random, 0.5)) pair.b.rotation = makeRandomRotation(random);
  if (isChance(random, 0.5)) pair.b.translation = makeRandomPoint(random, 0.3);
  return pair;
}

Case makeCrossingPolygons(Random& random) {
  Case pair;
  pair.a.points = flattenPoints(makeRandomPoints(random, 5, 1));
  pair.b.points = flattenPoints(makeRandomPoints(random, 4, 1));
  pair.a.rotation = makeDriftedRotation(random, 30);
  pair.b.rotation = makeDriftedRotation(random, 30);
  pair.b.translation = makeRandomPoint(random, 0.7);
  return pair;
}

Case makePointsOnFeatures(Random& random) {
  Case pair;
  pair.a.points = makeLatticePoints(random, 7, 4);
  // A combination in quarters: on an edge, a face, or inside, exactly.
  const auto pick = [&] { return pair.a.points[static_cast<std::size_t>(drawBelow(random, 7))]; };
  const auto on = [&] {
    const Vec3 p = pick(), q = pick(), r = pick();
    return Vec3(0.25 * p + 0.25 * q + 0.5 * r);
  };
  const int count = 1 + drawBelow(random, 3);
  for (int i = 0; i < count; ++i) pair.b.points.push_back(on());
  if (isChance(random, 0.4)) pair.b.points.push_back(makeLatticePoints(random, 1, 8).front());
  placeTogether(pair, makeDriftedRotation(random, 100), makeRandomPoint(random, 3));
  return pair;
}

Case makeMixedSizes(Random& random) {
  Case pair;
  const double small = drawMagnitude(random, -9, -3);
  pair.a.points = makeRandomPoints(random, 7, 1e3);
  pair.b.points = makeRandomPoints(random, 6, small);
  const Vec3 p = pair.a.points[0], q = pair.a.points[1], r = pair.a.points[2];
  const double s = drawUniform(random, 0, 0.5), t = drawUniform(random, 0, 0.5);
  pair.b.translation = p + s * (q - p) + t * (r - p) + makeRandomPoint(random, 2 * small);
  return pair;
}

Case makeSkewNeedles(Random& random) {
  Case pair;
  pair.a.points = {{-1, 0, 0}, {1, 0, 0}};
  const double angle = drawMagnitude(random, -12, 0);
  pair.b.points = {{-1, -angle, 0}, {1, angle, 0}};
  const double gap = isChance(random, 0.3) ? 0 : drawMagnitude(random, -18, -2);
  if (isChance(random, 0.5)) pair.a.points.push_back({0, drawMagnitude(random, -9, -3), 0});
  pair.b.translation = {drawUniform(random, -0.5, 0.5), 0, gap};
  if (isChance(random, 0.6)) {
    const Mat3 rotation = makeRandomRotation(random);
    pair.b.translation = rotation * pair.b.translation;
    pair.a.rotation = pair.b.rotation = rotation;
  }
  return pair;
}

Case makeNearlyEqualBodies(Random& random) {
  Case pair;
  pair.a.points =
      isChance(random, 0.5) ? makeLatticePoints(random, 7, 2) : makeRandomPoints(random, 7, 1);
  pair.b.points = pair.a.points;
  placeTogether(pair, makeDriftedRotation(random, 10), makeRandomPoint(random, 2));
  if (isChance(random, 0.5))
    pair.b.translation += makeRandomPoint(random, drawMagnitude(random, -17, -13));
  if (isChance(random, 0.3)) pair.b.rotation = makeSmallRotation(random, 1e-16) * pair.b.rotation;
  return pair;
}

Case makeLattice(Random& random) {
  Case pair;
  pair.a.points = makeLatticePoints(random, 1 + drawBelow(random, 8), 2);
  pair.b.points = makeLatticePoints(random, 1 + drawBelow(random, 8), 2);
  pair.b.translation = makeLatticePoints(random, 1, 3).front();
  Mat3 quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Mat3 cycle;
  cycle << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (isChance(random, 0.5)) pair.a.rotation = quarter;
  if (isChance(random, 0.5)) pair.b.rotation = cycle * quarter;
  return pair;
}

Case makeStackedGrids(Random& random) {
  Case pair;
  const auto grid = [&](double z) {
    Points points;
    for (int i = 0; i < 9; ++i) points.emplace_back(0.1 * (i % 3), 0.1 * (i / 3), z);
    return points;
  };
  pair.a.points = grid(0);
  pair.a.points.push_back({0.1, 0.1, -1});
  pair.b.points = grid(0);
  pair.b.points.push_back({0.1, 0.1, 1});
  const int axis = drawBelow(random, 3);
  const double ulps = static_cast<double>(drawBelow(random, 5) - 2) * 0x1p-53;
  pair.b.translation = {0.1 * drawBelow(random, 3), axis == 1 ? 0.2 : 0, axis == 2 ? ulps : 0};
  if (isChance(random, 0.5)) {
    const Vec3 offset = pair.b.translation;
    placeTogether(pair, makeDriftedRotation(random, 5), Vec3::Zero());
    pair.b.translation = pair.b.rotation * offset;
  }
  return pair;
}

std::string formatDecimal(const mpf_class& value) {
  std::array<char, 120> text{};
  gmp_snprintf(text.data(), text.size(), "%.70Fe", value.get_mpf_t());
  return text.data();
}

}  // namespace

const std::vector<Family>& getFamilies() {
  static const std::vector<Family> all{{"drifted_contact", makeDriftedContact},
                                       {"sliver", makeSliver},
                                       {"coincident_vertices", makeCoincidentVertices},
                                       {"polygons_in_one_plane", makePolygonsInOnePlane},
                                       {"collinear_segments", makeCollinearSegments},
                                       {"far_offset", makeFarOffset},
                                       {"tiny_or_huge", makeTinyOrHuge},
                                       {"near_parallel_faces", makeNearParallelFaces},
                                       {"deep_inside", makeDeepInside},
                                       {"crossing_polygons", makeCrossingPolygons},
                                       {"points_on_features", makePointsOnFeatures},
                                       {"mixed_sizes", makeMixedSizes},
                                       {"skew_needles", makeSkewNeedles},
                                       {"nearly_equal_bodies", makeNearlyEqualBodies},
                                       {"lattice", makeLattice},
                                       {"stacked_grids", makeStackedGrids}};
  return all;
}

Truth computeTruth(const Case& testCase) {
  const ReferenceResult answer = computeReferenceResult(makeExactPair(testCase.a, testCase.b));
  Truth truth;
  truth.distance = formatDecimal(answer.distance);
  switch (answer.verdict) {
    case ReferenceVerdict::separated:
      truth.verdict = "separated";
      break;
    case ReferenceVerdict::touching:
      truth.verdict = "touching";
      break;
    case ReferenceVerdict::penetrating:
      truth.verdict = "penetrating";
      truth.penetration = formatDecimal(answer.depth);
      break;
  }
  if (testCase.clearance) truth.near = answer.distance < toPreciseNumber(2 * *testCase.clearance);
  return truth;
}

Case makeCase(const Family& family, Random& random, int number) {
  Case result = family.make(random);
  result.id = std::string(family.name) + '-' + std::to_string(number);
  result.family = family.name;
  const ExactPair pair = makeExactPair(result.a, result.b);
  const double distance = computeLength(findNearestOfDifference(pair.a, pair.b), pair.bits).get_d();
  result.clearance = distance * (0.5 + drawBelow(random, 5) * 0x1p-53 - 0x1p-52);
  if (distance == 0) result.clearance = drawMagnitude(random, -20, -3);
  result.truth = computeTruth(result);
  return result;
}

}  // namespace enfilade::accuracy
