// Steps
//  1. The door's triangles are split into connected surfaces (shapes/shape.hpp) and taken to the
//     door's frame.
//  2. A grid of rays goes square through the door's inner part. A surface that stops most of those
//     that meet its box is a panel: a door's leaf, or a pane. A frame is hollow in its middle.
//  3. A surface that surrounds a panel as closely as no other, and has a rail below, is the leaf
//     that holds the pane, if there is another one around it.
//  4. Panels that stand side by side are leaves of their own; what lies in a leaf's outline, as
//     handles do, moves with it, and all else is frame.
//  5. A leaf that is too small for the door, or too thick, was no leaf: the door stays as it is.
#include "scene/import/bodies/door_leaf.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {
namespace {

constexpr int kGrid = 9;                // rays in a row
constexpr double kInner = 0.12;         // part of the door at each side that no ray goes through
constexpr double kFills = 0.6;          // of the rays through its box that a panel stops
constexpr double kTransom = 0.6;        // a panel that begins above this part is fixed glass
constexpr double kSlack = 0.01;         // metres that a handle may stick out of the outline
constexpr double kThickest = 0.2;       // metres: no leaf is thicker
constexpr double kLowest = 1.4;         // metres: a person goes through
constexpr double kLeastShare = 0.65;    // of the door's width that its leaves have
constexpr double kLeastHeight = 0.7;    // of the door's height
constexpr double kNarrowest = 0.3;      // metres
constexpr double kWidest = 1.6;         // metres: what is wider does not turn on hinges
constexpr double kOblong = 1.5;         // a door is so much wider than thick, or see throughAxis
constexpr double kHandleShare = 0.4;    // of the leaf's width that a handle takes at most
constexpr double kHandleAside = 0.2;    // of it that a handle sits from the middle at least
constexpr std::size_t kMostLeaves = 2;  // more are no door that is known here
constexpr std::size_t kMostTriangles = 200000;

struct Surface {
  std::vector<collision::Triangle> triangles;  // door's frame
  Box box;
  bool panel = false;
};

using Corner = std::array<float, 3>;
using Corners = std::array<Corner, 3>;

Corner cornerOf(const Eigen::Vector3f& p) {
  return {p.x() + 0.0f, p.y() + 0.0f, p.z() + 0.0f};  // -0 becomes 0
}

Corners sortedCorners(const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                      const Eigen::Vector3f& c) {
  Corners corners{cornerOf(a), cornerOf(b), cornerOf(c)};
  std::sort(corners.begin(), corners.end());
  return corners;
}

/// The door's x must run along its width. Most files keep to that; where the box says otherwise, x
/// and y are exchanged.
bool isTurned(const Vec3& size) {
  return size.y() > kOblong * size.x();
}

struct DoorShape {
  std::vector<Surface> surfaces;
  std::map<Corners, std::size_t> surfaceOf;  // by corners in the meshes' frame
  Box box;
  bool turned = false;
};

Eigen::Affine3d exchanged(const Eigen::Affine3d& doorFromMesh) {
  Eigen::Affine3d other = doorFromMesh;
  other.matrix().row(0) = doorFromMesh.matrix().row(1);
  other.matrix().row(1) = doorFromMesh.matrix().row(0);
  return other;
}

DoorShape shapeOfDoor(const Model& model, const Object& door) {
  const Shape shape = shapeOf(model.meshes, door.meshes);
  Eigen::Affine3d doorFromMesh =
      door.worldFromPlacement->inverse(Eigen::Isometry) * door.worldFromMesh;
  DoorShape result;
  for (const Eigen::Vector3f& v : shape.vertices)
    result.box.include(doorFromMesh * v.cast<double>());
  if (result.box.empty()) return result;
  result.turned = isTurned(result.box.size());
  if (result.turned) {
    doorFromMesh = exchanged(doorFromMesh);
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
      surface.box.include(collision::boxOf(surface.triangles.back()));
      result.surfaceOf[sortedCorners(v[a], v[b], v[c])] = result.surfaces.size();
    }
    result.surfaces.push_back(std::move(surface));
  }
  return result;
}

/// Whether the line through (x, z) along y meets the triangle.
bool isMet(const collision::Triangle& t, double x, double z) {
  std::array<double, 3> side;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[i], &b = t[(i + 1) % 3];
    side[i] = (b.x() - a.x()) * (z - a.z()) - (b.z() - a.z()) * (x - a.x());
  }
  const bool left = side[0] >= 0 && side[1] >= 0 && side[2] >= 0;
  const bool right = side[0] <= 0 && side[1] <= 0 && side[2] <= 0;
  return left != right;  // both: seen from its edge
}

