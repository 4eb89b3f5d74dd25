// The hall: two storeys high, with a gallery around it on columns and a skylight above.

#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

using namespace plan;
using Axis = Wall::Axis;

const std::vector<Paint> kStone{Paint::limestone, Paint::limestoneDark};
constexpr double kTop = kHallCeiling + 0.3;

std::vector<Opening> makeTiers(const std::vector<double>& at) {
  std::vector<Opening> windows;
  for (const double a : at) {
    windows.push_back({a - 0.75, a + 0.75, 0.6, 3.3});
    windows.push_back({a - 0.75, a + 0.75, kUpper + 0.9, kUpper + 3.6});
  }
  return windows;
}

void addGlazedWall(Sketch& sketch, const std::string& name, const Wall& wall,
                   const std::vector<Opening>& windows, double inward) {
  const std::string path = "building/hall/" + name;
  addWall(sketch, path, wall, windows);
  int number = 0;
  for (const Opening& o : windows)
    addWindow(sketch, appendNumber(path + "/window", ++number), wall, o,
              {3, 4, Paint::glass, inward});
}

std::vector<Opening> makeWestDoors() {
  std::vector<Opening> doors;
  for (const double floor : {0.0, kUpper})
    for (const double z : {0.0, -5.7})
      doors.push_back({z - kDoorHalf, z + kDoorHalf, floor, floor + kDoorHeight});
  return doors;
}

void addWalls(Sketch& sketch) {
  const double h = kHallHalf, o = kOuter;
  const std::vector<double> across{kHallWest + 3, kHallWest + 7, kHallWest + 11, kHallWest + 15};
  addGlazedWall(sketch, "south_wall",
                {Axis::x, kHallWest - o, kHallEast + o, h, h + o, -0.06, kTop, Paint::wallIvory,
                 Paint::facade},
                makeTiers(across), -1);
  addGlazedWall(sketch, "north_wall",
                {Axis::x, kHallWest - o, kHallEast + o, -h - o, -h, -0.06, kTop, Paint::facade,
                 Paint::wallIvory},
                makeTiers(across), 1);
  addGlazedWall(
      sketch, "east_wall",
      {Axis::z, -h, h, kHallEast, kHallEast + o, -0.06, kTop, Paint::wallIvory, Paint::facade},
      makeTiers({-5.6, 5.6}), -1);
  // West: the far side of the wall has the paint of the wings' last rooms.
  const Wall west{Axis::z, -h,   kSouth + kOuter, kHallWest - o,   kHallWest,
                  -0.06,   kTop, Paint::wallTeal, Paint::wallIvory};
  const std::vector<Opening> doors = makeWestDoors();
  addWall(sketch, "building/hall/west_wall", west, doors);
  addGlazedWall(sketch, "west_wall_free",
                {Axis::z, kSouth + kOuter, h, kHallWest - o, kHallWest, -0.06, kTop, Paint::facade,
                 Paint::wallIvory},
                makeTiers({5.9}), 1);
  int number = 0;
  for (const Opening& d : doors) {
    const std::string path = appendNumber("building/hall/doors/door", ++number);
    addDoorFrame(sketch, path, west, d, Paint::paintedWood);
    addThreshold(sketch, path + "/threshold", west, d, Paint::marbleGrey);
  }
}

void addFloors(Sketch& sketch, Random& random) {
  const double h = kHallHalf;
  sketch.placeBox("building/hall/slab", {kHallWest, kGround, -h - kOuter},
                  {kHallEast + kOuter, -0.06, h + kOuter}, Paint::concrete);
  addFloor(sketch, "building/hall/floor", {kHallWest, -0.06, -h}, {kHallEast, 0, h},
           FloorPattern::squares, 0.9, {Paint::marbleWhite, Paint::marbleGrey}, random);
  const auto addDeck = [&](const std::string& name, double x0, double x1, double z0, double z1) {
    const std::string path = "building/hall/gallery/" + name;
    sketch.placeBox(path + "_slab", {x0, kUpper - kSlab, z0}, {x1, kUpper - 0.06, z1},
                    Paint::ceiling);
    addFloor(sketch, path + "_floor", {x0, kUpper - 0.06, z0}, {x1, kUpper, z1},
             FloorPattern::squares, 0.55, kStone, random);
  };
  addDeck("north", kHallWest, kHallEast, -h, -kVoidHalf);
  addDeck("south", kHallWest, kHallEast, kVoidHalf, h);
  addDeck("west", kHallWest, kVoidWest, -kVoidHalf, kVoidHalf);
  addDeck("east", kVoidEast, kHallEast, -kVoidHalf, kVoidHalf);
}

