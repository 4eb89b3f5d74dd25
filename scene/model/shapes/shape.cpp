// Steps: weld equal positions; drop duplicate triangles and those without area; sort the edges;
// connect triangles over edges that exactly two share. Then give each surface the winding of most
// of its triangles, and classify each closed surface as convex or not, and as inward or outward.
#include "scene/model/shapes/shape.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "collision/shapes/exact_orientation.hpp"
#include "scene/model/shapes/convex_surface.hpp"

namespace enfilade::scene {
namespace {

using Index = std::uint32_t;
using Corners = std::array<Index, 3>;

/// A triangle's edge: its corners ascending, its triangle, and the direction in that triangle.
struct EdgeUse {
  Index low, high;
  Index triangle;
  bool forward;  ///< the triangle runs from low to high

  auto corners() const { return std::tie(low, high); }
};

struct PositionHash {
  std::size_t operator()(const Eigen::Vector3f& p) const {
    std::uint64_t hash = 0;
    for (const float coordinate : {p.x(), p.y(), p.z()})
      hash = (hash ^ std::bit_cast<std::uint32_t>(coordinate)) * 0x9e3779b97f4a7c15;
    return hash ^ (hash >> 32);
  }
};

/// Returns all corners of these meshes as indices into unique positions, in the order of first use;
/// 0 and -0 are equal.
std::vector<Index> weldVertices(std::span<const Mesh> meshes, std::span<const Index> meshIndices,
                                std::vector<Eigen::Vector3f>& vertices) {
  constexpr Index kUnknown = 0xffffffff;
  std::vector<Index> corners;
  std::unordered_map<Eigen::Vector3f, Index, PositionHash> vertexAt;
  for (const Index mesh : meshIndices) {
    const auto& positions = meshes[mesh].positions;
    std::vector<Index> vertexByPosition(positions.size(), kUnknown);
    corners.reserve(corners.size() + meshes[mesh].indices.size());
    for (const Index i : meshes[mesh].indices) {
      if (vertexByPosition[i] == kUnknown) {
        const Eigen::Vector3f position = positions[i].array() + 0.0F;  // turns -0 into 0
        const auto next = static_cast<Index>(vertices.size());
        const auto [known, isNew] = vertexAt.try_emplace(position, next);
        if (isNew) vertices.push_back(positions[i]);
        vertexByPosition[i] = known->second;
      }
      corners.push_back(vertexByPosition[i]);
    }
  }
  return corners;
}

Corners sortTriangleCorners(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

/// Triangles with an area and without duplicates, in their order.
std::vector<Corners> cleanTriangles(const std::vector<Index>& corners, Shape& shape) {
  std::vector<Corners> triangles;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    const Corners t{corners[i], corners[i + 1], corners[i + 2]};
    const auto& v = shape.vertices;
    const bool repeats = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    if (repeats || !hasExactArea(v[t[0]], v[t[1]], v[t[2]])) {
      ++shape.degenerate;
    } else {
      triangles.push_back(t);
    }
  }
  std::vector<std::pair<Corners, Index>> keys;
  for (Index t = 0; t < triangles.size(); ++t)
    keys.emplace_back(sortTriangleCorners(triangles[t]), t);
  std::sort(keys.begin(), keys.end());
  std::vector<bool> repeated(triangles.size(), false);
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first != keys[i - 1].first) continue;
    repeated[keys[i].second] = true;
    ++shape.duplicate;
  }
  std::vector<Corners> kept;
  for (Index t = 0; t < triangles.size(); ++t) {
    if (!repeated[t]) kept.push_back(triangles[t]);
  }
  return kept;
}