bool isMet(const Surface& surface, double x, double z) {
  if (x < surface.box.min.x() || x > surface.box.max.x()) return false;
  if (z < surface.box.min.z() || z > surface.box.max.z()) return false;
  return std::any_of(surface.triangles.begin(), surface.triangles.end(),
                     [&](const collision::Triangle& t) { return isMet(t, x, z); });
}

/// Rays are set a little off the middle, lest they run along the edges of symmetric drawings.
double gridLine(int i, double low, double high) {
  const double part = kInner + (1 - 2 * kInner) * (i + 0.53) / kGrid;
  return low + part * (high - low);
}

bool isPanel(const Surface& surface, const Box& door) {
  int through = 0, stopped = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const double x = gridLine(i % kGrid, door.min.x(), door.max.x());
    const double z = gridLine(i / kGrid, door.min.z(), door.max.z());
    const Box& box = surface.box;
    if (x < box.min.x() || x > box.max.x() || z < box.min.z() || z > box.max.z()) continue;
    ++through;
    stopped += isMet(surface, x, z) ? 1 : 0;
  }
  return through >= kGrid / 2 && stopped >= kFills * through &&
         surface.box.min.z() < door.min.z() + kTransom * door.size().z();
}

/// In x and z, `slack` metres to spare.
bool holds(const Box& outer, const Box& inner, double slack) {
  return inner.min.x() >= outer.min.x() - slack && inner.max.x() <= outer.max.x() + slack &&
         inner.min.z() >= outer.min.z() - slack && inner.max.z() <= outer.max.z() + slack;
}

double outline(const Box& box) {
  return box.size().x() * box.size().z();
}

bool hasRailBelow(const Surface& surface) {
  const Box& box = surface.box;
  return isMet(surface, 0.47 * box.min.x() + 0.53 * box.max.x(), box.min.z() + kSlack);
}

/// The surfaces that surround `panel` without being one, the closest first.
std::vector<const Surface*> ringsAround(const DoorShape& shape, const Box& panel) {
  std::vector<const Surface*> rings;
  for (const Surface& surface : shape.surfaces)
    if (!surface.panel && holds(surface.box, panel, kSlack)) rings.push_back(&surface);
  std::stable_sort(rings.begin(), rings.end(), [](const Surface* a, const Surface* b) {
    return outline(a->box) < outline(b->box);
  });
  return rings;
}

/// Boxes that lie over one another as seen from above become one; from left to right.
std::vector<Box> joined(std::vector<Box> groups) {
  std::sort(groups.begin(), groups.end(),
            [](const Box& a, const Box& b) { return a.min.x() < b.min.x(); });
  std::vector<Box> apart;
  for (const Box& box : groups) {
    if (!apart.empty() && box.min.x() < apart.back().max.x() - kSlack) {
      apart.back().include(box);
    } else {
      apart.push_back(box);
    }
  }
  return apart;
}

/// Leaves as boxes of panels that overlap in x, ascending.
std::vector<Box> panelGroups(const DoorShape& shape) {
  std::vector<Box> groups;
  for (const Surface& surface : shape.surfaces)
    if (surface.panel) groups.push_back(surface.box);
  return joined(std::move(groups));
}

/// A pane's leaf is what holds it.
void growToRings(const DoorShape& shape, std::vector<Box>& panels) {
  for (Box& panel : panels) {
    const std::vector<const Surface*> rings = ringsAround(shape, panel);
    if (rings.size() >= 2 && hasRailBelow(*rings[0]) &&
        outline(rings[0]->box) < 0.98 * outline(rings[1]->box))
      panel.include(rings[0]->box);
  }
}

std::string refusalOf(const DoorShape& shape, const std::vector<Box>& panels, double width) {
  if (panels.empty()) return "no surface fills its middle";
  if (panels.size() > kMostLeaves) return "it has more than two leaves side by side";
  double together = 0;
  for (const Box& panel : panels) {
    const Vec3 size = panel.size();
    together += size.x();
    if (size.y() > kThickest) return "what fills its middle is too thick for a leaf";
    if (size.z() < kLowest || size.z() < kLeastHeight * shape.box.size().z())
      return "what fills its middle is too low for a leaf";
    if (size.x() < kNarrowest) return "what fills its middle is too narrow for a leaf";
  }
  if (together < kLeastShare * width) return "what fills its middle is too narrow for its leaf";
  return {};
}

