#include "assets/walls.hpp"

#include <algorithm>

namespace enfilade::assets {
namespace {

constexpr double kQuarterTurn = 1.5707963267948966;

std::vector<double> findCuts(const Wall& wall, const std::vector<Opening>& openings) {
  std::vector<double> cuts{wall.from, wall.to};
  for (const Opening& o : openings) cuts.insert(cuts.end(), {o.from, o.to});
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  return cuts;
}

/// The openings that overlap a strip between two cuts, from bottom to top.
std::vector<Opening> findHoles(const std::vector<Opening>& openings, double from, double to) {
  std::vector<Opening> holes;
  for (const Opening& o : openings)
    if (o.from < to && from < o.to) holes.push_back(o);
  std::sort(holes.begin(), holes.end(),
            [](const Opening& a, const Opening& b) { return a.bottom < b.bottom; });
  return holes;
}

BoxPaints makeBoxPaints(const Wall& w) {
  if (w.along == Wall::Axis::x) return {w.ends, w.ends, w.ends, w.ends, w.lowFace, w.highFace};
  return {w.lowFace, w.highFace, w.ends, w.ends, w.ends, w.ends};
}

/// A profile in (out of the wall, up), swept along a face; its ends extend into the cross walls.
void addMoulding(Sketch& sketch, const std::string& path, const Face& f, std::vector<Vec2> profile,
                 double y, Paint paint) {
  constexpr double kInto = 0.004;
  const double length = f.to - f.from + 2 * kInto;
  const Vec3 out = makeWallPoint(f.along, 0, 0, f.inward), up{0, 1, 0};
  const Vec3 w = out.cross(up);
  const double start = w.dot(makeWallPoint(f.along, 1, 0, 0)) > 0 ? f.from - kInto : f.to + kInto;
  PaintedMesh shape;
  addPrism(shape, profile, {Vec3::Zero(), out, up, w}, length, paint);
  sketch.place(path, shape, makeTranslation(makeWallPoint(f.along, start, y, f.face)));
}

/// Wavy cloth on a rod, `width` wide along +X, a closed solid.
PaintedMesh makeCurtainShape(double width, double height, Paint paint) {
  constexpr int kFolds = 7;
  std::vector<Vec2> outline;
  for (int i = 0; i <= 2 * kFolds; ++i)
    outline.push_back({width * i / (2 * kFolds), i % 2 ? 0.05 : 0.0});
  for (int i = 2 * kFolds; i >= 0; --i)
    outline.push_back({width * i / (2 * kFolds), i % 2 ? 0.065 : 0.015});
  PaintedMesh shape;
  addPrism(shape, outline, {Vec3::Zero(), {1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, height, paint);
  return shape;
}

void addCurtains(Sketch& sketch, const std::string& path, const Wall& wall, const Opening& hole,
                 const WindowStyle& style) {
  const double face = style.inward > 0 ? wall.high : wall.low;
  const double across = face + style.inward * 0.10;
  const double top = hole.top + 0.12, bottom = hole.bottom - 0.35, width = 0.34;
  const Vec3 reach = makeWallPoint(wall.along, 0.28, 0, 0);
  PaintedMesh rod;
  addRod(rod, makeWallPoint(wall.along, hole.from, top, across) - reach,
         makeWallPoint(wall.along, hole.to, top, across) + reach, 0.014, 8, Paint::brass);
  sketch.place(path + "/curtain_rod", rod, Eigen::Affine3d::Identity());
  const PaintedMesh cloth = makeCurtainShape(width, top - bottom, style.curtain);
  const int quarters = wall.along == Wall::Axis::x ? 0 : 3;
  sketch.place(
      path + "/curtain_left", cloth,
      makeQuarterTurn(quarters, makeWallPoint(wall.along, hole.from - 0.26, bottom, across)));
  sketch.place(
      path + "/curtain_right", cloth,
      makeQuarterTurn(quarters, makeWallPoint(wall.along, hole.to - 0.08, bottom, across)));
}

}  // namespace

Vec3 makeWallPoint(Wall::Axis along, double a, double y, double across) {
  return along == Wall::Axis::x ? Vec3{a, y, across} : Vec3{across, y, a};
}

void placeWallBox(Sketch& sketch, const std::string& path, Wall::Axis along, const Vec3& low,
                  const Vec3& high, Paint paint) {
  sketch.placeBox(path, makeWallPoint(along, low.x(), low.y(), low.z()),
                  makeWallPoint(along, high.x(), high.y(), high.z()), paint);
}

void addWall(Sketch& sketch, const std::string& path, const Wall& w,
             const std::vector<Opening>& openings) {
  const std::vector<double> cuts = findCuts(w, openings);
  int piece = 0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    double y = w.bottom;
    const auto fill = [&](double top) {
      if (top - y > 1e-6)
        sketch.placeBox(appendNumber(path + "/piece", ++piece),
                        makeWallPoint(w.along, cuts[i], y, w.low),
                        makeWallPoint(w.along, cuts[i + 1], top, w.high), makeBoxPaints(w));
    };
    for (const Opening& o : findHoles(openings, cuts[i], cuts[i + 1])) {
      fill(o.bottom);
      y = o.top;
    }
    fill(w.top);
  }
}

void addRail(Sketch& sketch, const std::string& path, const Face& face, double y, double height,
             double depth, Paint paint) {
  addMoulding(sketch, path, face,
              {{-0.003, 0},
               {depth * 0.6, 0},
               {depth, height * 0.4},
               {depth, height * 0.7},
               {depth * 0.4, height},
               {-0.003, height}},
              y, paint);
}

void addSkirting(Sketch& sketch, const std::string& path, const Face& face, double floor,
                 const std::vector<Opening>& openings) {
  std::vector<Opening> doors;
  for (const Opening& o : openings)
    if (o.bottom < floor + 0.1 && o.top > floor + 0.2 && o.to > face.from && o.from < face.to)
      doors.push_back(o);
  std::sort(doors.begin(), doors.end(),
            [](const Opening& a, const Opening& b) { return a.from < b.from; });
  constexpr double kCasing = 0.11;  // the skirting ends inside the door's casing
  double from = face.from;
  int piece = 0;
  const auto lay = [&](double to) {
    if (to - from < 0.05) return;
    Face part = face;
    part.from = from;
    part.to = to;
    addMoulding(sketch, appendNumber(path, ++piece), part,
                {{-0.003, -0.003}, {0.018, -0.003}, {0.018, 0.10}, {0.008, 0.13}, {-0.003, 0.13}},
                floor, Paint::paintedWood);
  };
  for (const Opening& door : doors) {
    lay(door.from - kCasing);
    from = door.to + kCasing;
  }
  lay(face.to);
}

void addCornice(Sketch& sketch, const std::string& path, const Face& face, double ceiling) {
  addMoulding(sketch, path, face,
              {{-0.003, -0.22},
               {0.03, -0.22},
               {0.045, -0.17},
               {0.07, -0.13},
               {0.12, -0.09},
               {0.16, -0.07},
               {0.17, -0.03},
               {0.17, 0.003},
               {-0.003, 0.003}},
              ceiling, Paint::cornice);
}

void addCasing(Sketch& sketch, const std::string& path, const Wall& w, const Opening& o, bool high,
               Paint paint) {
  constexpr double kWidth = 0.12, kProud = 0.025, kLap = 0.012;
  const std::string side = path + (high ? "/casing_b" : "/casing_a");
  const double inner = high ? w.high - 0.003 : w.low - kProud;
  const double outer = high ? w.high + kProud : w.low + 0.003;
  placeWallBox(sketch, side + "_left", w.along, {o.from - kWidth, o.bottom, inner},
               {o.from - kLap, o.top, outer}, paint);
  placeWallBox(sketch, side + "_right", w.along, {o.to + kLap, o.bottom, inner},
               {o.to + kWidth, o.top, outer}, paint);
  placeWallBox(sketch, side + "_head", w.along, {o.from - kWidth - 0.01, o.top, inner},
               {o.to + kWidth + 0.01, o.top + 0.14, outer}, paint);
  Face face{w.along, o.from - 0.2, o.to + 0.2, high ? w.high : w.low, high ? 1.0 : -1.0};
  addRail(sketch, path + (high ? "/architrave_b" : "/architrave_a"), face, o.top + 0.141, 0.07,
          0.08, paint);
}

void addDoorFrame(Sketch& sketch, const std::string& path, const Wall& w, const Opening& o,
                  Paint paint) {
  for (const bool high : {false, true}) addCasing(sketch, path, w, o, high, paint);
}

void addThreshold(Sketch& sketch, const std::string& path, const Wall& w, const Opening& o,
                  Paint paint) {
  placeWallBox(sketch, path, w.along, {o.from, o.bottom - 0.02, w.low - 0.005},
               {o.to, o.bottom + 0.002, w.high + 0.005}, paint);
}

void addLeaf(Sketch& sketch, const std::string& path, const Leaf& leaf) {
  constexpr double kHalf = 0.02;
  const double w = leaf.width, h = leaf.height, y0 = 0.008;
  PaintedMesh s;
  if (leaf.glazed) {
    const double stile = 0.10;
    addBox(s, {0.004, y0, -kHalf}, {stile, h, kHalf}, Paint::doorWood);
    addBox(s, {w - stile, y0, -kHalf}, {w, h, kHalf}, Paint::doorWood);
    const double rail = kHalf - 0.001;  // shallower than the stiles, so that they share no edge
    addBox(s, {stile, y0, -rail}, {w - stile, 0.35, rail}, Paint::doorWood);
    addBox(s, {stile, h - stile, -rail}, {w - stile, h, rail}, Paint::doorWood);
    addBox(s, {stile - 0.005, 0.345, -0.004}, {w - stile + 0.005, h - stile + 0.005, 0.004},
           Paint::glass);
  } else {
    addBox(s, {0.004, y0, -kHalf}, {w, h, kHalf}, Paint::doorWood);
    constexpr double kRows[][2] = {{0.16, 0.72}, {0.86, 1.42}, {1.56, 0.0}};
    for (const auto& row : kRows) {
      const double top = row[1] > 0 ? row[1] : h - 0.14;
      addBox(s, {0.1, row[0], -kHalf - 0.008}, {w - 0.1, top, kHalf + 0.008}, Paint::doorPanel);
    }
  }
  for (const double side : {-1.0, 1.0}) {
    const double z = side * (kHalf + 0.035);
    addRod(s, {w - 0.05, 1.02, side * (kHalf - 0.005)}, {w - 0.05, 1.02, z}, 0.01, 8, Paint::brass);
    addRod(s, {w - 0.04, 1.02, z}, {w - 0.15, 1.02, z}, 0.01, 8, Paint::brass);
  }
  sketch.place(path, s, makeQuarterTurn(leaf.quarters, leaf.hinge));
  const double a = leaf.closes * kQuarterTurn;
  sketch.setJoint(MovingPart::Kind::hinge, Vec3{0, 1, 0}, std::min(0.0, a), std::max(0.0, a));
}

void addWindow(Sketch& sketch, const std::string& path, const Wall& w, const Opening& o,
               const WindowStyle& style) {
  const double middle = 0.5 * (w.low + w.high), d = 0.035, bar = 0.05;
  const auto put = [&](const std::string& name, double a0, double a1, double y0, double y1,
                       double half, Paint paint) {
    placeWallBox(sketch, path + name, w.along, {a0, y0, middle - half}, {a1, y1, middle + half},
                 paint);
  };
  put("/frame_left", o.from, o.from + bar, o.bottom, o.top, d, Paint::paintedWood);
  put("/frame_right", o.to - bar, o.to, o.bottom, o.top, d, Paint::paintedWood);
  put("/frame_bottom", o.from + bar, o.to - bar, o.bottom, o.bottom + bar, d, Paint::paintedWood);
  put("/frame_top", o.from + bar, o.to - bar, o.top - bar, o.top, d, Paint::paintedWood);
  const double a0 = o.from + bar, a1 = o.to - bar, y0 = o.bottom + bar, y1 = o.top - bar;
  const auto computeColumn = [&](int i) { return a0 + (a1 - a0) * i / style.columns; };
  for (int i = 1; i < style.columns; ++i)
    put(appendNumber("/mullion", i), computeColumn(i) - 0.02, computeColumn(i) + 0.02, y0, y1,
        d - 0.005, Paint::paintedWood);
  for (int i = 1; i < style.rows; ++i) {
    const double y = y0 + (y1 - y0) * i / style.rows;
    put(appendNumber("/transom", i), a0, a1, y - 0.015, y + 0.015, d - 0.012, Paint::paintedWood);
  }
  for (int i = 0; i < style.columns; ++i)
    put(appendNumber("/pane", i + 1), computeColumn(i) + (i ? 0.015 : -0.005),
        computeColumn(i + 1) - (i + 1 < style.columns ? 0.015 : -0.005), y0 - 0.005, y1 + 0.005,
        0.004, Paint::glass);
  if (style.sill) {
    const double inner = style.inward > 0 ? w.high + 0.09 : w.low - 0.09;
    const double outer = style.inward > 0 ? middle : middle;
    placeWallBox(sketch, path + "/sill", w.along,
                 {o.from - 0.08, o.bottom - 0.012, std::min(inner, outer)},
                 {o.to + 0.08, o.bottom + 0.03, std::max(inner, outer)}, Paint::marbleWhite);
  }
  if (style.curtain != Paint::glass) addCurtains(sketch, path, w, o, style);
}

}  // namespace enfilade::assets
