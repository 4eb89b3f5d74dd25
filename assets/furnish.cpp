// Furnishes the rooms of the enfilade. The axis (|z| < 0.7 m) stays free.
#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

using namespace plan;

std::string makeRoomPath(int i) {
  return "building/ground/enfilade/room" + std::to_string(i + 1);
}

Paint getCloth(int i) {
  constexpr Paint kCloths[] = {Paint::leather,    Paint::fabricBlue,   Paint::fabricCream,
                               Paint::fabricGrey, Paint::leatherGreen, Paint::fabricRed};
  return kCloths[i % 6];
}

/// Hangs pictures left and right of the doors on the cross walls, and next to the north door.
void hangPictures(Sketch& sketch, int i, Random& random) {
  const double west = computeRoomWest(i), east = computeRoomEast(i);
  const std::string path = makeRoomPath(i) + "/picture";
  int number = 0;
  for (const double z : {-1.95, 1.95}) {
    const double width = random.between(1.0, 1.4), height = random.between(1.2, 1.6);
    placePicture(sketch, appendNumber(path, ++number), {{west, 1.75, z}, 0}, width, height, random);
    const double width2 = random.between(1.0, 1.4), height2 = random.between(0.8, 1.6);
    placePicture(sketch, appendNumber(path, ++number), {{east, 1.75, z}, 2}, width2, height2,
                 random);
  }
  const double north = i == 0 ? 9.0 : 0.5 * (west + east);
  for (const double x : {0.5 * (west + north - 0.6), 0.5 * (north + 0.6 + east)}) {
    const double width = i == 0 && x > 9 ? 0.7 : random.between(1.1, 1.5);
    if (i == 5) continue;  // its north wall has no door: three large pictures follow
    placePicture(sketch, appendNumber(path, ++number), {{x, 1.75, kMidSouth}, 3}, width,
                 random.between(0.9, 1.3), random);
  }
  if (i == 5)
    for (const double x : {west + 1.2, west + 3.0, west + 4.8})
      placePicture(sketch, appendNumber(path, ++number), {{x, 1.8, kMidSouth}, 3}, 1.3, 1.6,
                   random);
}

void hangLamps(Sketch& sketch, int i) {
  const double middle = 0.5 * (computeRoomWest(i) + computeRoomEast(i));
  const std::string path = makeRoomPath(i) + "/";
  for (const double z : {-1.5, 1.5})
    sketch.place(path + (z < 0 ? "pendant_north" : "pendant_south"),
                 makePendantShape(0.75, Paint::brass), makeTranslation({middle, kCeiling, z}));
  int number = 0;
  const PaintedMesh spot = makeSpotShape();
  for (const double z : {-1.95, 1.95}) {
    sketch.place(appendNumber(path + "spot", ++number), spot,
                 makeQuarterTurn(2, {computeRoomWest(i) + 1.0, kCeiling, z}));
    sketch.place(appendNumber(path + "spot", ++number), spot,
                 makeQuarterTurn(0, {computeRoomEast(i) - 1.0, kCeiling, z}));
  }
}

void placeCorners(Sketch& sketch, int i, Random& random) {
  const double west = computeRoomWest(i) + 0.55, east = computeRoomEast(i) - 0.55;
  const std::string path = makeRoomPath(i) + "/";
  constexpr Paint kStones[] = {Paint::plaster, Paint::bronze, Paint::marbleWhite, Paint::stoneDark};
  placePlinth(sketch, path + "sculpture1", {{west, 0, -2.45}, 3}, 0.95,
              makeSculptureShape(i, kStones[i % 4]));
  placePlinth(
      sketch, path + "sculpture2", {{east, 0, 2.4}, 2}, 0.95,
      i % 2 ? makeVaseShape(i, Paint::cobalt) : makeSculptureShape(i + 2, kStones[(i + 1) % 4]));
  sketch.place(path + "plant", makePottedPlantShape(random),
               makeTranslation({west + 0.05, 0, 2.4}));
  for (const double at : {1.5, 4.5})
    sketch.place(path + (at < 3 ? "radiator1" : "radiator2"), makeRadiatorShape(1.1),
                 makeQuarterTurn(1, {computeRoomWest(i) + at, 0, kSouth}));
}

