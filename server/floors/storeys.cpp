// Steps: take the storeys of the file at their floors. If it states none: find the heights with
// much floor and walls, and for each the indoor floor near it. A lawn is larger than the floor of
// the house on it, but has no ceiling.
#include "server/floors/storeys.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "server/floors/floor_plan_section.hpp"
#include "server/floors/indoor_floors.hpp"
#include "server/floors/label_names.hpp"
#include "server/floors/storey_heights.hpp"

namespace enfilade::server {
namespace {

using scene::Aabb;

constexpr double kMinElevationRange = 0.5;  // metres between the lowest and the highest storey
constexpr double kMinFloorNormalY = 0.94;   // minimum y of a floor's normal: within 20 degrees
constexpr double kMinFloorArea = 0.5;       // square metres: minimum floor area of an object
constexpr double kMinStoreyShare = 0.04;    // minimum share of all floor area for a storey
constexpr std::size_t kMaxStoreys = 12;
constexpr double kWallBottom = 0.3, kWallTop = 1.5;  // metres above a floor that a wall spans
constexpr double kMaxFloorDistance = 0.6;  // metres between a stated elevation and its floor
constexpr double kMaxNameDistance = 0.6;   // metres between a storey's floor and its objects

/// Adds the upward faces of an object. For open shells both sides count, because their orientation
/// is unknown.
void addFloors(const scene::Scene& scene, std::uint32_t object, std::vector<FloorTriangle>& faces) {
  const scene::Shape& shape = scene.shape(object);
  const Eigen::Affine3d& worldFromMesh = scene.model().objects[object].worldFromMesh;
  const double mirror = worldFromMesh.linear().determinant() < 0 ? -1 : 1;
  for (const scene::Shell& shell : shape.shells) {
    const double outside = shell.inward ? -mirror : mirror;
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      std::array<Vec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = worldFromMesh * shape.vertices[shape.triangles[t][k]].cast<double>();
      const Vec3 normal = outside * (p[1] - p[0]).cross(p[2] - p[0]);
      const double up = shell.bounds() ? normal.y() : std::abs(normal.y());
      if (up > kMinFloorNormalY * normal.norm()) faces.push_back({p, 0.5 * up});
    }
  }
}

bool hasWallsAbove(const scene::Scene& scene, double floor) {
  return std::any_of(scene.staticBoxes().begin(), scene.staticBoxes().end(), [&](const Aabb& box) {
    return box.min.y() <= floor + kWallBottom && box.max.y() >= floor + kWallTop;
  });
}

/// Area that the outlines of an object enclose, square metres: the largest less its holes.
double computeSolidArea(const ObjectSection& section) {
  double largest = 0, sum = 0;
  for (const std::vector<Vec3>& loop : section.loops) {
    double twice = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3 &p = loop[i], &q = loop[(i + 1) % loop.size()];
      twice += p.x() * q.z() - q.x() * p.z();
    }
    largest = std::max(largest, std::abs(twice) / 2);
    sum += std::abs(twice) / 2;
  }
  return 2 * largest - sum;
}

/// Area of the floors at a height, square metres.
double sumFloors(const std::vector<WeightedHeight>& heights, double height) {
  constexpr double kSameFloor = 0.1;  // metres
  double area = 0;
  for (const WeightedHeight& one : heights)
    if (std::abs(one.height - height) <= kSameFloor) area += one.weight;
  return area;
}

/// Whether a cut above the floor goes through one solid that leaves no room on it, as a thick roof.
/// `floorArea`: square metres of floor at this height.
bool isCutSolid(const scene::Scene& scene, double floor, double floorArea) {
  constexpr double kMaxSolidShare = 0.9;
  double solid = 0;
  for (const ObjectSection& section : cutStatic(scene, floor + kPlanCutHeight))
    solid = std::max(solid, computeSolidArea(section));
  return solid > kMaxSolidShare * floorArea;
}

/// Parses the storey name from an object path: the text between `Ifc...Storey` and the next '/'.
/// Empty also for the name that converters give to a storey without one.
std::string parseStoreyName(const std::string& path) {
  const std::size_t word = path.find("IfcBuildingStorey");
  if (word == std::string::npos) return "";
  std::string name = path.substr(word + 17, path.find('/', word) - word - 17);
  while (!name.empty() && (name.front() == '_' || name.front() == ':')) name.erase(0, 1);
  name = removeGlobalId(name);
  return name == "Undefined" ? "" : name;
}

