// Furniture that is several objects: benches, cases, bookcases, set tables.
#include <algorithm>

#include "assets/furniture.hpp"

namespace enfilade::assets {

void placeBench(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                Paint cloth) {
  const Eigen::Affine3d place = makeQuarterTurn(spot.quarters, spot.at);
  PaintedMesh seat;
  addBox(seat, {-0.24, 0.36, -width / 2}, {0.24, 0.4, width / 2}, Paint::oakDark);
  addBox(seat, {-0.23, 0.395, -width / 2 + 0.01}, {0.23, 0.46, width / 2 - 0.01}, cloth);
  sketch.place(path + "/seat", seat, place);
  PaintedMesh leg;
  addTurned(leg, Vec3::Zero(), {{0.018, 0}, {0.025, 0.3}, {0.035, 0.362}}, 8, Paint::oakDark);
  int number = 0;
  for (const double x : {-0.18, 0.18})
    for (const double z : {-width / 2 + 0.1, width / 2 - 0.1})
      sketch.place(path + "/leg" + std::to_string(++number), leg,
                   place * makeTranslation({x, 0, z}));
}

void placePlinth(Sketch& sketch, const std::string& path, const Spot& spot, double height,
                 const PaintedMesh& exhibit) {
  const Eigen::Affine3d place = makeQuarterTurn(spot.quarters, spot.at);
  PaintedMesh plinth;
  addBox(plinth, {-0.27, 0, -0.27}, {0.27, 0.08, 0.27}, Paint::plaster);
  addBox(plinth, {-0.24, 0.078, -0.24}, {0.24, height - 0.04, 0.24}, Paint::plaster);
  addBox(plinth, {-0.26, height - 0.042, -0.26}, {0.26, height, 0.26}, Paint::plaster);
  sketch.place(path + "/plinth", plinth, place);
  sketch.place(path + "/work", exhibit, place * makeTranslation({0, height - 0.001, 0}));
}

void placeDisplayCase(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                      Random& random) {
  const Eigen::Affine3d place = makeQuarterTurn(spot.quarters, spot.at);
  const double x = 0.3, z = width / 2;
  PaintedMesh base;
  addBox(base, {-x, 0, -z}, {x, 0.06, z}, Paint::blackMetal);
  addBox(base, {-x + 0.02, 0.055, -z + 0.02}, {x - 0.02, 0.78, z - 0.02}, Paint::mahogany);
  addBox(base, {-x, 0.775, -z}, {x, 0.82, z}, Paint::brass);
  addBox(base, {-x + 0.02, 0.815, -z + 0.02}, {x - 0.02, 0.83, z - 0.02}, Paint::fabricCream);
  sketch.place(path + "/base", base, place);
  PaintedMesh glass;
  addBox(glass, {-x + 0.008, 0.821, -z + 0.008}, {x - 0.008, 1.25, z - 0.008}, Paint::caseGlass);
  sketch.place(path + "/glass", glass, place);
  constexpr Paint kGlaze[] = {Paint::cobalt, Paint::celadon, Paint::clay, Paint::bronze};
  const int pieces = std::max(2, static_cast<int>(width / 0.4));
  for (int i = 0; i < pieces; ++i) {
    PaintedMesh piece;
    const int kind = random.below(4);
    Eigen::Affine3d small = makeTranslation({0, 0.829, -z + width * (i + 0.5) / pieces});
    small.linear() *= 0.55;
    append(piece, makeVaseShape(kind, kGlaze[random.below(4)]), small);
    sketch.place(path + "/exhibit" + std::to_string(i + 1), piece, place);
  }
}

namespace {

constexpr Paint kSpines[] = {Paint::bookRed,   Paint::bookBlue,  Paint::bookGreen, Paint::bookBrown,
                             Paint::bookOchre, Paint::bookBlack, Paint::bookCream, Paint::bookTeal};

PaintedMesh makeBookShape(double depth, double height, double thickness, Paint spine) {
  PaintedMesh s;
  addBox(s, {0, 0, 0}, {depth, height, thickness},
         {Paint::paper, spine, Paint::paper, Paint::paper, spine, spine});
  return s;
}

void fillShelf(Sketch& sketch, const std::string& path, const Eigen::Affine3d& place, double from,
               double to, double y, double clear, Random& random) {
  double z = from;
  const int gapAfter = 6 + random.below(14);
  for (int number = 1;; ++number) {
    // A few sizes only, so that books share meshes.
    const double thickness = 0.03 + 0.008 * random.below(4);
    const double height = std::min(clear - 0.03, 0.21 + 0.03 * random.below(4));
    const double depth = 0.18 + 0.02 * random.below(3);
    const Paint spine = kSpines[random.below(8)];
    if (number == gapAfter) z += 0.12;
    if (z + thickness > to) return;
    sketch.place(appendNumber(path + "/book", number),
                 makeBookShape(depth, height, thickness, spine),
                 place * makeTranslation({0.03, y + 0.001, z}));
    z += thickness + 0.0015;
  }
}

}  // namespace

void placeBookcase(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                   double height, Random& random) {
  const Eigen::Affine3d place = makeQuarterTurn(spot.quarters, spot.at);
  const double z = width / 2, board = 0.03, depth = 0.32;
  PaintedMesh carcass;
  addBox(carcass, {0.002, 0, -z}, {0.02, height, z}, Paint::mahogany);
  addBox(carcass, {0.018, 0, -z}, {depth, height, -z + board}, Paint::mahogany);
  addBox(carcass, {0.018, 0, z - board}, {depth, height, z}, Paint::mahogany);
  addBox(carcass, {0.018, 0, -z + board}, {depth - 0.02, 0.1, z - board}, Paint::mahogany);
  addBox(carcass, {0, height - 0.002, -z - 0.02}, {depth + 0.03, height + 0.06, z + 0.02},
         Paint::mahogany);
  sketch.place(path + "/carcass", carcass, place);
  const int shelves = static_cast<int>((height - 0.1) / 0.36);
  const double pitch = (height - 0.1) / shelves;
  for (int i = 0; i < shelves; ++i) {
    const double y = 0.1 + pitch * i;
    const std::string shelf = path + "/shelf" + std::to_string(i + 1);
    PaintedMesh boardShape;
    addBox(boardShape, {0.019, -board, -z + board - 0.001}, {depth - 0.01, 0, z - board + 0.001},
           Paint::mahogany);
    sketch.place(shelf + "/board", boardShape, place * makeTranslation({0, y + board, 0}));
    fillShelf(sketch, shelf, place, -z + board + 0.01, z - board - 0.01, y + board, pitch - board,
              random);
  }
}

void placeCafeTable(Sketch& sketch, const std::string& path, const Spot& spot, int chairs) {
  const Eigen::Affine3d place = makeQuarterTurn(spot.quarters, spot.at);
  sketch.place(path + "/table", makeRoundTableShape(0.42, Paint::marbleWhite), place);
  PaintedMesh cup;
  addTurned(cup, Vec3::Zero(), {{0.03, 0}, {0.075, 0.008}, {0.078, 0.016}}, 12, Paint::plaster);
  addTurned(cup, {0, 0.012, 0}, {{0.022, 0}, {0.038, 0.03}, {0.04, 0.07}}, 12, Paint::plaster);
  PaintedMesh flower = makeVaseShape(1, Paint::celadon);
  for (PaintedMesh::Part& part : flower.parts)
    for (Vec3& p : part.positions) p *= 0.35;
  sketch.place(path + "/vase", flower, place * makeTranslation({0, 0.7455, 0}));
  for (int i = 0; i < chairs; ++i) {
    const Eigen::Affine3d side = place * makeQuarterTurn(i * (chairs == 2 ? 2 : 1));
    sketch.place(path + "/chair" + std::to_string(i + 1),
                 makeChairShape(Paint::darkIron, Paint::leatherGreen),
                 side * makeQuarterTurn(2, {0.62, 0, 0}));
    sketch.place(path + "/cup" + std::to_string(i + 1), cup,
                 side * makeTranslation({0.25, 0.7455, 0.06}));
  }
}

}  // namespace enfilade::assets
