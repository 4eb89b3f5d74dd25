#include "scene/import/ifc/openings.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/object_box.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinWallShare = 1.2;  // of the area of its doors and windows: a frame has less

constexpr int kGridSize = 3;              // rays per row
constexpr int kMinRaysPassed = 7;         // of kGridSize * kGridSize rays that must pass
constexpr double kRayMargin = 0.5;        // metres by which a ray extends the box on both sides
constexpr double kMinAspectRatio = 1.5;   // below it, the box is ambiguous: a leaf drawn open
constexpr double kWidthTolerance = 0.2;   // relative difference of OverallWidth and the box' width
constexpr double kMaxWallOverlap = 0.05;  // metres by which an adjacent wall may overlap the box
constexpr std::size_t kMaxReported = 10;  // openings listed in one diagnostic

/// The door's or window's box in its own placement: x and y horizontal, z up.
struct OpeningFrame {
  Eigen::Affine3d worldFromFrame;
  Aabb box;        // metres
  int normalAxis;  // 0 or 1: the horizontal axis normal to the wall
};

Eigen::Affine3d computeFrameFromMesh(const OpeningFrame& frame, const Object& object) {
  return frame.worldFromFrame.inverse(Eigen::Isometry) * object.worldFromMesh;
}

/// The horizontal axis that is not the door's width.
int findNormalAxis(const Object& object, const Vec3& size) {
  const auto like = [&](double extent) {
    return object.overallWidth > 0 &&
           std::abs(extent - object.overallWidth) <= kWidthTolerance * object.overallWidth;
  };
  if (size.x() > kMinAspectRatio * size.y()) return 1;
  if (size.y() > kMinAspectRatio * size.x()) return 0;
  return !like(size.x()) && like(size.y()) ? 0 : 1;
}

std::optional<OpeningFrame> computeOpeningFrame(const Model& model, const Object& object) {
  if (!object.worldFromPlacement) return std::nullopt;
  OpeningFrame frame{*object.worldFromPlacement, {}, 1};
  frame.box = computeObjectAabb(model, object, computeFrameFromMesh(frame, object));
  if (frame.box.empty()) return std::nullopt;
  frame.normalAxis = findNormalAxis(object, frame.box.size());
  return frame;
}

using Corners = std::array<Vec3, 3>;

/// Intersects the segment from `from` to `from + displacement` with a triangle (Möller and Trumbore
/// 1997, "Fast, minimum storage ray/triangle intersection").
bool intersectsSegment(const Vec3& from, const Vec3& displacement, const Corners& triangle) {
  const Vec3 a = triangle[1] - triangle[0], b = triangle[2] - triangle[0];
  const Vec3 p = displacement.cross(b);
  const double determinant = a.dot(p);
  if (determinant == 0) return false;  // parallel to the triangle
  const Vec3 s = from - triangle[0];
  const double u = s.dot(p) / determinant;
  const Vec3 q = s.cross(a);
  const double v = displacement.dot(q) / determinant;
  const double t = b.dot(q) / determinant;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1;
}

/// The hosts' triangles near the door, in the door's frame.
std::vector<Corners> collectNearbyTriangles(const Model& model,
                                            const std::vector<const Object*>& hosts,
                                            const OpeningFrame& frame) {
  const Aabb searchBox = inflate(frame.box, kRayMargin);
  std::vector<Corners> nearby;
  for (const Object* host : hosts) {
    const Eigen::Affine3d frameFromMesh = computeFrameFromMesh(frame, *host);
    for (const std::uint32_t index : host->meshes) {
      const Mesh& mesh = model.meshes[index];
      for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        Corners corners;
        Aabb box;
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = frameFromMesh * mesh.positions[mesh.indices[i + k]].cast<double>();
          box.include(corners[k]);
        }
        if (collision::overlaps(box, searchBox)) nearby.push_back(corners);
      }
    }
  }
  return nearby;
}

int countRaysPassed(const OpeningFrame& frame, const std::vector<Corners>& triangles) {
  const int across = 1 - frame.normalAxis;
  const Vec3 size = frame.box.size();
  int passed = 0;
  for (int i = 0; i < kGridSize * kGridSize; ++i) {
    const double column = (i % kGridSize + 1.0) / (kGridSize + 1),
                 row = (i / kGridSize + 1.0) / (kGridSize + 1);
    Vec3 from = frame.box.min;
    from[across] += column * size[across];
    from.z() += row * size.z();
    from[frame.normalAxis] -= kRayMargin;
    Vec3 displacement = Vec3::Zero();
    displacement[frame.normalAxis] = size[frame.normalAxis] + 2 * kRayMargin;
    const bool blocked = std::any_of(triangles.begin(), triangles.end(), [&](const Corners& t) {
      return intersectsSegment(from, displacement, t);
    });
    if (!blocked) ++passed;
  }
  return passed;
}

