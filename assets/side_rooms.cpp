// Cloakroom, cafe, study, library and lobby: the rooms north of the enfilade.
#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

using namespace plan;

PaintedMesh makeCoatShape(Paint cloth) {
  PaintedMesh s;
  addRod(s, {0, 0, 0}, {0, -0.07, 0}, 0.004, 6, Paint::chrome);
  addTurned(s, {0, -1.1, 0}, {{0.2, 0}, {0.2, 0.1}, {0.17, 0.75}, {0.19, 0.95}, {0.06, 1.05}}, 8,
            cloth);
  for (PaintedMesh::Part& part : s.parts)
    for (Vec3& p : part.positions) p.z() *= 0.45;
  return s;
}

void furnishCloakroom(Sketch& sketch, Random& random) {
  const std::string path = "building/ground/cloakroom/";
  constexpr Paint kCloths[] = {Paint::paintNavy,   Paint::fabricGrey,  Paint::rugRed,
                               Paint::bookGreen,   Paint::paintUmber,  Paint::fabricCream,
                               Paint::paintViolet, Paint::leatherGreen};
  for (int rack = 0; rack < 2; ++rack) {
    const std::string name = path + "rack" + std::to_string(rack + 1);
    const double z = rack ? -6.9 : -5.4;
    PaintedMesh rail;
    addRod(rail, {-1.5, 1.6, 0}, {1.5, 1.6, 0}, 0.018, 8, Paint::chrome);
    for (const double x : {-1.45, 1.45}) {
      addRod(rail, {x, 0.02, 0}, {x, 1.62, 0}, 0.02, 8, Paint::chrome);
      addBox(rail, {x - 0.04, 0, -0.3}, {x + 0.04, 0.04, 0.3}, Paint::blackMetal);
    }
    sketch.place(name + "/rail", rail, makeTranslation({3.7, 0, z}));
    for (int i = 0; i < 11; ++i) {
      const Paint cloth = kCloths[random.below(8)];
      if (random.below(5) == 0) continue;  // an empty hook
      sketch.place(appendNumber(name + "/coat", i + 1), makeCoatShape(cloth),
                   makeQuarterTurn(1, {2.45 + 0.25 * i, 1.585, z}));
    }
  }
  PaintedMesh locker;
  addBox(locker, {0.002, 0, -0.2}, {0.45, 1.8, 0.2}, Paint::fabricBlue);
  addBox(locker, {0.445, 0.06, -0.185}, {0.46, 1.76, 0.185}, Paint::paintSky);
  addBox(locker, {0.458, 0.95, 0.11}, {0.475, 1.05, 0.14}, Paint::chrome);
  for (int i = 0; i < 6; ++i)
    sketch.place(appendNumber(path + "locker", i + 1), locker,
                 makeQuarterTurn(2, {6.0, 0, -7.9 + 0.41 * i}));
  placeBench(sketch, path + "bench1", {{0.6, 0, -5.9}, 0}, 1.2, Paint::leather);
  sketch.place(path + "pendant", makePendantShape(0.6, Paint::lampShade),
               makeTranslation({3.0, kCeiling, -5.6}));
}

