// District generator: a few prototypes, built once, are placed repeatedly on the blocks of a street
// grid.
#include <cmath>
#include <stdexcept>

#include "assets/building.hpp"
#include "assets/house.hpp"
#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

constexpr double kStreet = 12;                     ///< width of a street, kerb to kerb
constexpr double kBlockX = 96, kBlockZ = 60;       ///< of a block with half of its streets
constexpr int kHouses = 12, kHousesPerBlock = 12;  ///< prototypes; lots in a block
constexpr int kGalleryEvery = 7;                   ///< one block in so many is a gallery

/// A building whose meshes are already in the district's model.
struct Prototype {
  std::vector<scene::Object> objects;
};

/// Moves the meshes of `from` to `model`, once, and keeps its objects as a prototype.
Prototype adopt(scene::Model& model, scene::Model from, const std::string& leaveOut) {
  const auto first = static_cast<std::uint32_t>(model.meshes.size());
  for (scene::Mesh& mesh : from.meshes) model.meshes.push_back(std::move(mesh));
  Prototype prototype;
  for (scene::Object& object : from.objects) {
    if (object.path == leaveOut) continue;
    for (std::uint32_t& mesh : object.meshes) mesh += first;
    prototype.objects.push_back(std::move(object));
  }
  return prototype;
}

struct District {
  scene::Model model;
  std::size_t wanted;
  std::vector<Prototype> houses;
  Prototype gallery, tree, lamp, street;

  std::size_t countLeft() const { return wanted - model.objects.size(); }
};

/// Places a whole prototype; places nothing if it would exceed the number of objects.
bool place(District& d, const Prototype& prototype, const std::string& path,
           const Eigen::Affine3d& worldFromLocal) {
  if (prototype.objects.size() > d.countLeft()) return false;
  for (const scene::Object& object : prototype.objects) {
    d.model.objects.push_back(object);
    scene::Object& placed = d.model.objects.back();
    placed.path = path + '/' + object.path;
    placed.worldFromMesh = worldFromLocal * object.worldFromMesh;
  }
  return true;
}

void addLampPost(Sketch& sketch) {
  PaintedMesh s;
  addTurned(s, Vec3::Zero(), {{0.12, 0}, {0.12, 0.1}, {0.05, 0.2}, {0.04, 4.0}}, 12,
            Paint::darkIron);
  addBall(s, {0, 4.15, 0}, {0.2, 0.2, 0.2}, 12, Paint::lampGlow);
  sketch.place("lamp_post", s, makeTranslation(Vec3::Zero()));
}

/// Adds the flat surfaces of a block: pavement, the streets west and north of it, their stripes.
void addStreet(Sketch& sketch) {
  const double x = kBlockX / 2, z = kBlockZ / 2, half = kStreet / 2;
  sketch.placeBox("pavement", {-x + half, -0.3, -z + half}, {x - half, -0.0, z - half},
                  Paint::paving);
  sketch.placeBox("road_west", {-x - half, -0.3, -z + half}, {-x + half, -0.12, z - half},
                  Paint::asphalt);
  sketch.placeBox("road_north", {-x - half, -0.3, -z - half}, {x - half, -0.12, -z + half},
                  Paint::asphalt);
  for (int i = 0; i < 10; ++i) {
    const double at = -x + 9 + 8.4 * i;
    sketch.placeBox(appendNumber("stripe", i + 1), {at, -0.13, -z - 0.08},
                    {at + 3, -0.116, -z + 0.08}, Paint::roadPaint);
  }
}

template <typename Add>
Prototype makePrototype(scene::Model& model, Add add) {
  Sketch sketch;
  add(sketch);
  return adopt(model, std::move(sketch.model()), "");
}

