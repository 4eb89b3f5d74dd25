// Steps
//  1. Split the door's triangles into connected surfaces (model/shapes/shape.hpp), in the door
//     frame.
//  2. Cast a grid of rays through the door's inner area. A surface that stops most rays within
//     its box is a panel: a leaf or a pane. A frame is hollow in its middle.
//  3. A surface may surround a panel most closely, have a rail below, and lie in a further surface.
//     It is then the leaf that holds the pane.
//  4. Panels at different x are separate leaves. Surfaces within a leaf's outline, such as
//     handles, move with it; the rest is frame.
//  5. Reject leaves that are too small for the door or too thick. The door then stays static.
#include "scene/import/bodies/door_leaf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {
namespace {

constexpr int kGridSize = 9;              // rays per row
constexpr double kGridMargin = 0.12;      // fraction of the door at each side without rays
constexpr double kMinFillFraction = 0.6;  // fraction of the rays in its box that a panel stops
constexpr double kTransomFraction = 0.6;  // a panel that begins above this fraction is fixed glass
constexpr double kOutlineTolerance = 0.01;  // metres that a handle may exceed the outline
constexpr double kMaxThickness = 0.2;       // metres
constexpr double kMinHeight = 1.4;          // metres: a person passes through
constexpr double kMinWidthFraction = 0.65;  // total width of the leaves, of the door's width
constexpr double kMinHeightFraction = 0.7;  // of the door's height
constexpr double kMinWidth = 0.3;           // metres
constexpr double kMaxWidth = 1.6;           // metres: a wider panel does not turn on hinges
constexpr double kMinAspectRatio = 1.5;     // width by thickness of a door; see hasSwappedAxes()
constexpr double kMaxHandleFraction = 0.4;  // maximal width of a handle, of the leaf's width
// minimal distance of a handle from the middle, of the leaf's width
constexpr double kMinHandleOffset = 0.2;
constexpr std::size_t kMaxLeaves = 2;  // more leaves are not modelled
constexpr std::size_t kMaxTriangles = 200000;

struct Surface {
  std::vector<collision::Triangle> triangles;  // in the door frame
  Aabb box;
  bool isPanel = false;
};

using Corner = std::array<float, 3>;
using Corners = std::array<Corner, 3>;

Corner makeCorner(const Eigen::Vector3f& p) {
  return {p.x() + 0.0f, p.y() + 0.0f, p.z() + 0.0f};  // -0 becomes 0
}

Corners sortCorners(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  Corners corners{makeCorner(a), makeCorner(b), makeCorner(c)};
  std::sort(corners.begin(), corners.end());
  return corners;
}

/// x must run along the door's width. Most files comply; if the box shows otherwise, x and y are
/// swapped.
bool hasSwappedAxes(const Vec3& size) {
  return size.y() > kMinAspectRatio * size.x();
}

struct DoorShape {
  std::vector<Surface> surfaces;
  std::map<Corners, std::size_t> surfaceOf;  // by corners in mesh frame
  Aabb box;
  bool hasSwappedAxes = false;
};

Eigen::Affine3d swapAxes(const Eigen::Affine3d& doorFromMesh) {
  Eigen::Affine3d swapped = doorFromMesh;
  swapped.matrix().row(0) = doorFromMesh.matrix().row(1);
  swapped.matrix().row(1) = doorFromMesh.matrix().row(0);
  return swapped;
}

DoorShape buildDoorShape(const Model& model, const Object& door) {
  const Shape shape = buildShape(model.meshes, door.meshes);
  Eigen::Affine3d doorFromMesh =
      door.worldFromPlacement->inverse(Eigen::Isometry) * door.worldFromMesh;
  DoorShape result;
  for (const Eigen::Vector3f& v : shape.vertices)
    result.box.include(doorFromMesh * v.cast<double>());
  if (result.box.empty()) return result;
  result.hasSwappedAxes = hasSwappedAxes(result.box.size());
  if (result.hasSwappedAxes) {
    doorFromMesh = swapAxes(doorFromMesh);
    result.box = {};
    for (const Eigen::Vector3f& v : shape.vertices)
      result.box.include(doorFromMesh * v.cast<double>());
  }
  for (const Shell& shell : shape.shells) {
    Surface surface;
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      const auto& [a, b, c] = shape.triangles[t];
      const auto& v = shape.vertices;
      surface.triangles.push_back({doorFromMesh * v[a].cast<double>(),
                                   doorFromMesh * v[b].cast<double>(),
                                   doorFromMesh * v[c].cast<double>()});
      surface.box.include(collision::computeAabb(surface.triangles.back()));
      result.surfaceOf[sortCorners(v[a], v[b], v[c])] = result.surfaces.size();
    }
    result.surfaces.push_back(std::move(surface));
  }
  return result;
}

/// Returns whether the line through (x, z) along y hits the triangle.
bool isHit(const collision::Triangle& t, double x, double z) {
  std::array<double, 3> side;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[i], &b = t[(i + 1) % 3];
    side[i] = (b.x() - a.x()) * (z - a.z()) - (b.z() - a.z()) * (x - a.x());
  }
  const bool left = side[0] >= 0 && side[1] >= 0 && side[2] >= 0;
  const bool right = side[0] <= 0 && side[1] <= 0 && side[2] <= 0;
  return left != right;  // both: the triangle is seen edge-on
}