void furnishCafe(Sketch& sketch, Random& random) {
  const std::string path = "building/ground/cafe/";
  PaintedMesh counter;
  addBox(counter, {-0.3, 0, -1.6}, {0.28, 1.02, 1.6}, Paint::walnut);
  addBox(counter, {-0.34, 1.018, -1.66}, {0.4, 1.07, 1.66}, Paint::marbleWhite);
  addRod(counter, {0.36, 0.2, -1.55}, {0.36, 0.2, 1.55}, 0.02, 8, Paint::brass);
  sketch.place(path + "counter", counter, makeTranslation({8.0, 0, -6.4}));
  PaintedMesh machine;
  addBox(machine, {-0.22, 0, -0.35}, {0.2, 0.42, 0.35}, Paint::chrome);
  addBox(machine, {0.19, 0.28, -0.3}, {0.26, 0.36, 0.3}, Paint::blackMetal);
  addBox(machine, {-0.24, 0.415, -0.37}, {0.22, 0.44, 0.37}, Paint::brass);
  sketch.place(path + "coffee_machine", machine, makeTranslation({8.0, 1.07, -7.3}));
  PaintedMesh cakes;
  addBox(cakes, {-0.2, 0, -0.5}, {0.2, 0.35, 0.5}, Paint::caseGlass);
  for (int i = 0; i < 4; ++i)
    addTurned(cakes, {0, 0.02, -0.36 + 0.24 * i}, {{0.09, 0}, {0.09, 0.07}, {0.04, 0.11}}, 12,
              i % 2 ? Paint::paintPink : Paint::paintUmber);
  sketch.place(path + "cake_case", cakes, makeTranslation({8.0, 1.069, -5.5}));
  constexpr Paint kBottles[] = {Paint::bookGreen, Paint::bookOchre, Paint::clay, Paint::cobalt};
  for (int shelf = 0; shelf < 3; ++shelf) {
    const double y = 1.2 + 0.42 * shelf;
    sketch.placeBox(appendNumber(path + "bar_shelf", shelf + 1), {6.298, y - 0.03, -7.9},
                    {6.52, y, -5.0}, Paint::walnutDark);
    for (int i = 0; i < 14; ++i) {
      PaintedMesh item;
      addTurned(item, Vec3::Zero(),
                {{0.035, 0}, {0.036, 0.17}, {0.012, 0.22}, {0.012, 0.28}, {0.016, 0.3}}, 12,
                kBottles[random.below(4)]);
      sketch.place(appendNumber(path + "bottle", 14 * shelf + i + 1), item,
                   makeTranslation({6.41, y, -7.75 + 0.2 * i}));
    }
  }
  for (int i = 0; i < 4; ++i)
    sketch.place(appendNumber(path + "stool", i + 1), makeStoolShape(),
                 makeTranslation({8.75, 0, -7.5 + 0.75 * i}));
  int table = 0;
  for (const double x : {10.9, 13.1, 15.6})
    for (const double z : {-7.2, -5.2}) {
      ++table;
      placeCafeTable(sketch, appendNumber(path + "table", table), {{x, 0, z}, table % 2},
                     2 + table % 3);
      sketch.place(appendNumber(path + "pendant", table), makePendantShape(1.1, Paint::brass),
                   makeTranslation({x, kCeiling, z}));
    }
  placePicture(sketch, path + "picture01", {{17.1, 1.7, -6.9}, 2}, 1.3, 1.0, random);
  placePicture(sketch, path + "picture02", {{17.1, 1.7, -4.9}, 2}, 1.3, 1.0, random);
  placePicture(sketch, path + "picture03", {{11.6, 1.7, kMidNorth}, 1}, 1.6, 1.1, random);
  sketch.place(path + "plant1", makePottedPlantShape(random), makeTranslation({16.6, 0, -3.8}));
  sketch.place(path + "plant2", makePottedPlantShape(random), makeTranslation({16.6, 0, -8.0}));
}

void furnishStudy(Sketch& sketch, Random& random) {
  const std::string path = "building/ground/study/";
  sketch.place(path + "rug", makeRugShape(3.6, 2.4, Paint::rugGold, Paint::rugBlue),
               makeTranslation({20.4, 0, -6.2}));
  sketch.place(path + "desk", makeTableShape(0.8, 1.7, Paint::mahogany),
               makeQuarterTurn(3, {20.4, 0, -6.7}));
  sketch.place(path + "desk_lamp", makeTableLampShape(), makeTranslation({19.8, 0.749, -6.8}));
  sketch.place(path + "desk_chair", makeChairShape(Paint::mahogany, Paint::leather),
               makeQuarterTurn(3, {20.4, 0, -7.5}));
  sketch.place(path + "globe", makeGlobeShape(), makeTranslation({22.6, 0, -7.7}));
  // A dynamic body: it starts clear of the floor, and settles.
  sketch.place(path + "armchair", makeArmchairShape(Paint::leather),
               makeQuarterTurn(0, {18.1, 0.001, -5.2}));
  sketch.place(path + "floor_lamp", makeFloorLampShape(), makeTranslation({17.8, 0, -4.2}));
  placeBookcase(sketch, path + "bookcase1", {{23.4, 0, -5.4}, 2}, 1.2, 2.2, random);
  placePicture(sketch, path + "picture01", {{17.4, 1.8, -6.4}, 0}, 1.0, 1.3, random);
  placePicture(sketch, path + "picture02", {{22.3, 1.8, kMidNorth}, 1}, 1.2, 0.9, random);
  sketch.place(path + "pendant", makePendantShape(0.7, Paint::lampShade),
               makeTranslation({20.4, kCeiling, -6}));
}

