#include "assets/house.hpp"

#include "assets/furniture.hpp"
#include "assets/walls.hpp"

namespace enfilade::assets {
namespace {

using Axis = Wall::Axis;

constexpr double kStorey = 3.2, kFloorThick = 0.25, kWallThick = 0.35;
constexpr int kHouseRisers = 19;
constexpr double kTread = 0.28, kStairWidth = 1.0;

struct Plan {
  double halfX, halfZ;
  int storeys;
  Paint facade, roof, inside;
};

std::string makeFloorPath(int storey) {
  return "floor" + std::to_string(storey);
}

std::vector<Opening> makeWindowRow(double half, double floor, int count) {
  std::vector<Opening> windows;
  for (int i = 0; i < count; ++i) {
    const double at = -half + 2 * half * (i + 0.5) / count;
    windows.push_back({at - 0.5, at + 0.5, floor + 0.85, floor + 2.35});
  }
  return windows;
}

void addFacades(Sketch& sketch, const Plan& p, int storey) {
  const double y = kStorey * storey, t = kWallThick;
  const std::string path = makeFloorPath(storey);
  for (const bool front : {true, false}) {
    const Wall wall{Axis::x,
                    -p.halfX - t,
                    p.halfX + t,
                    front ? p.halfZ : -p.halfZ - t,
                    front ? p.halfZ + t : -p.halfZ,
                    y,
                    y + kStorey,
                    front ? p.inside : p.facade,
                    front ? p.facade : p.inside};
    std::vector<Opening> holes = makeWindowRow(p.halfX, y, 3);
    const bool hasDoor = front && storey == 0;
    if (hasDoor) holes[1] = {-0.55, 0.55, y + 0.01, y + 2.2};
    const std::string name = path + (front ? "/front" : "/back");
    addWall(sketch, name, wall, holes);
    for (std::size_t i = 0; i < holes.size(); ++i)
      if (!hasDoor || i != 1)
        addWindow(sketch, appendNumber(name + "/window", static_cast<int>(i + 1)), wall, holes[i],
                  {2, 2, Paint::glass, front ? -1.0 : 1.0});
    if (!hasDoor) continue;
    addDoorFrame(sketch, name + "/door", wall, holes[1], Paint::paintedWood);
    addLeaf(sketch, name + "/door/leaf", {{-0.5, y + 0.01, p.halfZ - 0.06}, 1, 1.0, 2.15, -1});
  }
  for (const double side : {-1.0, 1.0}) {
    const bool east = side > 0;
    addWall(
        sketch, path + (east ? "/east" : "/west"),
        {Axis::z, -p.halfZ, p.halfZ, east ? p.halfX : -p.halfX - t, east ? p.halfX + t : -p.halfX,
         y, y + kStorey, east ? p.inside : p.facade, east ? p.facade : p.inside},
        {});
  }
}

double computeStairEast(const Plan& p) {
  return -p.halfX + 0.4 + kTread * kHouseRisers;
}

/// Adds the slab of a storey; upper slabs are open over the stair along the back.
void addSlab(Sketch& sketch, const Plan& p, int storey) {
  const double y1 = kStorey * storey + (storey == 0 ? 0.01 : 0.0), y0 = y1 - kFloorThick;
  const std::string path = makeFloorPath(storey) + "/slab";
  if (storey == 0 || storey == p.storeys) {
    sketch.placeBox(path, {-p.halfX, y0, -p.halfZ}, {p.halfX, y1, p.halfZ}, Paint::oak);
    return;
  }
  const double z = -p.halfZ + kStairWidth + 0.1;
  const BoxPaints paints{Paint::oak, Paint::oak, Paint::ceiling,
                         Paint::oak, Paint::oak, Paint::oak};
  sketch.placeBox(path + "_front", {-p.halfX, y0, z}, {p.halfX, y1, p.halfZ}, paints);
  sketch.placeBox(path + "_back", {computeStairEast(p), y0, -p.halfZ}, {p.halfX, y1, z}, paints);
}

void addStairs(Sketch& sketch, const Plan& p, int storey) {
  const double riser = kStorey / kHouseRisers;
  for (int k = 1; k < kHouseRisers; ++k) {
    const double x = computeStairEast(p) - kTread * (kHouseRisers - k),
                 y = kStorey * storey + riser * k;
    sketch.placeBox(appendNumber(makeFloorPath(storey) + "/stair/step", k),
                    {x, y - riser - 0.03, -p.halfZ + 0.01},
                    {x + kTread + 0.01, y, -p.halfZ + kStairWidth}, Paint::oakDark);
  }
}

void furnish(Sketch& sketch, const Plan& p, int storey, Random& random) {
  const double y = kStorey * storey + (storey == 0 ? 0.01 : 0.0);
  const std::string path = makeFloorPath(storey) + "/";
  const double east = p.halfX, west = -p.halfX, front = p.halfZ;
  constexpr Paint kCloths[] = {Paint::fabricRed, Paint::fabricBlue, Paint::fabricGrey,
                               Paint::leather};
  sketch.place(path + "sofa", makeSofaShape(kCloths[random.below(4)], 1.8),
               makeQuarterTurn(2, {east - 0.5, y, 0.5}));
  sketch.place(path + "rug", makeRugShape(2.2, 1.6, Paint::rugBlue, Paint::rugGold),
               makeTranslation({east - 2.0, y, 0.5}));
  sketch.place(path + "table", makeTableShape(0.9, 1.5, Paint::oakDark),
               makeQuarterTurn(1, {west + 1.8, y, 0.8}));
  int chair = 0;
  for (const double dx : {-0.4, 0.4})
    for (const int side : {1, 3})
      sketch.place(path + "chair" + std::to_string(++chair),
                   makeChairShape(Paint::birch, Paint::fabricCream),
                   makeQuarterTurn(side, {west + 1.8 + dx, y, 0.8 + (side == 1 ? 0.75 : -0.75)}));
  placeBookcase(sketch, path + "bookcase", {{west, y, front - 1.2}, 0}, 1.0, 2.0, random);
  placePicture(sketch, path + "picture1", {{east, y + 1.6, -1.2}, 2}, 1.0, 0.8, random);
  placePicture(sketch, path + "picture2", {{west, y + 1.6, -0.4}, 0}, 0.8, 1.0, random);
  sketch.place(path + "lamp", makePendantShape(0.7, Paint::lampShade),
               makeTranslation({west + 1.8, y + kStorey - kFloorThick, 0.8}));
  sketch.place(path + "plant", makePottedPlantShape(random),
               makeTranslation({east - 0.5, y, front - 0.6}));
}

void addRoof(Sketch& sketch, const Plan& p) {
  const double x = p.halfX + kWallThick, z = p.halfZ + kWallThick + 0.4, y = kStorey * p.storeys;
  PaintedMesh roof;
  addPrism(roof, {{-z, -0.01}, {z, -0.01}, {0, z * 0.6}},
           {{-x, y, 0}, {0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, 2 * x, p.roof);
  sketch.place("roof", roof, makeTranslation(Vec3::Zero()));
  sketch.placeBox("chimney", {p.halfX - 1.2, y + 0.5, -1.4},
                  {p.halfX - 0.6, y + z * 0.6 + 0.7, -0.8}, Paint::brickDark);
}

}  // namespace

void addHouse(Sketch& sketch, Random& random) {
  constexpr Paint kFacades[] = {Paint::brick,       Paint::stucco,    Paint::stuccoPink,
                                Paint::stuccoGreen, Paint::brickDark, Paint::facade};
  constexpr Paint kInside[] = {Paint::wallWhite, Paint::wallSand, Paint::wallMist,
                               Paint::wallIvory};
  Plan p{};
  p.halfX = 0.5 * (kHouseWidth - 2 * kWallThick) - 0.5 * random.below(3);
  p.halfZ = 4.0 + 0.5 * random.below(4);
  p.storeys = 2 + random.below(3);
  p.facade = kFacades[random.below(6)];
  p.roof = random.below(2) ? Paint::roofTile : Paint::slateRoof;
  p.inside = kInside[random.below(4)];
  for (int storey = 0; storey < p.storeys; ++storey) {
    addFacades(sketch, p, storey);
    addSlab(sketch, p, storey);
    furnish(sketch, p, storey, random);
    if (storey + 1 < p.storeys) addStairs(sketch, p, storey);
  }
  addSlab(sketch, p, p.storeys);
  addRoof(sketch, p);
  sketch.placeBox("doorstep", {-0.9, -0.1, p.halfZ + kWallThick - 0.003},
                  {0.9, 0.008, p.halfZ + kWallThick + 0.9}, Paint::plinthStone);
}

}  // namespace enfilade::assets
