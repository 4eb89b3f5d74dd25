// The straight stair with its landing, the railings, and the lift.
#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

using namespace plan;

constexpr double kRailHeight = 0.95;  ///< above the line of the nosings
constexpr Paint kStairPaint = Paint::limestone;

/// x of the riser of step k = 1, 2, ...
double computeStepWest(int k) {
  return kStairFoot + kTread * (k - 1) + (k > kLandingRiser ? kLanding - kTread : 0);
}

void addSteps(Sketch& sketch) {
  const double inset = 0.004;
  for (int k = 1; k <= kRisers; ++k) {
    const double x = computeStepWest(k), top = kRiser * k;
    if (k < kRisers)
      sketch.placeBox(k == kLandingRiser ? std::string("building/hall/stair/landing")
                                         : appendNumber("building/hall/stair/tread", k),
                      {x, top - 0.05, kStairLow}, {computeStepWest(k + 1) + 0.03, top, kStairHigh},
                      kStairPaint);
    sketch.placeBox(appendNumber("building/hall/stair/riser", k),
                    {x + 0.004, top - kRiser - 0.002, kStairLow + inset},
                    {x + 0.026, top - 0.048, kStairHigh - inset}, Paint::marbleWhite);
  }
}

struct Flight {
  Vec3 from, to;  ///< on the line of the nosings, in the middle of the stair
};

std::vector<Flight> makeFlights() {
  const double z = 0.5 * (kStairLow + kStairHigh);
  const double landing = kRiser * kLandingRiser;
  return {{{kStairFoot, kRiser, z}, {computeStepWest(kLandingRiser), landing, z}},
          {{computeStepWest(kLandingRiser), landing, z},
           {computeStepWest(kLandingRiser + 1), landing, z}},
          {{computeStepWest(kLandingRiser + 1), landing + kRiser, z}, {kVoidEast, kUpper, z}}};
}

void addStringersAndHandrails(Sketch& sketch) {
  int number = 0;
  for (const Flight& f : makeFlights()) {
    ++number;
    for (const double side : {-1.0, 1.0}) {
      const double z = side < 0 ? kStairLow - 0.04 : kStairHigh + 0.04;
      const std::string hand = side < 0 ? "left" : "right";
      const auto addBar = [&](const std::string& name, double up, double width, double height,
                              Paint paint) {
        PaintedMesh shape;
        const Vec3 run{f.to.x() - f.from.x(), f.to.y() - f.from.y(), 0};
        addSlopedBar(shape, {-0.01, 0, 0}, run + Vec3{0.01, 0, 0}, width, height, paint);
        sketch.place("building/hall/stair/" + name + "_" + hand + std::to_string(number), shape,
                     makeTranslation({f.from.x(), f.from.y() + up, z}));
      };
      addBar("stringer", -0.14, 0.08, 0.42, Paint::facadeTrim);
      addBar("handrail", kRailHeight, 0.06, 0.05, Paint::mahogany);
    }
  }
}

PaintedMesh makeBalusterShape(double height) {
  PaintedMesh s;
  addTurned(s, Vec3::Zero(),
            {{0.018, 0},
             {0.018, 0.05},
             {0.01, 0.07},
             {0.01, height * 0.5 - 0.05},
             {0.018, height * 0.5},
             {0.01, height * 0.5 + 0.05},
             {0.01, height}},
            8, Paint::darkIron);
  return s;
}

PaintedMesh makeNewelShape(double height) {
  PaintedMesh s;
  addBox(s, {-0.06, 0, -0.06}, {0.06, height, 0.06}, Paint::mahogany);
  addBox(s, {-0.075, height - 0.03, -0.075}, {0.075, height, 0.075}, Paint::mahogany);
  addBall(s, {0, height + 0.06, 0}, {0.07, 0.07, 0.07}, 12, Paint::brass);
  return s;
}