/// Finds the storey name of most objects on this floor.
std::string findStoreyName(const scene::Scene& scene, double floor) {
  std::map<std::string, std::size_t> names;
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    if (std::abs(scene.staticBoxes()[i].min.y() - floor) > kMaxNameDistance) continue;
    const std::string name = parseStoreyName(scene.model().objects[scene.solidObjects()[i]].path);
    if (!name.empty()) ++names[name];
  }
  const auto mostFrequent = std::max_element(
      names.begin(), names.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return mostFrequent == names.end() ? "" : mostFrequent->first;
}

std::vector<FloorTriangle> collectFloors(const scene::Scene& scene) {
  std::vector<FloorTriangle> faces;
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    const Vec3 size = scene.staticBoxes()[i].size();
    if (size.x() * size.z() >= kMinFloorArea) addFloors(scene, scene.solidObjects()[i], faces);
  }
  return faces;
}

std::vector<WeightedHeight> weighFloors(const std::vector<FloorTriangle>& faces) {
  std::vector<WeightedHeight> heights;
  for (const FloorTriangle& face : faces) heights.push_back({face.height(), face.area});
  return heights;
}

/// The heights with much floor, each moved to the indoor floor near it.
std::vector<double> findFloorHeights(const scene::Scene& scene,
                                     const std::vector<FloorTriangle>& faces,
                                     const std::vector<WeightedHeight>& heights) {
  std::vector<double> found;
  for (const double height : findStoreyHeights(heights, kMinStoreyShare, kMaxStoreys))
    found.push_back(hasWallsAbove(scene, height) ? findIndoorFloor(scene, faces, height) : height);
  std::ranges::sort(found);
  const auto isSame = [](double a, double b) { return std::abs(a - b) < kMinElevationRange; };
  found.erase(std::unique(found.begin(), found.end(), isSame), found.end());
  return found;
}

/// The file states the elevation of a storey's structure or of its finish: the largest floor near
/// it is the floor.
double findFloorNear(const std::vector<WeightedHeight>& heights, double elevation) {
  std::vector<WeightedHeight> near;
  for (const WeightedHeight& one : heights)
    if (std::abs(one.height - elevation) <= kMaxFloorDistance) near.push_back(one);
  const std::vector<double> found = findStoreyHeights(near, 0, 1);
  return found.empty() ? elevation : found.front();
}

std::vector<StoreyFloor> findStatedStoreys(const scene::Scene& scene,
                                           const std::vector<WeightedHeight>& heights) {
  const scene::Model& model = scene.model();
  std::set<std::uint32_t> used;
  for (const scene::Object& object : model.objects)
    if (object.storey) used.insert(*object.storey);
  // Storeys that all have one elevation, as some programs write, say nothing about heights.
  const auto elevation = [&](std::uint32_t index) { return model.storeys[index].elevation; };
  if (used.size() > 1 && elevation(*used.rbegin()) - elevation(*used.begin()) < kMinElevationRange)
    return {};
  std::vector<StoreyFloor> storeys;
  for (const std::uint32_t index : used) {
    const double height = findFloorNear(heights, model.storeys[index].elevation);
    if (hasWallsAbove(scene, height)) storeys.push_back({height, model.storeys[index].name, index});
  }
  return storeys;
}

}  // namespace

std::vector<StoreyFloor> findStoreys(const scene::Scene& scene) {
  const std::vector<FloorTriangle> faces = collectFloors(scene);
  const std::vector<WeightedHeight> heights = weighFloors(faces);
  std::vector<StoreyFloor> storeys = findStatedStoreys(scene, heights);
  if (!storeys.empty()) return storeys;
  for (const double height : findFloorHeights(scene, faces, heights)) {
    if (hasWallsAbove(scene, height) && !isCutSolid(scene, height, sumFloors(heights, height)))
      storeys.push_back({height, findStoreyName(scene, height)});
  }
  if (storeys.empty() && !scene.bounds().empty()) storeys.push_back({scene.bounds().min.y(), ""});
  return storeys;
}

}  // namespace enfilade::server
