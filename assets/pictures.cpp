// Pictures: a gilt or dark frame, a canvas, and layers of paint. Each layer is a millimetre in
// front of the previous one, so that no two are coplanar.
#include <algorithm>

#include "assets/furniture.hpp"

namespace enfilade::assets {
namespace {

/// The picture's plane: origin in the centre, x to the right and y up as seen by a viewer.
struct Easel {
  PaintedMesh& shape;
  double halfWidth, halfHeight;
  double depth = 0.021;  ///< of the next layer, from the wall

  void lay(const std::vector<Vec2>& outline, Paint paint) {
    addPolygon(shape, outline, {{depth, 0, 0}, {0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, paint);
    depth += 0.001;
  }
  void layBox(double x0, double y0, double x1, double y1, Paint paint) {
    lay({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, paint);
  }
  void layOval(double x, double y, double rx, double ry, Paint paint) {
    std::vector<Vec2> outline = makeUnitCircle(24);
    for (Vec2& p : outline) p = {x + rx * p.x(), y + ry * p.y()};
    lay(outline, paint);
  }
};

/// A band of land whose upper edge varies around `y`.
void layHill(Easel& e, double y, double swing, Paint paint, Random& random) {
  constexpr int kSteps = 10;
  std::vector<Vec2> outline{{-e.halfWidth, -e.halfHeight}, {e.halfWidth, -e.halfHeight}};
  double height = y;
  for (int i = kSteps; i >= 0; --i) {
    height += random.between(-swing, swing);
    const double low = -e.halfHeight * 0.95, high = e.halfHeight * 0.9;
    height = height < low ? low : height > high ? high : height;
    outline.push_back({-e.halfWidth + 2 * e.halfWidth * i / kSteps, height});
  }
  e.lay(outline, paint);
}

void paintLandscape(Easel& e, Random& random) {
  const double h = e.halfHeight, w = e.halfWidth;
  constexpr Paint kSkies[] = {Paint::paintSky, Paint::paintPink, Paint::paintYellow};
  constexpr Paint kFar[] = {Paint::paintBlue, Paint::paintViolet, Paint::paintGrey};
  const int mood = random.below(3);
  e.layBox(-w, -h, w, h, kSkies[mood]);
  e.layBox(-w, -h, w, h * 0.35, mood == 0 ? Paint::paintWhite : Paint::paintOrange);
  e.layOval(random.between(-0.5, 0.5) * w, h * 0.45, h * 0.16, h * 0.16,
            mood == 0 ? Paint::paintWhite : Paint::paintYellow);
  layHill(e, h * 0.25, h * 0.14, kFar[mood], random);
  layHill(e, -h * 0.1, h * 0.1, Paint::paintGreen, random);
  layHill(e, -h * 0.45, h * 0.07, Paint::paintDeepGreen, random);
  for (int i = 0; i < 3; ++i) {
    const double x = random.between(-0.85, 0.85) * w, y = -h * random.between(0.45, 0.75);
    e.layBox(x - 0.012, y, x + 0.012, y + h * 0.3, Paint::paintUmber);
    e.layOval(x, y + h * 0.4, h * 0.13, h * 0.2, Paint::paintDeepGreen);
  }
}

void paintPortrait(Easel& e, Random& random) {
  constexpr Paint kGround[] = {Paint::paintUmber, Paint::paintDeepGreen, Paint::paintNavy};
  constexpr Paint kCoat[] = {Paint::paintRed, Paint::paintBlack, Paint::paintViolet,
                             Paint::paintBlue};
  constexpr Paint kHair[] = {Paint::paintBlack, Paint::paintUmber, Paint::paintGrey,
                             Paint::paintOrange};
  const double h = e.halfHeight, w = e.halfWidth, r = h < w ? h : w;
  e.layBox(-w, -h, w, h, kGround[random.below(3)]);
  const Paint coat = kCoat[random.below(4)], hair = kHair[random.below(4)];
  e.layOval(0, h * 0.22, r * 0.42, r * 0.52, hair);
  e.lay({{-r * 0.85, -h},
         {r * 0.85, -h},
         {r * 0.62, -h * 0.5},
         {r * 0.2, -h * 0.28},
         {-r * 0.2, -h * 0.28},
         {-r * 0.62, -h * 0.5}},
        coat);
  e.layBox(-r * 0.13, -h * 0.34, r * 0.13, h * 0.05, Paint::paintSkin);
  e.lay({{-r * 0.18, -h * 0.28}, {0, -h * 0.7}, {r * 0.18, -h * 0.28}}, Paint::paintWhite);
  e.layOval(0, h * 0.17, r * 0.29, r * 0.4, Paint::paintSkin);
  e.layOval(-r * 0.11, h * 0.22, r * 0.035, r * 0.025, Paint::paintBlack);
  e.layOval(r * 0.11, h * 0.22, r * 0.035, r * 0.025, Paint::paintBlack);
  e.layBox(-r * 0.025, h * 0.08, r * 0.025, h * 0.2, Paint::paintPink);
  e.layBox(-r * 0.08, h * 0.0, r * 0.08, h * 0.025, Paint::paintRed);
}

constexpr Paint kBright[] = {Paint::paintRed,    Paint::paintYellow, Paint::paintBlue,
                             Paint::paintOrange, Paint::paintSky,    Paint::paintGreen,
                             Paint::paintPink,   Paint::paintViolet};

void paintGrid(Easel& e, Random& random) {
  const double w = e.halfWidth, h = e.halfHeight;
  e.layBox(-w, -h, w, h, Paint::paintBlack);
  double x = -w;
  while (x < w - 0.02) {
    const double x1 = std::min(w, x + random.between(0.18, 0.5) * w);
    double y = -h;
    const double depth = e.depth;
    while (y < h - 0.02) {
      const double y1 = std::min(h, y + random.between(0.2, 0.7) * h);
      e.depth = depth;
      const Paint paint = random.below(2) ? Paint::paintWhite : kBright[random.below(4)];
      if (x1 - x > 0.03 && y1 - y > 0.03)
        e.layBox(x + 0.008, y + 0.008, x1 - 0.008, y1 - 0.008, paint);
      y = y1;
    }
    x = x1;
    e.depth = depth;
  }
}

void paintRings(Easel& e, Random& random) {
  const double w = e.halfWidth, h = e.halfHeight, r = h < w ? h : w;
  e.layBox(-w, -h, w, h, Paint::paintNavy);
  const double x = random.between(-0.3, 0.3) * w, y = random.between(-0.2, 0.2) * h;
  int paint = random.below(8);
  for (int i = 0; i < 5; ++i) {
    const double radius = r * (0.68 - 0.13 * i);
    e.layOval(x, y, radius, radius, kBright[paint % 8]);
    paint += 1 + random.below(3);
  }
  for (int i = 0; i < 4; ++i) {
    const double dotX = random.between(-0.8, 0.8) * w, dotY = random.between(-0.8, 0.8) * h;
    e.layOval(dotX, dotY, r * 0.09, r * 0.09, kBright[random.below(8)]);
  }
}

void paintField(Easel& e, Random& random) {
  const double w = e.halfWidth, h = e.halfHeight;
  const int first = random.below(8);
  e.layBox(-w, -h, w, h, kBright[first]);
  e.layBox(-w * 0.84, h * 0.08, w * 0.84, h * 0.86, kBright[(first + 3) % 8]);
  e.layBox(-w * 0.84, -h * 0.84, w * 0.84, -h * 0.02, kBright[(first + 5) % 8]);
  e.layBox(-w * 0.78, -h * 0.26, w * 0.78, -h * 0.14, Paint::paintWhite);
}

void paintStillLife(Easel& e, Random& random) {
  const double w = e.halfWidth, h = e.halfHeight, r = h < w ? h : w;
  e.layBox(-w, -h, w, h, Paint::paintGrey);
  e.layBox(-w, -h, w, -h * 0.25, Paint::paintUmber);
  e.layBox(-w * 0.7, -h * 0.8, w * 0.5, -h * 0.3, Paint::paintWhite);
  e.layOval(-r * 0.3, h * 0.0, r * 0.26, r * 0.4, Paint::paintBlue);
  e.layBox(-r * 0.4, h * 0.3, -r * 0.2, h * 0.62, Paint::paintBlue);
  for (int i = 0; i < 5; ++i) {
    const double y = -h * random.between(0.35, 0.55);
    e.layOval(r * (-0.2 + 0.22 * i), y, r * 0.15, r * 0.15, kBright[random.below(4)]);
  }
}

void paintSomething(Easel& e, Random& random) {
  const bool upright = e.halfHeight > e.halfWidth;
  switch (random.below(6)) {
    case 0:
      return upright ? paintPortrait(e, random) : paintLandscape(e, random);
    case 1:
      return paintGrid(e, random);
    case 2:
      return upright ? paintField(e, random) : paintRings(e, random);
    case 3:
      return upright ? paintPortrait(e, random) : paintStillLife(e, random);
    case 4:
      return paintField(e, random);
    default:
      return upright ? paintPortrait(e, random) : paintLandscape(e, random);
  }
}

PaintedMesh makeFrameShape(double w, double h, Paint paint) {
  const double bar = 0.075, out = 0.055;
  PaintedMesh s;
  addBox(s, {-0.003, -h, -w}, {out, -h + bar, w}, paint);
  addBox(s, {-0.003, h - bar, -w}, {out, h, w}, paint);
  // A millimetre shallower: boxes with a shared edge would not be separate closed solids.
  const double shallower = out - 0.001;
  addBox(s, {-0.002, -h + bar, -w + 0.001}, {shallower, h - bar, -w + bar}, paint);
  addBox(s, {-0.002, -h + bar, w - bar}, {shallower, h - bar, w - 0.001}, paint);
  return s;
}

}  // namespace

void placePicture(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                  double height, Random& random) {
  const Eigen::Affine3d place = makeQuarterTurn(spot.quarters, spot.at);
  constexpr Paint kFrames[] = {Paint::gilt, Paint::gilt, Paint::mahogany, Paint::blackMetal};
  const double w = width / 2, h = height / 2;
  sketch.place(path + "/frame", makeFrameShape(w + 0.07, h + 0.07, kFrames[random.below(4)]),
               place);
  PaintedMesh canvas;
  addBox(canvas, {-0.002, -h - 0.004, -w - 0.004}, {0.02, h + 0.004, w + 0.004}, Paint::canvas);
  Easel easel{canvas, w, h};
  paintSomething(easel, random);
  sketch.place(path + "/canvas", canvas, place);
}

}  // namespace enfilade::assets