/// Adds a moulding along the edge of the void, in front of the slab.
void addEdgeBands(Sketch& sketch) {
  const double y = kUpper - kSlab - 0.02;
  const auto addEdgeBand = [&](const char* name, const Face& face) {
    addRail(sketch, std::string("building/hall/gallery/edge_") + name, face, y, kSlab + 0.015, 0.05,
            Paint::paintedWood);
  };
  addEdgeBand("north", {Axis::x, kVoidWest, kVoidEast, -kVoidHalf, 1});
  addEdgeBand("south", {Axis::x, kVoidWest, kVoidEast, kVoidHalf, -1});
  addEdgeBand("west", {Axis::z, -kVoidHalf, kVoidHalf, kVoidWest, 1});
  // The head of the stair is between the two halves of the east band.
  addEdgeBand("east_a", {Axis::z, -kVoidHalf, kStairLow, kVoidEast, -1});
  addEdgeBand("east_b", {Axis::z, kStairHigh, kVoidHalf, kVoidEast, -1});
}

PaintedMesh makeColumnShape(double height, double radius) {
  const double r = radius;
  PaintedMesh s;
  addBox(s, {-1.45 * r, 0, -1.45 * r}, {1.45 * r, 0.12, 1.45 * r}, Paint::plinthStone);
  addTurned(s, {0, 0.118, 0},
            {{1.35 * r, 0},
             {1.4 * r, 0.05},
             {1.3 * r, 0.1},
             {1.08 * r, 0.13},
             {r, 0.2},
             {r, height * 0.4},
             {0.86 * r, height - 0.42},
             {1.0 * r, height - 0.4},
             {0.9 * r, height - 0.36},
             {1.25 * r, height - 0.22}},
            24, Paint::facadeTrim);
  addBox(s, {-1.4 * r, height - 0.11, -1.4 * r}, {1.4 * r, height + 0.002, 1.4 * r},
         Paint::facadeTrim);
  return s;
}

void addColumns(Sketch& sketch) {
  const double inset = 0.3;
  const double x0 = kVoidWest - inset, x1 = kVoidEast + inset, z1 = kVoidHalf + inset;
  std::vector<Vec3> feet;
  for (int i = 0; i < 4; ++i)
    for (const double z : {-z1, z1}) feet.push_back({x0 + (x1 - x0) * i / 3, 0, z});
  for (const double x : {x0, x1})
    for (const double z : {-z1 / 3, z1 / 3}) feet.push_back({x, 0, z});
  const PaintedMesh lower = makeColumnShape(kUpper - kSlab, 0.2);
  const PaintedMesh upper = makeColumnShape(kHallCeiling - kUpper, 0.16);
  int number = 0;
  for (const Vec3& foot : feet) {
    sketch.place(appendNumber("building/hall/columns/lower", ++number), lower,
                 makeTranslation(foot));
    sketch.place(appendNumber("building/hall/columns/upper", number), upper,
                 makeTranslation(foot + Vec3{0, kUpper, 0}));
  }
}

