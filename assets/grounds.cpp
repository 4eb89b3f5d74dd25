// The outside of the building: roofs, plinths, steps, paving, trees and hedges.
#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

using namespace plan;

void addRoofs(Sketch& sketch) {
  const double y = kEaves - 0.01, ridge = 11.0, over = 0.55;
  const double x0 = -kOuter - over, x1 = computeRoomEast(5), z0 = kNorth - kOuter - over,
               z1 = kSouth + kOuter + over, zm = 0.5 * (z0 + z1);
  PaintedMesh roof;
  const Vec3 a{x0, y, z0}, b{x0, y, z1}, c{x1, y, z1}, d{x1, y, z0};
  const Vec3 p{x0 + 5.5, ridge, zm}, q{x1, ridge, zm};
  addQuad(roof, b, c, q, p, Paint::slateRoof);
  addQuad(roof, d, a, p, q, Paint::slateRoof);
  addTriangle(roof, a, b, p, Paint::slateRoof);
  addTriangle(roof, c, d, q, Paint::slateRoof);
  addQuad(roof, a, d, c, b, Paint::facadeTrim);
  sketch.place("building/roof/wings", roof, makeTranslation(Vec3::Zero()));
  const auto addEaves = [&](const char* name, const Vec3& low, const Vec3& high) {
    sketch.placeBox(std::string("building/roof/") + name, low, high, Paint::facadeTrim);
  };
  addEaves("eaves_south", {x0 + 0.1, y - 0.25, kSouth + kOuter - 0.003}, {x1, y + 0.05, z1 - 0.08});
  addEaves("eaves_north", {x0 + 0.1, y - 0.25, z0 + 0.08}, {x1, y + 0.05, kNorth - kOuter + 0.003});
  addEaves("eaves_west", {x0 + 0.1, y - 0.25, kNorth - kOuter + 0.003},
           {-kOuter + 0.003, y + 0.05, kSouth + kOuter - 0.003});
  const double top = kHallCeiling + 0.3, h = kHallHalf + kOuter;
  const double hw = kHallWest - kOuter, he = kHallEast + kOuter, proud = 0.3;
  addEaves("hall_cornice_south", {hw - proud, top - 0.4, h - 0.003},
           {he + proud, top + 0.35, h + proud});
  addEaves("hall_cornice_north", {hw - proud, top - 0.4, -h - proud},
           {he + proud, top + 0.35, -h + 0.003});
  addEaves("hall_cornice_east", {he - 0.003, top - 0.4, -h + 0.003},
           {he + proud, top + 0.35, h - 0.003});
  addEaves("hall_cornice_west", {hw - proud, top - 0.4, -h + 0.003},
           {hw + 0.003, top + 0.35, h - 0.003});
  const double west = kVoidWest + 1.36, east = kVoidEast - 1.36, half = kVoidHalf - 1.36;
  const auto addCopper = [&](const char* name, const Vec3& low, const Vec3& high) {
    sketch.placeBox(std::string("building/roof/hall_") + name, low, high, Paint::copperRoof);
  };
  addCopper("north", {hw, top - 0.003, -h}, {he, top + 0.05, -half});
  addCopper("south", {hw, top - 0.003, half}, {he, top + 0.05, h});
  addCopper("west", {hw, top - 0.003, -half}, {west, top + 0.05, half});
  addCopper("east", {east, top - 0.003, -half}, {he, top + 0.05, half});
}

/// A course of stone along an outer face.
void addCourse(Sketch& sketch, const std::string& path, double y0, double y1, double proud,
               Paint paint, bool openAtEntrance) {
  const double in = 0.003, w = -kOuter, n = kNorth - kOuter, s = kSouth + kOuter;
  const double hw = kHallWest - kOuter, he = kHallEast + kOuter, h = kHallHalf + kOuter;
  int number = 0;
  const auto lay = [&](double x0, double x1, double z0, double z1) {
    sketch.placeBox(appendNumber(path, ++number), {x0, y0, z0}, {x1, y1, z1}, paint);
  };
  lay(w - proud, hw + in, s - in, s + proud);
  lay(w - proud, hw + in, n - proud, n + in);
  if (openAtEntrance) {
    lay(w - proud, w + in, n + in, -1.0);
    lay(w - proud, w + in, 1.0, s - in);
  } else {
    lay(w - proud, w + in, n + in, s - in);
  }
  lay(hw - proud, he + proud, h - in, h + proud);
  lay(hw - proud, he + proud, -h - proud + 0.002, -h + in);
  lay(he - in, he + proud, -h + in, h - in);
  lay(hw - proud, hw + in, s + proud, h - in);
}

