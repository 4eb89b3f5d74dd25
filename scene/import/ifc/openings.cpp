// Whether doors and windows stand in holes. Readers of IFC cut openings out of walls by solid
// modelling, which can fail in silence; what is left then is a wall that nobody can walk through.
//
// Through each door and window a grid of rays is sent, square to its host, and met with the host's
// triangles alone. The opening is taken for cut where nearly all pass: a bar or a sill may stand in
// the way of a few. Files that do not say whose opening a door or window fills leave out
// IfcRelVoidsElement or IfcRelFillsElement: its hosts are then the walls that it stands in.
#include <algorithm>
#include <cmath>
#include <map>

#include "scene/import/ifc/import_ifc.hpp"

namespace enfilade::scene {
namespace {

constexpr int kGrid = 3;                // rays in a row
constexpr int kEnough = 7;              // of kGrid * kGrid that have to pass
constexpr double kBeyond = 0.5;         // metres that a ray goes on before and behind the door
constexpr double kOblong = 1.5;         // a door's leaf drawn open makes its box square
constexpr double kAlike = 0.2;          // OverallWidth and the box' width, relative
constexpr double kAbuts = 0.05;         // metres that a wall beside a door may reach into its box
constexpr std::size_t kMostNamed = 10;  // openings in one problem

/// The door's or window's box in its own placement: x and y level, z up.
struct Frame {
  Eigen::Affine3d worldFromFrame;
  Box box;      // metres
  int through;  // 0 or 1: the level axis that goes through the wall
};

Eigen::Affine3d frameFromMeshOf(const Frame& frame, const Object& object) {
  return frame.worldFromFrame.inverse(Eigen::Isometry) * object.worldFromMesh;
}

Box boxOf(const Model& model, const Object& object, const Eigen::Affine3d& toFrame) {
  Box box;
  for (const std::uint32_t mesh : object.meshes)
    for (const std::uint32_t i : model.meshes[mesh].indices)
      box.include(toFrame * model.meshes[mesh].positions[i].cast<double>());
  return box;
}

/// The axis that is not the door's width.
int throughAxis(const Object& object, const Vec3& size) {
  const auto like = [&](double extent) {
    return object.overallWidth > 0 &&
           std::abs(extent - object.overallWidth) <= kAlike * object.overallWidth;
  };
  if (size.x() > kOblong * size.y()) return 1;
  if (size.y() > kOblong * size.x()) return 0;
  return !like(size.x()) && like(size.y()) ? 0 : 1;
}

std::optional<Frame> frameOf(const Model& model, const Object& object) {
  if (!object.worldFromPlacement) return std::nullopt;
  Frame frame{*object.worldFromPlacement, {}, 1};
  frame.box = boxOf(model, object, frameFromMeshOf(frame, object));
  if (frame.box.empty()) return std::nullopt;
  frame.through = throughAxis(object, frame.box.size());
  return frame;
}

using Corners = std::array<Vec3, 3>;

/// Möller and Trumbore, Fast, minimum storage ray/triangle intersection (1997): a segment from
/// `from` along `way` against a triangle.
bool meets(const Vec3& from, const Vec3& way, const Corners& triangle) {
  const Vec3 a = triangle[1] - triangle[0], b = triangle[2] - triangle[0];
  const Vec3 p = way.cross(b);
  const double determinant = a.dot(p);
  if (determinant == 0) return false;  // seen from its edge
  const Vec3 s = from - triangle[0];
  const double u = s.dot(p) / determinant;
  const Vec3 q = s.cross(a);
  const double v = way.dot(q) / determinant;
  const double t = b.dot(q) / determinant;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1;
}

/// The triangles of `hosts` near the door, in its frame.
std::vector<Corners> trianglesNear(const Model& model, const std::vector<const Object*>& hosts,
                                   const Frame& frame) {
  const Box reach = grown(frame.box, kBeyond);
  std::vector<Corners> near;
  for (const Object* host : hosts) {
    const Eigen::Affine3d frameFromMesh = frameFromMeshOf(frame, *host);
    for (const std::uint32_t index : host->meshes) {
      const Mesh& mesh = model.meshes[index];
      for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        Corners corners;
        Box box;
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = frameFromMesh * mesh.positions[mesh.indices[i + k]].cast<double>();
          box.include(corners[k]);
        }
        if (collision::overlaps(box, reach)) near.push_back(corners);
      }
    }
  }
  return near;
}

int raysThatPass(const Frame& frame, const std::vector<Corners>& triangles) {
  const int across = 1 - frame.through;
  const Vec3 size = frame.box.size();
  int passed = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const double column = (i % kGrid + 1.0) / (kGrid + 1), row = (i / kGrid + 1.0) / (kGrid + 1);
    Vec3 from = frame.box.min;
    from[across] += column * size[across];
    from.z() += row * size.z();
    from[frame.through] -= kBeyond;
    Vec3 way = Vec3::Zero();
    way[frame.through] = size[frame.through] + 2 * kBeyond;
    const bool blocked = std::any_of(triangles.begin(), triangles.end(),
                                     [&](const Corners& t) { return meets(from, way, t); });
    if (!blocked) ++passed;
  }
  return passed;
}