bool isHit(const Surface& surface, double x, double z) {
  if (x < surface.box.min.x() || x > surface.box.max.x()) return false;
  if (z < surface.box.min.z() || z > surface.box.max.z()) return false;
  return std::any_of(surface.triangles.begin(), surface.triangles.end(),
                     [&](const collision::Triangle& t) { return isHit(t, x, z); });
}

/// Rays are slightly off the middle, so that they miss the edges of symmetric drawings.
double computeGridLine(int i, double low, double high) {
  const double fraction = kGridMargin + (1 - 2 * kGridMargin) * (i + 0.53) / kGridSize;
  return low + fraction * (high - low);
}

bool fillsMiddle(const Surface& surface, const Aabb& door) {
  int through = 0, stopped = 0;
  for (int i = 0; i < kGridSize * kGridSize; ++i) {
    const double x = computeGridLine(i % kGridSize, door.min.x(), door.max.x());
    const double z = computeGridLine(i / kGridSize, door.min.z(), door.max.z());
    const Aabb& box = surface.box;
    if (x < box.min.x() || x > box.max.x() || z < box.min.z() || z > box.max.z()) continue;
    ++through;
    stopped += isHit(surface, x, z) ? 1 : 0;
  }
  return through >= kGridSize / 2 && stopped >= kMinFillFraction * through &&
         surface.box.min.z() < door.min.z() + kTransomFraction * door.size().z();
}

/// Compares in x and z, with a tolerance of `slack` metres.
bool containsOutline(const Aabb& outer, const Aabb& inner, double slack) {
  return inner.min.x() >= outer.min.x() - slack && inner.max.x() <= outer.max.x() + slack &&
         inner.min.z() >= outer.min.z() - slack && inner.max.z() <= outer.max.z() + slack;
}

double computeOutlineArea(const Aabb& box) {
  return box.size().x() * box.size().z();
}

bool hasRailBelow(const Surface& surface) {
  const Aabb& box = surface.box;
  return isHit(surface, 0.47 * box.min.x() + 0.53 * box.max.x(), box.min.z() + kOutlineTolerance);
}

/// Returns the surfaces around `panel` that are not panels, the closest first.
std::vector<const Surface*> findSurroundingSurfaces(const DoorShape& shape, const Aabb& panel) {
  std::vector<const Surface*> surrounding;
  for (const Surface& surface : shape.surfaces)
    if (!surface.isPanel && containsOutline(surface.box, panel, kOutlineTolerance))
      surrounding.push_back(&surface);
  std::stable_sort(surrounding.begin(), surrounding.end(), [](const Surface* a, const Surface* b) {
    return computeOutlineArea(a->box) < computeOutlineArea(b->box);
  });
  return surrounding;
}

/// Merges boxes that overlap in x; ascending by x.
std::vector<Aabb> mergeOverlapping(std::vector<Aabb> groups) {
  std::sort(groups.begin(), groups.end(),
            [](const Aabb& a, const Aabb& b) { return a.min.x() < b.min.x(); });
  std::vector<Aabb> merged;
  for (const Aabb& box : groups) {
    if (!merged.empty() && box.min.x() < merged.back().max.x() - kOutlineTolerance) {
      merged.back().include(box);
    } else {
      merged.push_back(box);
    }
  }
  return merged;
}

/// Returns the leaves as boxes of panels that overlap in x, ascending.
std::vector<Aabb> groupPanels(const DoorShape& shape) {
  std::vector<Aabb> groups;
  for (const Surface& surface : shape.surfaces)
    if (surface.isPanel) groups.push_back(surface.box);
  return mergeOverlapping(std::move(groups));
}

/// Extends a pane to the leaf that holds it.
void growToSurroundingSurface(const DoorShape& shape, std::vector<Aabb>& panels) {
  for (Aabb& panel : panels) {
    const std::vector<const Surface*> surrounding = findSurroundingSurfaces(shape, panel);
    if (surrounding.size() >= 2 && hasRailBelow(*surrounding[0]) &&
        computeOutlineArea(surrounding[0]->box) < 0.98 * computeOutlineArea(surrounding[1]->box))
      panel.include(surrounding[0]->box);
  }
}

std::string validatePanels(const DoorShape& shape, const std::vector<Aabb>& panels, double width) {
  if (panels.empty()) return "no surface fills its middle";
  if (panels.size() > kMaxLeaves) return "it has more than two leaves side by side";
  double totalWidth = 0;
  for (const Aabb& panel : panels) {
    const Vec3 size = panel.size();
    totalWidth += size.x();
    if (size.y() > kMaxThickness) return "the panel in its middle is too thick for a leaf";
    if (size.z() < kMinHeight || size.z() < kMinHeightFraction * shape.box.size().z())
      return "the panel in its middle is too low for a leaf";
    if (size.x() < kMinWidth) return "the panel in its middle is too narrow for a leaf";
  }
  if (totalWidth < kMinWidthFraction * width)
    return "the panel in its middle is too narrow for its leaf";
  return {};
}