void addEntrance(Sketch& sketch) {
  const std::string path = "building/entrance_steps/";
  sketch.placeBox(path + "step1", {-2.4, kGround - 0.1, -2.0}, {-1.98, kGround + 0.15, 2.0},
                  Paint::plinthStone);
  sketch.placeBox(path + "step2", {-2.0, kGround - 0.1, -1.9}, {-1.58, kGround + 0.30, 1.9},
                  Paint::plinthStone);
  sketch.placeBox(path + "landing", {-1.6, kGround - 0.1, -1.8}, {-kOuter + 0.003, 0, 1.8},
                  Paint::plinthStone);
  for (const double z : {-1.5, 1.5}) {
    PaintedMesh pillar;
    addTurned(pillar, Vec3::Zero(),
              {{0.2, 0}, {0.2, 0.12}, {0.15, 0.16}, {0.13, 2.85}, {0.2, 2.95}, {0.2, 3.05}}, 16,
              Paint::facadeTrim);
    sketch.place(z < 0 ? "building/porch/pillar_north" : "building/porch/pillar_south", pillar,
                 makeTranslation({-1.3, 0, z}));
  }
  sketch.placeBox("building/porch/roof", {-1.65, 3.045, -1.9}, {-kOuter + 0.003, 3.3, 1.9},
                  Paint::facadeTrim);
  sketch.placeBox("building/porch/roof_cap", {-1.75, 3.298, -2.0}, {-kOuter + 0.003, 3.36, 2.0},
                  Paint::copperRoof);
}

void addPaths(Sketch& sketch, Random& random) {
  sketch.placeBox("grounds/lawn", {-40, kGround - 0.5, -45}, {100, kGround, 40}, Paint::lawn);
  sketch.placeBox("grounds/forecourt", {-16, kGround - 0.1, -9}, {-0.5, kGround + 0.01, 9},
                  Paint::gravel);
  int number = 0;
  for (int i = 0; i < 16; ++i)
    for (int k = -2; k < 2; ++k) {
      const double x = -15.9 + 0.84 * i, z = 0.8 * k + 0.005;
      sketch.placeBox(appendNumber("grounds/path/flag", ++number), {x, kGround - 0.05, z},
                      {x + 0.82, kGround + 0.02, z + 0.79},
                      random.below(3) ? Paint::paving : Paint::pavingDark);
    }
}

void addHedges(Sketch& sketch, Random& random) {
  int number = 0;
  for (const double z : {-2.6, 2.6})
    for (int i = 0; i < 7; ++i) {
      const double x = -15 + 1.75 * i, top = kGround + random.between(0.62, 0.7);
      ++number;
      sketch.placeBox(appendNumber("grounds/hedge", number), {x, kGround - 0.05, z - 0.3},
                      {x + 1.5, top, z + 0.3}, number % 2 ? Paint::leafDark : Paint::leaf);
    }
  for (int i = 0; i < 12; ++i) {
    const double x = 2.5 + 3.3 * i;
    PaintedMesh bush;
    const double r = random.between(0.4, 0.55);
    addBall(bush, {0, r * 0.8, 0}, {r, r, r}, 12, i % 3 ? Paint::leafDark : Paint::leafLight);
    sketch.place(appendNumber("grounds/bush", i + 1), bush, makeTranslation({x, kGround, 4.6}));
  }
}

}  // namespace

void addTree(Sketch& sketch, const std::string& path, const Vec3& foot, Random& random) {
  PaintedMesh trunk, crown;
  const double height = random.between(2.2, 3.2), spread = random.between(1.3, 2.0);
  addTurned(trunk, Vec3::Zero(), {{0.28, -0.1}, {0.17, 0.3}, {0.13, height}, {0.05, height + 1.2}},
            12, Paint::bark);
  constexpr Paint kLeaves[] = {Paint::leaf, Paint::leafDark, Paint::leafLight};
  for (int i = 0; i < 6; ++i) {
    const double x = random.between(-0.6, 0.6) * spread, z = random.between(-0.6, 0.6) * spread;
    const double y = height + random.between(0.3, 1.9), r = spread * random.between(0.55, 0.85);
    addBall(crown, {x, y, z}, {r, r * 0.8, r}, 12, kLeaves[random.below(3)]);
  }
  sketch.place(path + "/trunk", trunk, makeTranslation(foot));
  sketch.place(path + "/crown", crown, makeTranslation(foot));
}

void addGrounds(Sketch& sketch, Random& random) {
  addRoofs(sketch);
  addCourse(sketch, "building/facade/plinth", kGround - 0.05, 0.3, 0.06, Paint::plinthStone, true);
  addCourse(sketch, "building/facade/string_course", 4.0, 4.22, 0.05, Paint::facadeTrim, false);
  addEntrance(sketch);
  addPaths(sketch, random);
  addHedges(sketch, random);
  int number = 0;
  for (const Vec3& foot : {Vec3{-8, 0, -7}, Vec3{-8, 0, 7}, Vec3{-14, 0, -6.5}, Vec3{-14, 0, 6.5},
                           Vec3{6, 0, 10}, Vec3{15, 0, 11}, Vec3{24, 0, 10}, Vec3{33, 0, 11},
                           Vec3{46, 0, 14}, Vec3{56, 0, 13}, Vec3{67, 0, 4}, Vec3{68, 0, -6},
                           Vec3{50, 0, -15}, Vec3{36, 0, -15}, Vec3{20, 0, -16}, Vec3{5, 0, -15}})
    addTree(sketch, appendNumber("grounds/tree", ++number), foot + Vec3{0, kGround, 0}, random);
}

}  // namespace enfilade::assets