/// Adds a glass lantern above the opening in the ceiling.
void addSkylight(Sketch& sketch) {
  const double h = kHallHalf, y0 = kHallCeiling, y1 = kTop;
  const double west = kVoidWest + 1.5, east = kVoidEast - 1.5, half = kVoidHalf - 1.5;
  const std::string path = "building/hall/ceiling/";
  sketch.placeBox(path + "north", {kHallWest, y0, -h}, {kHallEast, y1, -half}, Paint::ceiling);
  sketch.placeBox(path + "south", {kHallWest, y0, half}, {kHallEast, y1, h}, Paint::ceiling);
  sketch.placeBox(path + "west", {kHallWest, y0, -half}, {west, y1, half}, Paint::ceiling);
  sketch.placeBox(path + "east", {east, y0, -half}, {kHallEast, y1, half}, Paint::ceiling);
  const double curb = y1 + 0.5, ridge = curb + 1.6, t = 0.14;
  const std::string lantern = "building/hall/skylight/";
  sketch.placeBox(lantern + "curb_north", {west - t, y0 - 0.06, -half - t}, {east + t, curb, -half},
                  Paint::facadeTrim);
  sketch.placeBox(lantern + "curb_south", {west - t, y0 - 0.06, half}, {east + t, curb, half + t},
                  Paint::facadeTrim);
  sketch.placeBox(lantern + "curb_west", {west - t, y0 - 0.06, -half}, {west, curb, half},
                  Paint::facadeTrim);
  sketch.placeBox(lantern + "curb_east", {east, y0 - 0.06, -half}, {east + t, curb, half},
                  Paint::facadeTrim);
  constexpr int kBays = 8;
  for (int i = 0; i <= kBays; ++i) {
    const double x = west + (east - west) * i / kBays;
    for (const double side : {-1.0, 1.0}) {
      const std::string name = side < 0 ? "rafter_north" : "rafter_south";
      PaintedMesh rafter;
      addSlopedBar(rafter, {0, 0, 0}, {0, ridge - curb, -side * (half + 0.1)}, 0.06, 0.14,
                   Paint::facadeTrim);
      sketch.place(appendNumber(lantern + name, i + 1), rafter,
                   makeTranslation({x, curb + 0.06, side * (half + 0.1)}));
    }
  }
  sketch.placeBox(lantern + "ridge", {west - 0.1, ridge - 0.1, -0.06},
                  {east + 0.1, ridge + 0.14, 0.06}, Paint::facadeTrim);
  for (int i = 0; i < kBays; ++i) {
    const double x = west + (east - west) * (i + 0.5) / kBays;
    for (const double side : {-1.0, 1.0}) {
      PaintedMesh pane;
      addSlopedBar(pane, {0, 0, 0}, {0, ridge - curb, -side * (half + 0.08)},
                   (east - west) / kBays - 0.05, 0.012, Paint::glass);
      sketch.place(appendNumber(lantern + (side < 0 ? "pane_north" : "pane_south"), i + 1), pane,
                   makeTranslation({x, curb + 0.1, side * (half + 0.08)}));
    }
  }
  for (const double x : {west - 0.07, east + 0.07}) {
    PaintedMesh gable;
    addPrism(gable, {{-half, 0}, {half, 0}, {0, ridge - curb}},
             {{-0.006, 0, 0}, {0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, 0.012, Paint::glass);
    sketch.place(lantern + (x < 0.5 * (west + east) ? "gable_west" : "gable_east"), gable,
                 makeTranslation({x, curb, 0}));
  }
}

void addMouldings(Sketch& sketch) {
  const double h = kHallHalf;
  const std::vector<Opening> none;
  const struct {
    const char* name;
    Face face;
    std::vector<Opening> holes;
  } sides[] = {{"north", {Axis::x, kHallWest, kHallEast, -h, 1}, none},
               {"south", {Axis::x, kHallWest, kHallEast, h, -1}, none},
               {"west", {Axis::z, -h, h, kHallWest, 1}, makeWestDoors()},
               {"east", {Axis::z, -h, h, kHallEast, -1}, none}};
  for (const auto& side : sides) {
    const std::string path = "building/hall/";
    addSkirting(sketch, path + "skirting_" + side.name, side.face, 0, side.holes);
    addSkirting(sketch, path + "gallery/skirting_" + side.name, side.face, kUpper, side.holes);
    addCornice(sketch, path + "cornice_lower_" + side.name, side.face, kUpper - kSlab);
    addCornice(sketch, path + "cornice_" + side.name, side.face, kHallCeiling);
  }
}

}  // namespace

void addHall(Sketch& sketch, Random& random) {
  addFloors(sketch, random);
  addWalls(sketch);
  addEdgeBands(sketch);
  addColumns(sketch);
  addSkylight(sketch);
  addMouldings(sketch);
}

}  // namespace enfilade::assets