/// Rows of chairs before a grand piano.
void placeMusic(Sketch& sketch, const std::string& path, double middle) {
  PaintedMesh piano;
  addPrism(piano,
           {{-0.75, -0.7},
            {0.75, -0.7},
            {0.75, 0.2},
            {0.5, 0.7},
            {0.1, 0.75},
            {-0.2, 0.5},
            {-0.35, 0.0},
            {-0.75, -0.2}},
           {{0, 0.62, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}}, 0.32, Paint::paintBlack);
  addBox(piano, {-0.98, 0.68, -0.72}, {-0.69, 0.74, 0.72}, Paint::paintBlack);
  addBox(piano, {-0.96, 0.735, -0.62}, {-0.72, 0.75, 0.62}, Paint::paintWhite);
  for (const Vec3& leg : {Vec3{-0.6, 0, -0.62}, Vec3{-0.6, 0, 0.62}, Vec3{0.6, 0, 0.25}})
    addTurned(piano, leg, {{0.04, 0}, {0.03, 0.1}, {0.06, 0.63}}, 12, Paint::paintBlack);
  sketch.place(path + "piano", piano, makeQuarterTurn(0, {middle + 1.5, 0, 1.85}));
  sketch.place(path + "piano_stool", makeStoolShape(),
               makeTranslation({middle + 0.25, 0, 1.85}) * Eigen::Scaling(1.0, 0.65, 1.0));
  for (int row = 0; row < 2; ++row)
    for (int k = 0; k < 3; ++k)
      sketch.place(path + "chair" + std::to_string(3 * row + k + 1),
                   makeChairShape(Paint::gilt, Paint::fabricRed),
                   makeTranslation({middle - 1.8 + 0.8 * row, 0, 1.25 + 0.6 * k}));
}

void placeMiddle(Sketch& sketch, int i, Random& random) {
  const double middle = 0.5 * (computeRoomWest(i) + computeRoomEast(i));
  const std::string path = makeRoomPath(i) + "/";
  const Paint cloth = getCloth(i);
  constexpr Paint kRugs[] = {Paint::rugBlue, Paint::rugRed,  Paint::rugRed,
                             Paint::rugGold, Paint::rugBlue, Paint::rugRed};
  sketch.place(path + "rug", makeRugShape(3.4, 1.7, kRugs[i % 6], Paint::rugGold),
               makeTranslation({middle, 0, 1.75}));
  switch (i) {
    case 0:
    case 5:
      placeBench(sketch, path + "bench1", {{middle, 0, 1.75}, 1}, 1.8, cloth);
      placeBench(sketch, path + "bench2", {{middle, 0, -1.9}, 3}, 1.4, cloth);
      break;
    case 1:
      placeDisplayCase(sketch, path + "case1", {{middle, 0, 1.75}, 1}, 1.6, random);
      placeDisplayCase(sketch, path + "case2", {{middle - 1.6, 0, -1.7}, 1}, 1.0, random);
      placeDisplayCase(sketch, path + "case3", {{middle + 1.6, 0, -1.7}, 1}, 1.0, random);
      break;
    case 2:
      sketch.place(path + "sofa", makeSofaShape(cloth, 2.0), makeQuarterTurn(1, {middle, 0, 2.3}));
      sketch.place(path + "low_table", makeTableShape(0.6, 1.1, Paint::mahogany),
                   makeQuarterTurn(0, {middle, 0, 1.35}) * Eigen::Scaling(1.0, 0.57, 1.0));
      sketch.place(path + "armchair1", makeArmchairShape(Paint::fabricRed),
                   makeQuarterTurn(0, {middle - 1.55, 0, 1.7}));
      sketch.place(path + "armchair2", makeArmchairShape(Paint::fabricRed),
                   makeQuarterTurn(2, {middle + 1.45, 0, 1.5}));
      sketch.place(path + "floor_lamp", makeFloorLampShape(),
                   makeTranslation({middle + 1.3, 0, 2.55}));
      break;
    case 3:
      placePlinth(sketch, path + "figure", {{middle, 0, 1.75}, 1}, 0.5,
                  makeSculptureShape(4, Paint::marbleWhite));
      for (const double x : {-1.0, 1.0})
        for (const double z : {1.1, 2.4})
          sketch.place(appendNumber(path + "stanchion", static_cast<int>(2 + x + (z > 2 ? 1 : 0))),
                       makeStanchionShape(), makeTranslation({middle + x, 0, z}));
      placeBench(sketch, path + "bench1", {{middle - 1.8, 0, -1.8}, 3}, 1.2, cloth);
      break;
    default:
      placeMusic(sketch, path, middle);
  }
}