/// Objects by the express ids of their products and of the products' parents.
std::multimap<std::uint32_t, const Object*> groupByProduct(
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

/// Doors, windows and any other product that fills an opening.
bool fillsOpenings(const IfcProduct& product) {
  return product.host != 0 || product.ifcClass.starts_with("IfcDoor") ||
         product.ifcClass.starts_with("IfcWindow");
}

struct Wall {
  const Object* object;
  Aabb box;  ///< scene frame
};

/// Walls and the parts of walls.
std::vector<Wall> collectWalls(const Model& model, const IfcMetadata& metadata,
                               const std::map<std::string, const IfcProduct*>& products) {
  const auto isWall = [](const IfcProduct* product) {
    return product != nullptr && product->ifcClass.starts_with("IfcWall");
  };
  const auto isPartOfWall = [&](const IfcProduct& product) {
    return isWall(metadata.find(product.parent)) && !fillsOpenings(product);
  };
  std::vector<Wall> walls;
  for (const Object& object : model.objects) {
    const auto product = products.find(object.globalId);
    if (product == products.end()) continue;
    if (isWall(product->second) || isPartOfWall(*product->second))
      walls.push_back({&object, computeObjectAabb(model, object, object.worldFromMesh)});
  }
  return walls;
}

/// The walls whose boxes overlap the door's box in the door's frame, in which the surrounding
/// wall's box is tight. The box is tested and not its centre, because the centre of an open leaf or
/// of a projecting window is outside the wall.
std::vector<const Object*> findSurroundingWalls(const Model& model, const std::vector<Wall>& walls,
                                                const OpeningFrame& frame) {
  const Vec3 margin = (0.25 * frame.box.size()).cwiseMin(kMaxWallOverlap);
  const Aabb inner{frame.box.min + margin, frame.box.max - margin};
  const Vec3 middle = frame.worldFromFrame * inner.centre();
  const Aabb inWorld = inflate(Aabb{middle, middle}, 0.5 * inner.size().norm());
  const auto isOverlapping = [](const Aabb& box, const Aabb& other) {
    return !box.empty() && collision::overlaps(box, other);
  };
  std::vector<const Object*> around;
  for (const Wall& wall : walls)
    if (isOverlapping(wall.box, inWorld) &&
        isOverlapping(
            computeObjectAabb(model, *wall.object, computeFrameFromMesh(frame, *wall.object)),
            inner))
      around.push_back(wall.object);
  return around;
}

}  // namespace

OpeningCheck checkOpenings(const Model& model, const IfcMetadata& metadata) {
  std::map<std::string, const IfcProduct*> products;
  for (const IfcProduct& product : metadata.products) products.emplace(product.globalId, &product);
  const auto objects = groupByProduct(products, model);
  std::optional<std::vector<Wall>> walls;  // few files need them
  OpeningCheck check;
  for (const Object& object : model.objects) {
    const auto product = products.find(object.globalId);
    if (product == products.end() || !fillsOpenings(*product->second)) continue;
    const std::uint32_t host = product->second->host;
    const std::optional<OpeningFrame> frame = computeOpeningFrame(model, object);
    if (!frame) {
      if (host != 0) check.unchecked.push_back(&object);
      continue;
    }
    std::vector<const Object*> hosts;
    const auto [begin, end] = objects.equal_range(host);
    for (auto one = begin; one != end; ++one)
      if (one->second != &object) hosts.push_back(one->second);
    if (host == 0) {
      if (!walls) walls = collectWalls(model, metadata, products);
      hosts = findSurroundingWalls(model, *walls, *frame);
    }
    const int passed = countRaysPassed(*frame, collectNearbyTriangles(model, hosts, *frame));
    ++check.checked;
    if (passed < kMinRaysPassed) check.uncut.push_back({&object, host, passed});
  }
  return check;
}

void reportOpenings(const OpeningCheck& check, std::vector<Diagnostic>& diagnostics) {
  for (const Object* object : check.unchecked) {
    addDiagnostic(diagnostics, "opening_unchecked", object->globalId + " (" + object->path + ")");
  }
  std::string named;
  for (std::size_t i = 0; i < check.uncut.size() && i < kMaxReported; ++i) {
    const UncutOpening& uncut = check.uncut[i];
    named += (named.empty() ? "" : "; ") + uncut.object->globalId + " (" + uncut.object->path +
             "): " + std::to_string(uncut.raysPassed) + " of " +
             std::to_string(kGridSize * kGridSize) + " rays pass";
  }
  addDiagnostic(diagnostics, "uncut_opening", named, check.uncut.size());
}

bool isLargerThanOpenings(const Model& model, const IfcMetadata& metadata, const IfcProduct& wall) {
  Aabb box;
  for (const Object& object : model.objects) {
    if (object.globalId != wall.globalId) continue;
    box.include(computeWorldAabb(model, object));
  }
  if (box.empty()) return false;
  double openings = 0;
  for (const IfcProduct& product : metadata.products)
    if (product.host == wall.id) openings += product.overallWidth * product.overallHeight;
  const double scale = model.metresPerUnit / metadata.metresPerUnit;
  const double area = std::max(box.size().x(), box.size().z()) * box.size().y();
  return area > kMinWallShare * openings * scale * scale;
}

}  // namespace enfilade::scene