void furnishLibrary(Sketch& sketch, Random& random) {
  const std::string path = "building/ground/library/";
  int number = 0;
  for (const double z : {-7.5, -6.2, -4.9})
    placeBookcase(sketch, appendNumber(path + "bookcase", ++number), {{23.7, 0, z}, 0}, 1.2, 2.4,
                  random);
  for (const double z : {-7.5, -6.2})
    placeBookcase(sketch, appendNumber(path + "bookcase", ++number), {{36.0, 0, z}, 2}, 1.2, 2.4,
                  random);
  for (const double x : {28.5, 29.8, 31.1})
    placeBookcase(sketch, appendNumber(path + "bookcase", ++number), {{x, 0, kMidNorth}, 1}, 1.2,
                  2.4, random);
  number = 0;
  for (const double x : {26.6, 29.9, 33.2}) {
    const std::string table = path + "reading_table" + std::to_string(++number);
    sketch.place(table + "/table", makeTableShape(1.0, 2.0, Paint::mahogany),
                 makeQuarterTurn(1, {x, 0, -6.6}));
    sketch.place(table + "/lamp", makeTableLampShape(), makeTranslation({x, 0.749, -6.6}));
    int chair = 0;
    for (const double dx : {-0.5, 0.5})
      for (const int side : {1, 3})
        sketch.place(table + "/chair" + std::to_string(++chair),
                     makeChairShape(Paint::mahogany, Paint::leatherGreen),
                     makeQuarterTurn(side, {x + dx, 0, -6.6 + (side == 1 ? 0.75 : -0.75)}));
    PaintedMesh open;  // an open book
    addBox(open, {-0.14, 0, -0.19}, {0.14, 0.012, 0.19}, Paint::bookRed);
    addBox(open, {-0.13, 0.011, -0.18}, {0.13, 0.03, 0.18}, Paint::paper);
    sketch.place(table + "/open_book", open, makeTranslation({x + 0.5, 0.749, -6.4}));
    sketch.place(appendNumber(path + "pendant", number), makePendantShape(0.9, Paint::leatherGreen),
                 makeTranslation({x, kCeiling, -6.6}));
  }
  PaintedMesh ladder;
  for (const double z : {-0.22, 0.22})
    addRod(ladder, {0.55, 0, z}, {0.02, 2.5, z}, 0.022, 8, Paint::oakDark);
  for (int i = 1; i < 8; ++i) {
    const double t = i / 8.0;
    addRod(ladder, {0.55 - 0.53 * t, 2.5 * t, -0.22}, {0.55 - 0.53 * t, 2.5 * t, 0.22}, 0.015, 8,
           Paint::oakDark);
  }
  sketch.place(path + "ladder", ladder, makeQuarterTurn(0, {24.06, 0, -6.2}));
  sketch.place(path + "globe", makeGlobeShape(), makeTranslation({35.2, 0, -5.0}));
}

void furnishLobby(Sketch& sketch, Random& random) {
  const std::string path = "building/ground/lobby/";
  placeBench(sketch, path + "bench1", {{39.0, 0, -3.7}, 1}, 1.6, Paint::leather);
  sketch.place(path + "plant", makePottedPlantShape(random), makeTranslation({41.8, 0, -3.8}));
  sketch.place(path + "pendant", makePendantShape(0.6, Paint::lampShade),
               makeTranslation({40.5, kCeiling, -5}));
  PaintedMesh board;
  addBox(board, {-0.002, -0.5, -0.4}, {0.03, 0.5, 0.4}, Paint::blackMetal);
  for (int i = 0; i < 6; ++i)
    addBox(board, {0.028, 0.3 - 0.13 * i, -0.32}, {0.033, 0.36 - 0.13 * i, 0.1 + 0.03 * (i % 3)},
           Paint::paintWhite);
  sketch.place(path + "directory", board, makeQuarterTurn(0, {kLobbyWest, 1.6, -4.3}));
}

}  // namespace

void furnishSideRooms(Sketch& sketch, Random& random) {
  furnishCloakroom(sketch, random);
  furnishCafe(sketch, random);
  furnishStudy(sketch, random);
  furnishLibrary(sketch, random);
  furnishLobby(sketch, random);
}

}  // namespace enfilade::assets