void furnishVestibule(Sketch& sketch, Random& random) {
  const std::string path = "building/ground/vestibule/";
  sketch.place(path + "runner", makeRugShape(3.0, 1.6, Paint::rugRed, Paint::rugGold),
               makeTranslation({2.6, 0, 0}));
  sketch.place(path + "plant1", makePottedPlantShape(random), makeTranslation({0.5, 0, 2.5}));
  sketch.place(path + "plant2", makePottedPlantShape(random), makeTranslation({4.0, 0, -2.5}));
  placeBench(sketch, path + "bench1", {{2.2, 0, 2.3}, 1}, 1.6, Paint::leather);
  placePicture(sketch, path + "picture01", {{kVestibule, 1.75, -1.9}, 2}, 1.0, 1.4, random);
  placePicture(sketch, path + "picture02", {{kVestibule, 1.75, 1.9}, 2}, 1.0, 1.4, random);
  placePicture(sketch, path + "picture03", {{3.1, 1.75, kMidSouth}, 3}, 1.4, 1.0, random);
  sketch.place(path + "pendant", makePendantShape(0.6, Paint::lampShade),
               makeTranslation({2.25, kCeiling, 0}));
  sketch.place(path + "umbrella_stand", makeVaseShape(3, Paint::darkIron),
               makeTranslation({0.4, 0, -2.6}));
}

}  // namespace

void furnishEnfilade(Sketch& sketch, Random& random) {
  furnishVestibule(sketch, random);
  for (int i = 0; i < kRooms; ++i) {
    hangPictures(sketch, i, random);
    hangLamps(sketch, i);
    placeCorners(sketch, i, random);
    placeMiddle(sketch, i, random);
  }
}

void furnishHall(Sketch& sketch, Random& random) {
  const std::string path = "building/hall/";
  const double middle = 0.5 * (kVoidWest + kVoidEast);
  PaintedMesh base;
  addBox(base, {-1.1, 0, -1.1}, {1.1, 0.12, 1.1}, Paint::plinthStone);
  addBox(base, {-0.5, 0.118, -0.5}, {0.5, 1.0, 0.5}, Paint::marbleWhite);
  addBox(base, {-0.56, 0.995, -0.56}, {0.56, 1.08, 0.56}, Paint::marbleWhite);
  sketch.place(path + "statue/base", base, makeTranslation({53.5, 0, 0.8}));
  PaintedMesh figure;
  append(figure, makeSculptureShape(4, Paint::bronze), makeQuarterTurn(2) * Eigen::Scaling(1.25));
  sketch.place(path + "statue/figure", figure, makeTranslation({53.5, 1.078, 0.8}));
  int number = 0;
  for (const double x : {-1.5, 1.5})
    for (const double z : {-1.5, 1.5})
      sketch.place(appendNumber(path + "statue/stanchion", ++number), makeStanchionShape(),
                   makeTranslation({53.5 + x, 0, 0.8 + z}));
  PaintedMesh desk;
  addBox(desk, {-0.35, 0, -1.3}, {0.3, 1.0, 1.3}, Paint::oakDark);
  addBox(desk, {-0.4, 0.998, -1.35}, {0.42, 1.05, 1.35}, Paint::marbleGrey);
  sketch.place(path + "desk/counter", desk, makeQuarterTurn(1, {47.5, 0, 5.0}));
  PaintedMesh screen;
  addBox(screen, {-0.02, 0.1, -0.25}, {0.02, 0.42, 0.25}, Paint::blackMetal);
  addBox(screen, {-0.08, 0, -0.1}, {0.08, 0.02, 0.1}, Paint::blackMetal);
  addBox(screen, {-0.015, 0.01, -0.03}, {0.015, 0.12, 0.03}, Paint::blackMetal);
  sketch.place(path + "desk/screen", screen, makeQuarterTurn(1, {47.1, 1.05, 5.1}));
  sketch.place(path + "desk/lamp", makeTableLampShape(), makeTranslation({48.5, 1.05, 5.05}));
  sketch.place(path + "desk/chair", makeChairShape(Paint::blackMetal, Paint::leather),
               makeQuarterTurn(1, {47.4, 0, 5.9}));
  for (const double x : {50.5, 53.5, 56.5})
    placeBench(sketch, appendNumber(path + "bench", static_cast<int>((x - 47.5) / 3)),
               {{x, 0, 5.1}, 1}, 1.8, Paint::leather);
  number = 0;
  for (const Vec3& at : {Vec3{43.5, 0, 2.4}, Vec3{43.5, 0, -2.4}, Vec3{60.0, 0, 1.8},
                         Vec3{60.0, 0, -1.8}, Vec3{45.6, 0, -7.5}, Vec3{57.8, 0, -7.5}})
    sketch.place(appendNumber(path + "plant", ++number), makePottedPlantShape(random),
                 makeTranslation(at));
  number = 0;
  for (const double z : {-7.1, 7.1})
    for (int i = 0; i < 4; ++i)
      sketch.place(appendNumber(path + "gallery_lamp", ++number),
                   makePendantShape(0.5, Paint::lampShade),
                   makeTranslation({kHallWest + 2.5 + 4.3 * i, kUpper - kSlab, z}));
  for (int i = 0; i < 3; ++i) {
    PaintedMesh ring;
    addRod(ring, {0, 0, 0}, {0, 3.0, 0}, 0.012, 8, Paint::blackMetal);
    addTorus(ring, Vec3::Zero(), 0.8, 0.03, 24, 8, Paint::brass);
    addTorus(ring, {0, -0.05, 0}, 0.8, 0.028, 24, 8, Paint::lampGlow);
    addRod(ring, {-0.8, 0, 0}, {0.8, 0, 0}, 0.012, 8, Paint::brass);
    addRod(ring, {0, 0, -0.8}, {0, 0, 0.8}, 0.012, 8, Paint::brass);
    sketch.place(appendNumber(path + "chandelier", i + 1), ring,
                 makeTranslation({middle + 4.0 * (i - 1), 7.4, 0}));
  }
  number = 0;
  for (const double z : {-3.0, 3.0}) {
    placePicture(sketch, appendNumber(path + "picture", ++number), {{kHallWest, 1.9, z}, 0}, 1.8,
                 1.5, random);
    placePicture(sketch, appendNumber(path + "picture", ++number),
                 {{kHallWest, kUpper + 1.8, z * 0.8}, 0}, 1.6, 1.5, random);
    placePicture(sketch, appendNumber(path + "picture", ++number),
                 {{kHallEast, kUpper + 1.8, z * 0.7}, 2}, 1.6, 1.8, random);
  }
  placePicture(sketch, appendNumber(path + "picture", ++number), {{kHallEast, 2.0, 0}, 2}, 3.2, 2.2,
               random);
}