int findLatchSide(const DoorShape& shape, const std::vector<std::uint8_t>& pieces,
                  std::uint8_t number, const Aabb& panel) {
  const double width = panel.size().x();
  int latch = 0;
  for (std::size_t i = 0; i < shape.surfaces.size(); ++i) {
    const Surface& surface = shape.surfaces[i];
    const bool sticksOut = surface.box.max.y() > panel.max.y() + kOutlineTolerance ||
                           surface.box.min.y() < panel.min.y() - kOutlineTolerance;
    if (pieces[i] != number || surface.isPanel || !sticksOut) continue;
    const double offset = (surface.box.centre().x() - panel.centre().x()) / width;
    if (surface.box.size().x() > kMaxHandleFraction * width || std::abs(offset) < kMinHandleOffset)
      continue;
    const int side = offset < 0 ? -1 : 1;
    if (latch == -side) return 0;  // at both ends: these include hinges
    latch = side;
  }
  return latch;
}

/// Returns for each surface its leaf, or kFrame.
std::vector<std::uint8_t> assignSurfaces(const DoorShape& shape, const std::vector<Aabb>& panels) {
  std::vector<std::uint8_t> pieces(shape.surfaces.size(), DoorPieces::kFrame);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t leaf = 0; leaf < panels.size(); ++leaf)
      if (containsOutline(panels[leaf], shape.surfaces[i].box, kOutlineTolerance))
        pieces[i] = static_cast<std::uint8_t>(leaf);
  }
  return pieces;
}

/// Degenerate triangles, which belong to no surface, join the frame if there is one.
std::vector<std::uint8_t> assignTriangles(const Model& model, const Object& door,
                                          const DoorShape& shape,
                                          const std::vector<std::uint8_t>& pieces) {
  const bool framed = std::count(pieces.begin(), pieces.end(), DoorPieces::kFrame) > 0;
  std::vector<std::uint8_t> result;
  for (const std::uint32_t index : door.meshes) {
    const Mesh& mesh = model.meshes[index];
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const auto at = [&](std::size_t k) { return mesh.positions[mesh.indices[i + k]]; };
      const auto found = shape.surfaceOf.find(sortCorners(at(0), at(1), at(2)));
      const std::uint8_t none = framed ? DoorPieces::kFrame : std::uint8_t{0};
      result.push_back(found == shape.surfaceOf.end() ? none : pieces[found->second]);
    }
  }
  return result;
}

std::size_t countTriangles(const Model& model, const Object& door) {
  std::size_t triangles = 0;
  for (const std::uint32_t mesh : door.meshes) triangles += model.meshes[mesh].triangleCount();
  return triangles;
}

}  // namespace

DoorPieces splitDoorTriangles(const Model& model, const Object& door) {
  DoorPieces result;
  if (countTriangles(model, door) > kMaxTriangles) {
    result.reason = "it has more than " + std::to_string(kMaxTriangles) + " triangles";
    return result;
  }
  DoorShape shape = buildDoorShape(model, door);
  for (Surface& surface : shape.surfaces) surface.isPanel = fillsMiddle(surface, shape.box);
  std::vector<Aabb> panels = groupPanels(shape);
  growToSurroundingSurface(shape, panels);
  panels = mergeOverlapping(std::move(panels));  // two panes of one leaf have grown to the same box
  const double drawnWidth = shape.box.empty() ? 0 : shape.box.size().x();
  const double width = door.overallWidth > 0 ? std::min(door.overallWidth, drawnWidth) : drawnWidth;
  result.hasSwappedAxes = shape.hasSwappedAxes;
  result.reason = validatePanels(shape, panels, width);
  const bool slides = door.operationType.rfind("SLIDING", 0) == 0;
  for (const Aabb& panel : panels)
    if (result.reason.empty() && !slides && panel.size().x() > kMaxWidth)
      result.reason = "the panel in its middle is too wide for one leaf that turns";
  if (!result.reason.empty()) return result;
  const std::vector<std::uint8_t> pieces = assignSurfaces(shape, panels);
  for (std::size_t leaf = 0; leaf < panels.size(); ++leaf)
    if (std::count(pieces.begin(), pieces.end(), leaf) == 0) {
      result.reason = "the panel in its middle belongs to no leaf";
      return result;
    }
  for (std::size_t leaf = 0; leaf < panels.size(); ++leaf) {
    const auto number = static_cast<std::uint8_t>(leaf);
    DoorLeaf& newLeaf = result.leaves.emplace_back();
    newLeaf.panel = panels[leaf];
    newLeaf.latch = findLatchSide(shape, pieces, number, panels[leaf]);
    for (std::size_t i = 0; i < pieces.size(); ++i)
      if (pieces[i] == number) newLeaf.box.include(shape.surfaces[i].box);
  }
  result.pieceOfTriangle = assignTriangles(model, door, shape, pieces);
  return result;
}

}  // namespace enfilade::scene