/// Ascending corners, then triangles: a counting sort by the lower corner, each bucket sorted.
std::vector<EdgeUse> sortEdges(const std::vector<Corners>& triangles, std::size_t vertexCount) {
  std::vector<Index> end(vertexCount + 1);
  const auto forEachEdge = [&](const auto& visit) {
    for (Index t = 0; t < triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Index from = triangles[t][k], to = triangles[t][(k + 1) % 3];
        visit(EdgeUse{std::min(from, to), std::max(from, to), t, from < to});
      }
    }
  };
  forEachEdge([&](const EdgeUse& edge) { ++end[edge.low + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<EdgeUse> edges(3 * triangles.size());
  forEachEdge([&](const EdgeUse& edge) { edges[end[edge.low]++] = edge; });
  // end[v] is now the end of the bucket of v.
  for (std::size_t v = 0; v < vertexCount; ++v) {
    const auto begin = edges.begin() + (v == 0 ? 0 : end[v - 1]);
    std::sort(begin, edges.begin() + end[v], [](const EdgeUse& a, const EdgeUse& b) {
      return std::tie(a.high, a.triangle) < std::tie(b.high, b.triangle);
    });
  }
  return edges;
}

/// Neighbours across the three edges of a triangle.
struct Neighbours {
  static constexpr Index kNone = 0xffffffff;
  std::array<Index, 3> across{kNone, kNone, kNone};
  std::array<bool, 3> oppositelyWound{};  ///< that neighbour has the opposite winding
  bool open = false;                      ///< an edge is not shared by exactly two
};

int findEdgeSlot(const Corners& t, const EdgeUse& edge) {
  for (int k = 0; k < 3; ++k) {
    const Index from = t[k], to = t[(k + 1) % 3];
    if (std::min(from, to) == edge.low && std::max(from, to) == edge.high) return k;
  }
  return 0;  // unreachable: the edge belongs to the triangle
}

std::vector<Neighbours> linkNeighbours(const std::vector<Corners>& triangles, Shape& shape) {
  std::vector<Neighbours> links(triangles.size());
  const std::vector<EdgeUse> edges = sortEdges(triangles, shape.vertices.size());
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last = std::find_if(
        first, edges.end(), [&](const EdgeUse& e) { return e.corners() != first->corners(); });
    if (last - first == 2) {
      const EdgeUse &a = *first, &b = *(first + 1);
      const int ka = findEdgeSlot(triangles[a.triangle], a),
                kb = findEdgeSlot(triangles[b.triangle], b);
      links[a.triangle].across[ka] = b.triangle;
      links[b.triangle].across[kb] = a.triangle;
      links[a.triangle].oppositelyWound[ka] = links[b.triangle].oppositelyWound[kb] =
          a.forward == b.forward;
    } else {
      ++(last - first == 1 ? shape.boundaryEdges : shape.nonManifoldEdges);
      for (auto edge = first; edge != last; ++edge) links[edge->triangle].open = true;
    }
    first = last;
  }
  return links;
}

/// Traverses the triangles connected with `seed` breadth first, and gives them the winding of most
/// of them.
class SurfaceTraversal {
 public:
  SurfaceTraversal(std::vector<Corners>& triangles, const std::vector<Neighbours>& links)
      : triangles_(triangles), links_(links), sense_(triangles.size(), 0) {}

  bool isVisited(Index triangle) const { return sense_[triangle] != 0; }

  /// Appends the surface's triangles to `shape`.
  void traverse(Index seed, Shape& shape) {
    found_.assign(1, seed);
    sense_[seed] = 1;
    bool open = false;
    for (std::size_t i = 0; i < found_.size(); ++i) {
      const Neighbours& link = links_[found_[i]];
      open = open || link.open;
      for (std::size_t k = 0; k < 3; ++k) open = !visit(link, k, sense_[found_[i]]) || open;
    }
    std::sort(found_.begin(), found_.end());
    Shell shell;
    shell.kind = open ? Shell::Kind::open : Shell::Kind::closed;
    shell.first = static_cast<Index>(shape.triangles.size());
    shell.count = static_cast<Index>(found_.size());
    unifyWinding(shape);
    shape.shells.push_back(shell);
  }

 private:
  /// False if a triangle is reached with both windings: the surface is one-sided.
  bool visit(const Neighbours& link, std::size_t k, signed char sense) {
    const Index next = link.across[k];
    if (next == Neighbours::kNone) return true;
    const auto wanted = static_cast<signed char>(link.oppositelyWound[k] ? -sense : sense);
    if (sense_[next] != 0) return sense_[next] == wanted;
    sense_[next] = wanted;
    found_.push_back(next);
    return true;
  }

  void unifyWinding(Shape& shape) {
    const auto reversedCount =
        std::count_if(found_.begin(), found_.end(), [&](Index t) { return sense_[t] < 0; });
    const bool isMostlyReversed = 2 * static_cast<std::size_t>(reversedCount) > found_.size();
    for (const Index t : found_) {
      Corners corners = triangles_[t];
      if ((sense_[t] < 0) != isMostlyReversed) {
        std::swap(corners[1], corners[2]);
        ++shape.flippedTriangles;
      }
      shape.triangles.push_back(corners);
    }
  }

  std::vector<Corners>& triangles_;
  const std::vector<Neighbours>& links_;
  std::vector<signed char> sense_;  // 0: not visited; 1: as the seed; -1: opposite
  std::vector<Index> found_;
};

/// Removes vertices that no triangle uses.
void removeUnusedVertices(Shape& shape) {
  constexpr Index kUnused = 0xffffffff;
  std::vector<Index> number(shape.vertices.size(), kUnused);
  std::vector<Eigen::Vector3f> kept;
  for (Corners& t : shape.triangles) {
    for (Index& corner : t) {
      if (number[corner] == kUnused) {
        number[corner] = static_cast<Index>(kept.size());
        kept.push_back(shape.vertices[corner]);
      }
      corner = number[corner];
    }
  }
  kept.shrink_to_fit();
  shape.vertices = std::move(kept);
}

Aabb computeShellAabb(const Shape& shape, const Shell& shell) {
  Aabb box;
  for (Index t = shell.first; t < shell.first + shell.count; ++t) {
    for (const Index v : shape.triangles[t]) box.include(shape.vertices[v].cast<double>());
  }
  return box;
}

/// Marks surfaces with a cavity: such a solid is not the one that its outer surface bounds.
void findCavities(Shape& shape) {
  std::vector<Aabb> inwardBoxes;
  for (const Shell& s : shape.shells) {
    if (s.bounds() && s.inward) inwardBoxes.push_back(computeShellAabb(shape, s));
  }
  if (inwardBoxes.empty()) return;
  for (Shell& s : shape.shells) {
    if (!s.bounds() || s.inward) continue;
    const Aabb box = computeShellAabb(shape, s);
    s.hollow = std::any_of(inwardBoxes.begin(), inwardBoxes.end(),
                           [&](const Aabb& inner) { return overlaps(inner, box); });
  }
}

}  // namespace