void furnishUpperFloor(Sketch& sketch, Random& random) {
  const struct {
    const char* path;
    double west, east;
  } salons[] = {{"building/upper/salon1/", kWest, computeRoomEast(1)},
                {"building/upper/salon2/", computeRoomWest(2), computeRoomEast(3)},
                {"building/upper/salon3/", computeRoomWest(4), computeRoomEast(5)}};
  for (const auto& salon : salons) {
    const std::string path = salon.path;
    int number = 0, lamp = 0, bench = 0;
    for (double x = salon.west + 1.6; x < salon.east - 1.2; x += 2.1) {
      const bool byDoor = (x > 6.5 && x < 9.5) || (x > 20.5 && x < 23.5) || (x > 39.3 && x < 42.3);
      if (!byDoor)
        placePicture(sketch, appendNumber(path + "picture", ++number),
                     {{x, kUpper + 1.75, kMidSouth}, 3}, 1.2, random.between(1.0, 1.6), random);
      sketch.place(appendNumber(path + "spot", ++lamp), makeSpotShape(),
                   makeQuarterTurn(1, {x, kUpperCeiling, kMidSouth + 1.1}));
    }
    for (double x = salon.west + 3; x < salon.east - 2; x += 4) {
      placeBench(sketch, path + "bench" + std::to_string(++bench), {{x, kUpper, 1.7}, 1}, 1.5,
                 Paint::fabricGrey);
      placeDisplayCase(sketch, path + "case" + std::to_string(bench), {{x + 1.9, kUpper, 1.8}, 1},
                       1.2, random);
      sketch.place(appendNumber(path + "pendant", bench), makePendantShape(0.7, Paint::lampShade),
                   makeTranslation({x, kUpperCeiling, 0}));
    }
  }
  int number = 0;
  for (double x = 19; x < 35; x += 3.4) {  // the studio's easels
    const std::string path = "building/upper/studio/easel" + std::to_string(++number);
    PaintedMesh stand;
    addRod(stand, {0.2, 0, -0.3}, {0, 1.8, 0}, 0.02, 8, Paint::birch);
    addRod(stand, {0.2, 0, 0.3}, {0, 1.8, 0.02}, 0.02, 8, Paint::birch);
    addRod(stand, {-0.5, 0, 0}, {0, 1.7, 0.01}, 0.02, 8, Paint::birch);
    addBox(stand, {0.08, 0.75, -0.4}, {0.2, 0.79, 0.4}, Paint::birch);
    sketch.place(path + "/stand", stand, makeTranslation({x, kUpper, -5.6}));
    placePicture(sketch, path, {{x + 0.12, kUpper + 1.25, -5.6}, 0}, 0.7, 0.8, random);
    sketch.place(path + "/stool", makeStoolShape(), makeTranslation({x + 1.1, kUpper, -5.6}));
  }
  for (int i = 0; i < 5; ++i)
    sketch.place("building/upper/archive/table" + std::to_string(i + 1),
                 makeTableShape(0.9, 1.8, Paint::birch),
                 makeTranslation({2.5 + 3.0 * i, kUpper, -6.6}));
}

}  // namespace enfilade::assets