/// Objects by the express ids of what they are and of what they are parts of.
std::multimap<std::uint32_t, const Object*> objectsByProduct(
    const std::map<std::string, const IfcProduct*>& products, const Model& model) {
  std::multimap<std::uint32_t, const Object*> objects;
  for (const Object& object : model.objects) {
    const auto product = products.find(object.globalId);
    if (product == products.end()) continue;
    objects.emplace(product->second->id, &object);
    if (product->second->parent != 0) objects.emplace(product->second->parent, &object);
  }
  return objects;
}

/// Doors and windows, and whatever else is said to fill an opening.
bool fillsOpenings(const IfcProduct& product) {
  return product.host != 0 || product.ifcClass.starts_with("IfcDoor") ||
         product.ifcClass.starts_with("IfcWindow");
}

struct Wall {
  const Object* object;
  Box box;  ///< scene frame
};

/// Walls and the parts of walls.
std::vector<Wall> wallsOf(const Model& model, const IfcFacts& facts,
                          const std::map<std::string, const IfcProduct*>& products) {
  const auto isWall = [](const IfcProduct* product) {
    return product != nullptr && product->ifcClass.starts_with("IfcWall");
  };
  const auto isPartOfWall = [&](const IfcProduct& product) {
    return isWall(facts.find(product.parent)) && !fillsOpenings(product);
  };
  std::vector<Wall> walls;
  for (const Object& object : model.objects) {
    const auto product = products.find(object.globalId);
    if (product == products.end()) continue;
    if (isWall(product->second) || isPartOfWall(*product->second))
      walls.push_back({&object, boxOf(model, object, object.worldFromMesh)});
  }
  return walls;
}

/// The walls that reach into the door's box, both in the door's frame: there the box of the wall
/// that it stands in is tight. A leaf drawn open or a window before the facade has its middle
/// beside it.
std::vector<const Object*> wallsAround(const Model& model, const std::vector<Wall>& walls,
                                       const Frame& frame) {
  const Vec3 margin = (0.25 * frame.box.size()).cwiseMin(kAbuts);
  const Box inner{frame.box.min + margin, frame.box.max - margin};
  const Vec3 middle = frame.worldFromFrame * inner.centre();
  const Box inWorld = grown(Box{middle, middle}, 0.5 * inner.size().norm());
  const auto meets = [](const Box& box, const Box& other) {
    return !box.empty() && collision::overlaps(box, other);
  };
  std::vector<const Object*> around;
  for (const Wall& wall : walls)
    if (meets(wall.box, inWorld) &&
        meets(boxOf(model, *wall.object, frameFromMeshOf(frame, *wall.object)), inner))
      around.push_back(wall.object);
  return around;
}

}  // namespace

OpeningCheck checkOpenings(const Model& model, const IfcFacts& facts) {
  std::map<std::string, const IfcProduct*> products;
  for (const IfcProduct& product : facts.products) products.emplace(product.globalId, &product);
  const auto objects = objectsByProduct(products, model);
  std::optional<std::vector<Wall>> walls;  // few files ask for them
  OpeningCheck check;
  for (const Object& object : model.objects) {
    const auto product = products.find(object.globalId);
    if (product == products.end() || !fillsOpenings(*product->second)) continue;
    const std::uint32_t host = product->second->host;
    const std::optional<Frame> frame = frameOf(model, object);
    if (!frame) {
      if (host != 0) check.unchecked.push_back(&object);
      continue;
    }
    std::vector<const Object*> hosts;
    const auto [begin, end] = objects.equal_range(host);
    for (auto one = begin; one != end; ++one)
      if (one->second != &object) hosts.push_back(one->second);
    if (host == 0) {
      if (!walls) walls = wallsOf(model, facts, products);
      hosts = wallsAround(model, *walls, *frame);
    }
    const int passed = raysThatPass(*frame, trianglesNear(model, hosts, *frame));
    ++check.looked;
    if (passed < kEnough) check.uncut.push_back({&object, host, passed});
  }
  return check;
}

void reportOpenings(const OpeningCheck& check, ProblemLog& problems) {
  for (const Object* object : check.unchecked) {
    problems.add("opening_unchecked", object->globalId + " (" + object->path + ")");
  }
  std::string named;
  for (std::size_t i = 0; i < check.uncut.size() && i < kMostNamed; ++i) {
    const UncutOpening& uncut = check.uncut[i];
    named += (named.empty() ? "" : "; ") + uncut.object->globalId + " (" + uncut.object->path +
             "): " + std::to_string(uncut.raysPassed) + " of " + std::to_string(kGrid * kGrid) +
             " rays pass";
  }
  problems.add("uncut_opening", named, check.uncut.size());
}

}  // namespace enfilade::scene