bool hasExactArea(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  return !collision::areCollinear(a.cast<double>(), b.cast<double>(), c.cast<double>());
}

std::vector<Index> collectVertices(const Shape& shape, std::span<const Shell> shells) {
  std::vector<Index> vertices;
  for (const Shell& shell : shells)
    for (Index t = shell.first; t < shell.first + shell.count; ++t)
      vertices.insert(vertices.end(), shape.triangles[t].begin(), shape.triangles[t].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

Shape buildShape(std::span<const Mesh> meshes, std::span<const Index> meshIndices) {
  Shape shape;
  const std::vector<Index> corners = weldVertices(meshes, meshIndices, shape.vertices);
  std::vector<Corners> triangles = cleanTriangles(corners, shape);
  const std::vector<Neighbours> links = linkNeighbours(triangles, shape);
  shape.triangles.reserve(triangles.size());
  SurfaceTraversal traversal(triangles, links);
  for (Index t = 0; t < triangles.size(); ++t) {
    if (!traversal.isVisited(t)) traversal.traverse(t, shape);
  }
  removeUnusedVertices(shape);
  for (Shell& shell : shape.shells) {
    if (!shell.bounds()) continue;
    const ConvexityResult verdict = classifyConvexity(
        shape.vertices, std::span(shape.triangles).subspan(shell.first, shell.count));
    shell.kind = verdict.kind;
    shell.inward = verdict.inward;
    if (verdict.notTested) ++shape.notTested;
  }
  findCavities(shape);
  return shape;
}

}  // namespace enfilade::scene
