#include "assets/furniture.hpp"

namespace enfilade::assets {
namespace {

void addLegs(PaintedMesh& s, double halfX, double halfZ, double height, double thick, Paint paint) {
  for (const double x : {-halfX, halfX})
    for (const double z : {-halfZ, halfZ})
      addBox(s, {x - thick, 0, z - thick}, {x + thick, height, z + thick}, paint);
}

}  // namespace

PaintedMesh makeChairShape(Paint wood, Paint seat) {
  PaintedMesh s;
  addLegs(s, 0.19, 0.19, 0.43, 0.018, wood);
  addBox(s, {-0.215, 0.425, -0.215}, {0.215, 0.45, 0.215}, wood);
  addBox(s, {-0.19, 0.445, -0.2}, {0.205, 0.48, 0.2}, seat);
  for (const double z : {-0.19, 0.19})
    addBox(s, {-0.208, 0.44, z - 0.0175}, {-0.172, 0.9, z + 0.0175}, wood);
  addBox(s, {-0.2, 0.72, -0.175}, {-0.18, 0.88, 0.175}, seat);
  addBox(s, {-0.2, 0.56, -0.175}, {-0.18, 0.61, 0.175}, wood);
  return s;
}

PaintedMesh makeStoolShape() {
  PaintedMesh s;
  addCylinder(s, {0, 0, 0}, 0.2, 0.02, 16, Paint::blackMetal);
  addCylinder(s, {0, 0.018, 0}, 0.025, 0.69, 8, Paint::chrome);
  addTorus(s, {0, 0.28, 0}, 0.15, 0.01, 16, 8, Paint::chrome);
  addTurned(s, {0, 0.7, 0}, {{0.17, 0}, {0.185, 0.02}, {0.185, 0.05}, {0.16, 0.07}}, 16,
            Paint::leather);
  return s;
}

PaintedMesh makeArmchairShape(Paint cloth) {
  return makeSofaShape(cloth, 0.85);
}

PaintedMesh makeSofaShape(Paint cloth, double width) {
  PaintedMesh s;
  const double h = width / 2;
  addLegs(s, 0.34, h - 0.08, 0.11, 0.025, Paint::mahogany);
  addBox(s, {-0.42, 0.1, -h}, {0.4, 0.3, h}, cloth);
  addBox(s, {-0.42, 0.295, -h}, {-0.2, 0.84, h}, cloth);
  for (const double side : {-1.0, 1.0}) {
    const double inner = side * (h - 0.16), outer = side * (h + 0.004);
    addBox(s, {-0.41, 0.29, std::min(inner, outer)}, {0.41, 0.6, std::max(inner, outer)}, cloth);
  }
  const int cushions = width > 1.2 ? (width > 1.9 ? 3 : 2) : 1;
  const double each = (width - 0.34) / cushions;
  for (int i = 0; i < cushions; ++i) {
    const double z = -h + 0.17 + each * i;
    addBox(s, {-0.205, 0.295, z + 0.006}, {0.42, 0.44, z + each - 0.006}, cloth);
    addBox(s, {-0.21, 0.435, z + 0.02}, {-0.07, 0.8, z + each - 0.02}, cloth);
  }
  return s;
}

PaintedMesh makeTableShape(double depth, double width, Paint wood) {
  PaintedMesh s;
  addBox(s, {-depth / 2, 0.71, -width / 2}, {depth / 2, 0.75, width / 2}, wood);
  addBox(s, {-depth / 2 + 0.06, 0.62, -width / 2 + 0.06},
         {depth / 2 - 0.06, 0.715, width / 2 - 0.06}, wood);
  addLegs(s, depth / 2 - 0.08, width / 2 - 0.08, 0.63, 0.03, wood);
  return s;
}

PaintedMesh makeRoundTableShape(double radius, Paint wood) {
  PaintedMesh s;
  addTurned(s, {0, 0.71, 0}, {{radius - 0.02, 0}, {radius, 0.015}, {radius, 0.035}}, 24, wood);
  addTurned(s, {0, 0, 0},
            {{0.26, 0}, {0.26, 0.03}, {0.06, 0.07}, {0.04, 0.3}, {0.05, 0.6}, {0.14, 0.715}}, 12,
            Paint::darkIron);
  return s;
}

PaintedMesh makeVaseShape(int kind, Paint glaze) {
  static const std::vector<std::vector<Ring>> kOutlines{
      {{0.09, 0}, {0.15, 0.08}, {0.19, 0.2}, {0.16, 0.34}, {0.08, 0.42}, {0.07, 0.48}, {0.1, 0.52}},
      {{0.12, 0}, {0.16, 0.12}, {0.13, 0.3}, {0.06, 0.42}, {0.05, 0.58}, {0.08, 0.64}},
      {{0.08, 0}, {0.07, 0.04}, {0.16, 0.14}, {0.2, 0.26}, {0.2, 0.3}, {0.18, 0.31}},
      {{0.1, 0}, {0.11, 0.2}, {0.17, 0.34}, {0.17, 0.42}, {0.06, 0.5}, {0.09, 0.54}}};
  PaintedMesh s;
  addTurned(s, Vec3::Zero(), kOutlines[static_cast<std::size_t>(kind) % kOutlines.size()], 24,
            glaze);
  return s;
}

namespace {

/// A column of slabs, each rotated a little further than the one below.
void addTwistedColumn(PaintedMesh& s, Paint stone) {
  constexpr int kSlabs = 16;
  Eigen::Affine3d turn = Eigen::Affine3d::Identity();
  for (int i = 0; i < kSlabs; ++i) {
    PaintedMesh slab;
    const double half = 0.17 - 0.005 * i, y = 0.07 * i;
    addBox(slab, {-half, y - 0.002, -half * 0.6}, {half, y + 0.07, half * 0.6}, stone);
    append(s, slab, turn);
    turn = makeHalfTangentTurn(0.1) * turn;
  }
}

void addBust(PaintedMesh& s, Paint stone) {
  addTurned(s, Vec3::Zero(),
            {{0.11, 0},
             {0.11, 0.05},
             {0.07, 0.08},
             {0.09, 0.13},
             {0.2, 0.2},
             {0.22, 0.3},
             {0.17, 0.38},
             {0.065, 0.42},
             {0.06, 0.5}},
            24, stone);
  addBall(s, {0.01, 0.6, 0}, {0.115, 0.15, 0.095}, 16, stone);
  addBall(s, {0.12, 0.59, 0}, {0.03, 0.035, 0.018}, 8, stone);
  addBall(s, {-0.02, 0.66, 0}, {0.12, 0.11, 0.105}, 12, stone);
}

void addFigure(PaintedMesh& s, Paint stone) {
  addTurned(s, Vec3::Zero(),
            {{0.22, 0},
             {0.22, 0.04},
             {0.19, 0.06},
             {0.15, 0.5},
             {0.16, 0.75},
             {0.12, 0.95},
             {0.15, 1.15},
             {0.17, 1.28},
             {0.07, 1.36},
             {0.05, 1.45}},
            24, stone);
  addBall(s, {0, 1.54, 0}, {0.085, 0.115, 0.08}, 16, stone);
  addRod(s, {0.02, 1.27, 0.15}, {0.16, 1.0, 0.2}, 0.042, 12, stone);
  addRod(s, {0.16, 1.0, 0.2}, {0.3, 1.16, 0.06}, 0.036, 12, stone);
  addRod(s, {0, 1.27, -0.15}, {-0.04, 1.62, -0.26}, 0.042, 12, stone);
  addRod(s, {-0.04, 1.62, -0.26}, {0.08, 1.86, -0.14}, 0.036, 12, stone);
}

void addRings(PaintedMesh& s, Paint stone) {
  PaintedMesh ring;
  addTorus(ring, Vec3::Zero(), 0.26, 0.045, 24, 12, stone);
  Eigen::Affine3d upright = Eigen::Affine3d::Identity();
  upright.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  upright.translation() = Vec3{0, 0.36, 0};
  addCylinder(s, Vec3::Zero(), 0.05, 0.12, 12, stone);
  append(s, ring, upright);
  append(s, ring, makeHalfTangentTurn(0.57735) * upright);
  append(s, ring, makeHalfTangentTurn(-0.57735) * upright);
  addBall(s, {0, 0.36, 0}, {0.09, 0.09, 0.09}, 12, stone);
}

}  // namespace

PaintedMesh makeSculptureShape(int kind, Paint stone) {
  PaintedMesh s;
  switch (kind % 5) {
    case 0:
      addBust(s, stone);
      break;
    case 1:
      addTwistedColumn(s, stone);
      break;
    case 2:
      addRings(s, stone);
      break;
    case 3:
      addBall(s, {0, 0.21, 0}, {0.24, 0.21, 0.2}, 16, stone);
      addBall(s, {0.03, 0.52, 0}, {0.17, 0.15, 0.15}, 16, stone);
      addBall(s, {-0.02, 0.73, 0.02}, {0.1, 0.1, 0.1}, 16, stone);
      break;
    default:
      addFigure(s, stone);
  }
  return s;
}

PaintedMesh makePottedPlantShape(Random& random) {
  PaintedMesh s;
  addTurned(s, Vec3::Zero(), {{0.15, 0}, {0.2, 0.34}, {0.22, 0.35}, {0.22, 0.4}}, 16, Paint::clay);
  addCylinder(s, {0, 0.4, 0}, 0.19, 0.006, 16, Paint::soil);
  constexpr Paint kLeaves[] = {Paint::leaf, Paint::leafDark, Paint::leafLight};
  const std::vector<Vec2> circle = makeUnitCircle(12);
  for (int i = 0; i < 16; ++i) {
    const Vec2 out = circle[static_cast<std::size_t>(i * 5 % 12)];
    const double reach = random.between(0.22, 0.5), top = random.between(0.8, 1.5);
    const Vec3 root{0.03 * out.x(), 0.4, 0.03 * out.y()};
    const Vec3 bend{reach * 0.55 * out.x(), top * 0.85, reach * 0.55 * out.y()};
    const Vec3 tip{reach * out.x(), top * 0.8 + 0.12, reach * out.y()};
    const Vec3 across{-0.06 * out.y(), 0, 0.06 * out.x()};
    const Vec3 down{0, -0.012, 0};
    const Paint leaf = kLeaves[random.below(3)];
    // Two closed blades. They overlap at the bend: if they only met, the face there would exist
    // twice.
    const Vec3 lap = 0.002 * (bend - root).normalized();
    for (const Vec3& end : {root, tip}) {
      const double side = end == root ? -1 : 1;
      const Vec3 middle = bend - side * lap;
      const Vec3 p = middle + side * across, q = middle - side * across, c = middle + down;
      addTriangle(s, end, q, p, leaf);
      addTriangle(s, end, p, c, leaf);
      addTriangle(s, end, c, q, leaf);
      addTriangle(s, p, q, c, leaf);
    }
  }
  return s;
}

PaintedMesh makeGlobeShape() {
  PaintedMesh s;
  addTurned(s, Vec3::Zero(), {{0.22, 0}, {0.22, 0.03}, {0.05, 0.06}, {0.035, 0.5}, {0.07, 0.55}},
            16, Paint::mahogany);
  addBall(s, {0, 0.82, 0}, {0.26, 0.26, 0.26}, 24, Paint::paintBlue);
  addBall(s, {0.06, 0.88, 0.06}, {0.21, 0.16, 0.2}, 12, Paint::paintGreen);
  addTorus(s, {0, 0.82, 0}, 0.31, 0.02, 24, 8, Paint::brass);
  return s;
}

PaintedMesh makeFloorLampShape() {
  PaintedMesh s;
  addCylinder(s, Vec3::Zero(), 0.15, 0.025, 16, Paint::brass);
  addCylinder(s, {0, 0.02, 0}, 0.012, 1.4, 8, Paint::brass);
  addTurned(s, {0, 1.35, 0}, {{0.22, 0}, {0.15, 0.3}}, 16, Paint::lampShade);
  return s;
}

PaintedMesh makeTableLampShape() {
  PaintedMesh s;
  addTurned(s, Vec3::Zero(), {{0.08, 0}, {0.08, 0.015}, {0.02, 0.04}, {0.015, 0.26}}, 12,
            Paint::brass);
  addTurned(s, {0, 0.25, 0}, {{0.15, 0}, {0.09, 0.14}}, 16, Paint::leatherGreen);
  addCylinder(s, {0, 0.238, 0}, 0.13, 0.014, 16, Paint::lampGlow);
  return s;
}

PaintedMesh makePendantShape(double cord, Paint shade) {
  PaintedMesh s;
  addCylinder(s, {0, -0.03, 0}, 0.06, 0.03, 12, Paint::brass);
  addCylinder(s, {0, -cord, 0}, 0.006, cord, 8, Paint::blackMetal);
  addTurned(s, {0, -cord - 0.3, 0}, {{0.26, 0}, {0.25, 0.06}, {0.16, 0.22}, {0.05, 0.31}}, 24,
            shade);
  addBall(s, {0, -cord - 0.3, 0}, {0.13, 0.06, 0.13}, 12, Paint::lampGlow);
  return s;
}

PaintedMesh makeSpotShape() {
  PaintedMesh s;
  addCylinder(s, {0, -0.09, 0}, 0.012, 0.09, 8, Paint::blackMetal);
  PaintedMesh head;
  addTurned(head, {0, -0.17, 0}, {{0.05, 0}, {0.05, 0.13}, {0.03, 0.16}}, 12, Paint::blackMetal);
  addCylinder(head, {0, -0.174, 0}, 0.042, 0.012, 12, Paint::spotGlow);
  Eigen::Affine3d tilt = Eigen::Affine3d::Identity();
  tilt.linear() << 0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1;
  tilt.translation() = Vec3{0, -0.06, 0};
  append(s, head, tilt);
  return s;
}

PaintedMesh makeRadiatorShape(double width) {
  PaintedMesh s;
  const int ribs = static_cast<int>(width / 0.09);
  for (int i = 0; i < ribs; ++i) {
    const double z = -width / 2 + 0.09 * i;
    addBox(s, {0.02, 0.1, z}, {0.11, 0.62, z + 0.06}, Paint::paintedWood);
  }
  addBox(s, {0.04, 0.14, -width / 2}, {0.09, 0.18, width / 2 - 0.035}, Paint::paintedWood);
  addBox(s, {0.04, 0.54, -width / 2}, {0.09, 0.58, width / 2 - 0.035}, Paint::paintedWood);
  return s;
}

PaintedMesh makeStanchionShape() {
  PaintedMesh s;
  addTurned(s, Vec3::Zero(),
            {{0.15, 0},
             {0.15, 0.015},
             {0.03, 0.04},
             {0.02, 0.08},
             {0.02, 0.92},
             {0.035, 0.94},
             {0.035, 0.97},
             {0, 1.0}},
            16, Paint::brass);
  return s;
}

PaintedMesh makeRugShape(double sizeX, double sizeZ, Paint ground, Paint border) {
  const double x = sizeX / 2, z = sizeZ / 2;
  PaintedMesh s;
  addBox(s, {-x, -0.002, -z}, {x, 0.006, z}, border);
  addBox(s, {-x + 0.15, 0, -z + 0.15}, {x - 0.15, 0.008, z - 0.15}, ground);
  addBox(s, {-x + 0.3, 0, -z + 0.3}, {x - 0.3, 0.0095, z - 0.3}, border);
  addBox(s, {-x + 0.34, 0, -z + 0.34}, {x - 0.34, 0.011, z - 0.34}, ground);
  return s;
}

}  // namespace enfilade::assets
