#include "assets/feeder.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "assets/random.hpp"
#include "assets/sketch.hpp"

namespace enfilade::assets {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kTrayFloor = 0.9;  // metres: height of the tray's floor
constexpr double kPlate = 0.02;     // thickness of the tray's plates
constexpr double kWall = 0.25;      // height of its walls
constexpr double kGap = 0.01;       // between the tray, nearly at its lowest point, and its stand
constexpr double kSpacing = 0.026;  // initial distance of parts: more than the length of any
constexpr std::size_t kMaxParts = 20000;

constexpr int kKeys = 16;                     // per period; 240 a second, one a substep
constexpr double kPeriod = 16.0 / 240;        // seconds
constexpr double kUp = 2e-3, kSide = 0.5e-3;  // metres: 1.8 times gravity at 15 Hz

/// Half the tray's inner width, for about two layers.
double computeInnerHalfWidth(std::size_t parts) {
  const double across = std::ceil(std::sqrt(static_cast<double>(parts) / 4));
  return 0.5 * kSpacing * across;
}

PaintedMesh makeTurnedPart(double radius, double halfHeight, double top, int sides, Paint paint) {
  PaintedMesh shape;
  addTurned(shape, Vec3::Zero(), {{radius, -halfHeight}, {top * radius, halfHeight}}, sides, paint);
  return shape;
}

std::array<PaintedMesh, 5> makePartKinds() {
  std::array<PaintedMesh, 5> kinds;
  addBox(kinds[0], Vec3(-0.010, -0.005, -0.007), Vec3(0.010, 0.005, 0.007), Paint::steel);
  kinds[1] = makeTurnedPart(0.009, 0.004, 1, 6, Paint::brass);
  addPrism(kinds[2], {{-0.009, -0.005}, {0.009, -0.005}, {0, 0.010}},
           {Vec3(0, 0, -0.006), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}, 0.012, Paint::chrome);
  kinds[3] = makeTurnedPart(0.006, 0.010, 0.7, 8, Paint::darkIron);
  kinds[4] = makeTurnedPart(0.010, 0.003, 0.5, 4, Paint::blackMetal);
  return kinds;
}

/// Uniform over all rotations, without a sine: a random point in the unit ball of quaternions,
/// normalised.
Eigen::Quaterniond makeRandomRotation(Random& random) {
  while (true) {  // ends: three of ten points are accepted
    Eigen::Vector4d q;
    for (int i = 0; i < 4; ++i) q[i] = random.between(-1, 1);
    const double squared = q.squaredNorm();
    if (squared > 1 || squared < 0.01) continue;
    q /= std::sqrt(squared);
    return {q[0], q[1], q[2], q[3]};
  }
}

void placeTray(Sketch& sketch, double in) {
  const double out = in + kPlate, top = kTrayFloor + kWall;
  const Paint paint = Paint::paintedWood;
  sketch.placeBox("feeder/tray/floor", {-out, kTrayFloor - kPlate, -out}, {out, kTrayFloor, out},
                  paint);
  sketch.placeBox("feeder/tray/west", {-out, kTrayFloor, -out}, {-in, top, out}, paint);
  sketch.placeBox("feeder/tray/east", {in, kTrayFloor, -out}, {out, top, out}, paint);
  sketch.placeBox("feeder/tray/north", {-in, kTrayFloor, -out}, {in, top, -in}, paint);
  sketch.placeBox("feeder/tray/south", {-in, kTrayFloor, in}, {in, top, out}, paint);
}

void placeParts(Sketch& sketch, const FeederOptions& options, double in) {
  Random random(options.seed);
  const std::array<PaintedMesh, 5> kinds = makePartKinds();
  const auto across = static_cast<std::size_t>(std::lround(2 * in / kSpacing));
  for (std::size_t i = 0; i < options.parts; ++i) {
    const std::size_t row = i % across, column = i / across % across, layer = i / across / across;
    const Vec3 cell(static_cast<double>(row) + 0.5, static_cast<double>(layer) + 0.7,
                    static_cast<double>(column) + 0.5);
    Eigen::Affine3d worldFromPart = Eigen::Affine3d::Identity();
    worldFromPart.linear() = makeRandomRotation(random).toRotationMatrix();
    worldFromPart.translation() = kSpacing * cell + Vec3(-in, kTrayFloor, -in);
    sketch.place(appendNumber("feeder/part", static_cast<int>(i + 1)), kinds[i % kinds.size()],
                 worldFromPart);
  }
}

Json makeDriveKeys() {
  const std::vector<Vec2> circle = makeUnitCircle(kKeys);
  Json keys = Json::array();
  for (int i = 0; i <= kKeys; ++i) {
    const double sine = i % (kKeys / 2) == 0 ? 0 : circle[static_cast<std::size_t>(i % kKeys)].y();
    keys.push_back({{"time", kPeriod * i / kKeys}, {"offset", {kSide * sine, kUp * sine, 0}}});
  }
  return keys;
}

}  // namespace

scene::Model makeFeeder(const FeederOptions& options) {
  if (options.parts < 1 || options.parts > kMaxParts)
    throw std::invalid_argument("a feeder has 1 to " + std::to_string(kMaxParts) + " parts");
  const double in = computeInnerHalfWidth(options.parts), out = in + kPlate;
  Sketch sketch;
  sketch.placeBox("room/floor", {-out - 3, -0.2, -out - 3}, {out + 3, 0, out + 3}, Paint::concrete);
  sketch.placeBox("room/stand", {-out, 0, -out}, {out, kTrayFloor - kPlate - kGap, out},
                  Paint::oakDark);
  placeTray(sketch, in);
  placeParts(sketch, options, in);
  return sketch.model();
}

std::string makeFeederSidecar() {
  const Json tray{{"name", "tray"},
                  {"kind", "path"},
                  {"objects", {"feeder/tray/*"}},
                  {"loops", true},
                  {"keys", makeDriveKeys()}};
  const Json parts{{"name", "part"}, {"kind", "rigid"}, {"objects", {"feeder/part*"}},
                   {"each", true},   {"density", 2700}, {"friction", 0.4}};
  return Json{{"walk", 1}, {"bodies", {tray, parts}}}.dump(1) + "\n";
}

}  // namespace enfilade::assets