/// Adds balusters on the stringers, two a tread.
void addStairBalusters(Sketch& sketch) {
  const PaintedMesh baluster = makeBalusterShape(kRailHeight - 0.04);
  int number = 0;
  for (const Flight& f : makeFlights()) {
    const double run = f.to.x() - f.from.x();
    const int count = static_cast<int>(run / 0.15);
    for (int i = 0; i < count; ++i) {
      const double t = (i + 0.5) / count;
      const Vec3 foot{f.from.x() + run * t, f.from.y() + (f.to.y() - f.from.y()) * t + 0.06, 0};
      ++number;
      sketch.place(appendNumber("building/hall/stair/baluster_left", number), baluster,
                   makeTranslation({foot.x(), foot.y(), kStairLow - 0.04}));
      sketch.place(appendNumber("building/hall/stair/baluster_right", number), baluster,
                   makeTranslation({foot.x(), foot.y(), kStairHigh + 0.04}));
    }
  }
  for (const double z : {kStairLow - 0.04, kStairHigh + 0.04}) {
    const std::string hand = z < kStairLow ? "left" : "right";
    sketch.place("building/hall/stair/newel_foot_" + hand, makeNewelShape(1.15),
                 makeTranslation({kStairFoot - 0.05, 0, z}));
    sketch.place("building/hall/stair/newel_head_" + hand, makeNewelShape(1.15),
                 makeTranslation({kVoidEast + 0.06, kUpper, z}));
  }
}

/// Adds one straight run of railing on the upper floor.
void addRailing(Sketch& sketch, const std::string& path, Wall::Axis along, double from, double to,
                double across) {
  const double y = kUpper;
  placeWallBox(sketch, path + "/handrail", along, {from, y + 1.03, across - 0.035},
               {to, y + 1.08, across + 0.035}, Paint::mahogany);
  placeWallBox(sketch, path + "/bottom_rail", along, {from, y + 0.08, across - 0.02},
               {to, y + 0.11, across + 0.02}, Paint::darkIron);
  const PaintedMesh baluster = makeBalusterShape(0.935);
  const int count = static_cast<int>((to - from) / 0.14);
  for (int i = 0; i < count; ++i) {
    const double a = from + (to - from) * (i + 0.5) / count;
    sketch.place(appendNumber(path + "/baluster", i + 1), baluster,
                 makeTranslation(makeWallPoint(along, a, y + 0.1, across)));
  }
}

}  // namespace

void addStair(Sketch& sketch) {
  addSteps(sketch);
  addStringersAndHandrails(sketch);
  addStairBalusters(sketch);
  // A carpet along the middle of the stair.
  for (int k = 1; k < kRisers; ++k) {
    const double y = kRiser * k;
    sketch.placeBox(appendNumber("building/hall/stair/carpet", k),
                    {computeStepWest(k) + 0.012, y - 0.001, -4.75},
                    {computeStepWest(k + 1) - 0.004, y + 0.007, -3.45}, Paint::rugRed);
  }
}

void addGalleryRailing(Sketch& sketch) {
  const double inset = 0.08;
  const double x0 = kVoidWest - inset, x1 = kVoidEast + inset, z = kVoidHalf + inset;
  const std::string path = "building/hall/gallery/railing_";
  addRailing(sketch, path + "north", Wall::Axis::x, x0, x1, -z);
  addRailing(sketch, path + "south", Wall::Axis::x, x0, x1, z);
  addRailing(sketch, path + "west", Wall::Axis::z, -z + 0.04, z - 0.04, x0);
  addRailing(sketch, path + "east_a", Wall::Axis::z, -z + 0.04, kStairLow - 0.1, x1);
  addRailing(sketch, path + "east_b", Wall::Axis::z, kStairHigh + 0.1, z - 0.04, x1);
}