District prepareDistrict(std::size_t objects, std::uint64_t seed) {
  District d;
  d.wanted = objects;
  d.model.source =
      "district of " + std::to_string(objects) + " objects, seed " + std::to_string(seed);
  d.model.materials = makePaletteMaterials();
  d.model.objects.reserve(objects);
  Random random(seed);
  d.gallery = adopt(d.model, makeBuilding({random.next(), 0}), "grounds/lawn");
  for (int i = 0; i < kHouses; ++i)
    d.houses.push_back(makePrototype(d.model, [&](Sketch& s) { addHouse(s, random); }));
  d.tree = makePrototype(d.model, [&](Sketch& s) { addTree(s, "tree", Vec3::Zero(), random); });
  d.lamp = makePrototype(d.model, addLampPost);
  d.street = makePrototype(d.model, addStreet);
  return d;
}

/// Places two rows of houses, back to back. False if the next house would exceed the number of
/// objects.
bool fillWithHouses(District& d, const std::string& block, const Vec3& middle, Random& random) {
  constexpr int kRow = kHousesPerBlock / 2;
  for (int i = 0; i < kHousesPerBlock; ++i) {
    const bool north = i >= kRow;
    const double x = (kBlockX - kStreet) * ((i % kRow + 0.5) / kRow - 0.5);
    const Vec3 at = middle + Vec3{x, 0, north ? -12.0 : 12.0};
    const auto kind = static_cast<std::size_t>(random.below(kHouses));
    if (!place(d, d.houses[kind], appendNumber(block + "/house", i + 1),
               makeQuarterTurn(north ? 2 : 0, at)))
      return false;
  }
  return true;
}

/// Places trees and lamps along the kerbs.
void plantStreet(District& d, const std::string& block, const Vec3& middle) {
  const double z = (kBlockZ - kStreet) / 2 - 1.2;
  for (int i = 0; i < 8; ++i) {
    const double x = (kBlockX - kStreet) * ((i + 0.25) / 8 - 0.5);
    const Prototype& what = i % 2 ? d.lamp : d.tree;
    place(d, what, appendNumber(block + "/south", i + 1), makeTranslation(middle + Vec3{x, 0, z}));
    place(d, what, appendNumber(block + "/north", i + 1), makeTranslation(middle + Vec3{x, 0, -z}));
  }
}

/// Places bollards along the edge of the last block, until the number of objects is exact.
void fillUp(District& d, const Vec3& middle) {
  for (int i = 0; d.countLeft() > 0; ++i) {
    const int row = i / 160;
    const Vec3 at{-38 + 0.48 * (i % 160), 0, -20 + 2.0 * row};
    scene::Object bollard = d.lamp.objects.front();
    bollard.path = "district/bollards/bollard" + std::to_string(i + 1);
    bollard.worldFromMesh = makeTranslation(middle + at) * Eigen::Scaling(0.6, 0.22, 0.6);
    d.model.objects.push_back(std::move(bollard));
  }
}

}  // namespace

scene::Model makeDistrict(std::size_t objects, std::uint64_t seed) {
  if (objects < kMinDistrictObjects)
    throw std::invalid_argument("a district has at least " + std::to_string(kMinDistrictObjects) +
                                " objects, not " + std::to_string(objects) +
                                "; omit the number for the gallery alone");
  District d = prepareDistrict(objects, seed);
  Random random(seed + 1);
  const double blocks = static_cast<double>(objects) / 4000.0 + 1;
  const int columns = static_cast<int>(std::sqrt(blocks * kBlockZ / kBlockX)) + 1;
  Vec3 middle = Vec3::Zero();
  bool room = true;
  int number = 0;
  for (; room && d.countLeft() > 0; ++number) {
    const std::string block = "district/block" + std::to_string(number + 1);
    middle = {kBlockX * (number % columns), 0, kBlockZ * (number / columns)};
    room = place(d, d.street, block, makeTranslation(middle));
    if (!room) break;
    if (number % kGalleryEvery == 0)
      room = place(d, d.gallery, block + "/gallery",
                   makeTranslation(middle + Vec3{-26, -plan::kGround + 0.005, 0}));
    else
      room = fillWithHouses(d, block, middle, random);
    if (room) plantStreet(d, block, middle);
  }
  fillUp(d, {kBlockX * (number % columns), 0, kBlockZ * (number / columns)});
  return std::move(d.model);
}

}  // namespace enfilade::assets