int latchOf(const DoorShape& shape, const std::vector<std::uint8_t>& pieces, std::uint8_t number,
            const Box& panel) {
  const double width = panel.size().x();
  int latch = 0;
  for (std::size_t i = 0; i < shape.surfaces.size(); ++i) {
    const Surface& surface = shape.surfaces[i];
    const bool sticksOut = surface.box.max.y() > panel.max.y() + kSlack ||
                           surface.box.min.y() < panel.min.y() - kSlack;
    if (pieces[i] != number || surface.panel || !sticksOut) continue;
    const double aside = (surface.box.centre().x() - panel.centre().x()) / width;
    if (surface.box.size().x() > kHandleShare * width || std::abs(aside) < kHandleAside) continue;
    const int side = aside < 0 ? -1 : 1;
    if (latch == -side) return 0;  // at both sides: hinges too
    latch = side;
  }
  return latch;
}

/// Of each surface the leaf that it is of, or kFrame.
std::vector<std::uint8_t> assignSurfaces(const DoorShape& shape, const std::vector<Box>& panels) {
  std::vector<std::uint8_t> pieces(shape.surfaces.size(), DoorPieces::kFrame);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t leaf = 0; leaf < panels.size(); ++leaf)
      if (holds(panels[leaf], shape.surfaces[i].box, kSlack))
        pieces[i] = static_cast<std::uint8_t>(leaf);
  }
  return pieces;
}

/// Triangles without an area, which are of no surface, go with the frame, if there is one.
std::vector<std::uint8_t> assignTriangles(const Model& model, const Object& door,
                                          const DoorShape& shape,
                                          const std::vector<std::uint8_t>& pieces) {
  const bool framed = std::count(pieces.begin(), pieces.end(), DoorPieces::kFrame) > 0;
  std::vector<std::uint8_t> result;
  for (const std::uint32_t index : door.meshes) {
    const Mesh& mesh = model.meshes[index];
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const auto at = [&](std::size_t k) { return mesh.positions[mesh.indices[i + k]]; };
      const auto found = shape.surfaceOf.find(sortedCorners(at(0), at(1), at(2)));
      const std::uint8_t none = framed ? DoorPieces::kFrame : std::uint8_t{0};
      result.push_back(found == shape.surfaceOf.end() ? none : pieces[found->second]);
    }
  }
  return result;
}

std::size_t trianglesOf(const Model& model, const Object& door) {
  std::size_t triangles = 0;
  for (const std::uint32_t mesh : door.meshes) triangles += model.meshes[mesh].indices.size() / 3;
  return triangles;
}

}  // namespace

DoorPieces piecesOfDoor(const Model& model, const Object& door) {
  DoorPieces result;
  if (trianglesOf(model, door) > kMostTriangles) {
    result.why = "it has more than " + std::to_string(kMostTriangles) + " triangles";
    return result;
  }
  DoorShape shape = shapeOfDoor(model, door);
  for (Surface& surface : shape.surfaces) surface.panel = isPanel(surface, shape.box);
  std::vector<Box> panels = panelGroups(shape);
  growToRings(shape, panels);
  panels = joined(std::move(panels));  // two panes of one leaf grew to the same one
  const double drawn = shape.box.empty() ? 0 : shape.box.size().x();
  const double width = door.overallWidth > 0 ? std::min(door.overallWidth, drawn) : drawn;
  result.turned = shape.turned;
  result.why = refusalOf(shape, panels, width);
  const bool slides = door.operation.rfind("SLIDING", 0) == 0;
  for (const Box& panel : panels)
    if (result.why.empty() && !slides && panel.size().x() > kWidest)
      result.why = "what fills its middle is too wide for one leaf that turns";
  if (!result.why.empty()) return result;
  const std::vector<std::uint8_t> pieces = assignSurfaces(shape, panels);
  for (std::size_t leaf = 0; leaf < panels.size(); ++leaf)
    if (std::count(pieces.begin(), pieces.end(), leaf) == 0) {
      result.why = "what fills its middle is of no leaf";
      return result;
    }
  for (std::size_t leaf = 0; leaf < panels.size(); ++leaf) {
    const auto number = static_cast<std::uint8_t>(leaf);
    DoorLeaf& made = result.leaves.emplace_back();
    made.panel = panels[leaf];
    made.latch = latchOf(shape, pieces, number, panels[leaf]);
    for (std::size_t i = 0; i < pieces.size(); ++i)
      if (pieces[i] == number) made.box.include(shape.surfaces[i].box);
  }
  result.pieceOfTriangle = assignTriangles(model, door, shape, pieces);
  return result;
}

}  // namespace enfilade::scene