void addLift(Sketch& sketch) {
  const double t = 0.15, top = kUpperCeiling, mid = 0.5 * (kLiftWest + kLiftEast);
  const std::string path = "building/lift/";
  const Paint wall = Paint::wallIvory, inner = Paint::concrete;
  sketch.placeBox(path + "shaft/west", {kLiftWest, -0.06, kLiftNorth},
                  {kLiftWest + t, top, kLiftSouth}, {wall, inner, inner, inner, inner, wall});
  sketch.placeBox(path + "shaft/east", {kLiftEast - t, -0.06, kLiftNorth},
                  {kLiftEast, top, kLiftSouth}, {inner, wall, inner, inner, inner, wall});
  const Wall front{Wall::Axis::x, kLiftWest + t, kLiftEast - t, kLiftSouth - t, kLiftSouth, -0.06,
                   top,           inner,         wall};
  std::vector<Opening> doors;
  for (const double floor : {0.0, kUpper})
    doors.push_back({mid - 0.5, mid + 0.5, floor, floor + 2.1});
  addWall(sketch, path + "shaft/front", front, doors);
  sketch.placeBox(path + "shaft/pit_floor", {kLiftWest + t, -0.06, kLiftNorth},
                  {kLiftEast - t, -0.03, kLiftSouth - t}, Paint::concrete);
  int storey = 0;
  for (const Opening& o : doors) {
    const std::string level = path + (storey++ ? "upper" : "ground");
    addCasing(sketch, level + "/frame", front, o, true, Paint::steel);  // the cabin needs the other
                                                                        // side
    // Two leaves that slide apart inside the shaft's front wall.
    for (const double side : {-1.0, 1.0}) {
      const double a = side < 0 ? mid - 0.5 : mid + 0.0015;
      const double z = kLiftSouth - t / 2;
      sketch.placeBox(level + (side < 0 ? "/door_west" : "/door_east"),
                      {a, o.bottom + 0.01, z - 0.02}, {a + 0.4985, o.top - 0.005, z + 0.02},
                      Paint::chrome);
      sketch.setJoint(MovingPart::Kind::slide, {side, 0, 0}, 0,
                      0.44);  // as far as the shaft's wall
    }
    sketch.placeBox(level + "/sill", {mid - 0.5, o.bottom - 0.02, kLiftSouth - t - 0.005},
                    {mid + 0.5, o.bottom + 0.002, kLiftSouth + 0.005}, Paint::steel);
    sketch.placeBox(level + "/call_button", {mid + 0.75, o.bottom + 1.05, kLiftSouth - 0.003},
                    {mid + 0.85, o.bottom + 1.25, kLiftSouth + 0.015}, Paint::screenGlow);
  }
  const double x0 = kLiftWest + t + 0.06, x1 = kLiftEast - t - 0.06;
  const double z0 = kLiftNorth + 0.06, z1 = kLiftSouth - t - 0.05, d = 0.03;
  PaintedMesh cabin;
  const Vec3 at{mid, 0, 0.5 * (z0 + z1)};
  const double hx = (x1 - x0) / 2, hz = (z1 - z0) / 2;
  addBox(cabin, {-hx, -0.02, -hz}, {hx, 0.001, hz}, Paint::slateTile);
  addBox(cabin, {-hx, 0, -hz}, {-hx + d, 2.3, hz}, Paint::steel);
  addBox(cabin, {hx - d, 0, -hz}, {hx, 2.3, hz}, Paint::steel);
  addBox(cabin, {-hx + d, 0, -hz + 0.001}, {hx - d, 2.3, -hz + d}, Paint::chrome);
  addBox(cabin, {-hx, 2.298, -hz}, {hx, 2.36, hz}, Paint::steel);
  addBox(cabin, {-0.3, 2.28, -0.3}, {0.3, 2.299, 0.3}, Paint::lampGlow);
  addRod(cabin, {-hx + 0.1, 0.95, -hz + 0.08}, {hx - 0.1, 0.95, -hz + 0.08}, 0.015, 8,
         Paint::chrome);
  sketch.place(path + "cabin", cabin, makeTranslation(at));
  sketch.setJoint(MovingPart::Kind::slide, {0, 1, 0}, 0, kUpper);
  // A static roof: only the space above the cabin at its upper stop.
  const double roof = kUpper + 2.4;
  PaintedMesh cable;
  addRod(cable, {0, 0, 0}, {0, top - roof - 0.045, 0}, 0.012, 8, Paint::darkIron);
  sketch.place(path + "cable", cable, makeTranslation({mid, roof, at.z()}));
}

}  // namespace enfilade::assets
