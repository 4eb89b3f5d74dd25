// Steps: weld equal positions; drop triangles without area and repeated ones; sort the edges; join
// triangles over edges that two of them share; wind each surface as most of its triangles are; ask
// of each closed surface whether it is convex and which way it looks.
#include "scene/model/shapes/shape.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "collision/shapes/exact_orientation.hpp"
#include "scene/model/shapes/convex_surface.hpp"

namespace enfilade::scene {
namespace {

using Index = std::uint32_t;
using Corners = std::array<Index, 3>;

/// A triangle's edge: its corners ascending, and which triangle runs along it in which sense.
struct EdgeUse {
  Index low, high;
  Index triangle;
  bool forward;  ///< the triangle runs from low to high

  auto corners() const { return std::tie(low, high); }
};

bool before(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z());
}

/// All corners of these meshes as indices into positions that are each stored once, in the order of
/// their first use; 0 and -0 are one position.
std::vector<Index> weld(std::span<const Mesh> meshes, std::span<const Index> which,
                        std::vector<Eigen::Vector3f>& vertices) {
  std::vector<Eigen::Vector3f> corners;
  for (const Index mesh : which)
    for (const Index i : meshes[mesh].indices) corners.push_back(meshes[mesh].positions[i]);
  std::vector<Index> order(corners.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    if (before(corners[a], corners[b])) return true;
    return !before(corners[b], corners[a]) && a < b;
  });
  std::vector<Index> first(corners.size());  // the first corner at the same position
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && !before(corners[order[i - 1]], corners[order[i]]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  for (Index i = 0; i < first.size(); ++i) {
    if (first[i] == i) {
      first[i] = static_cast<Index>(vertices.size());
      vertices.push_back(corners[i]);
    } else {
      first[i] = first[first[i]];  // its first use was renumbered already
    }
  }
  return first;
}

Corners sorted(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

/// Triangles with an area, each set of corners once, in their order.
std::vector<Corners> cleanTriangles(const std::vector<Index>& corners, Shape& shape) {
  std::vector<Corners> triangles;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    const Corners t{corners[i], corners[i + 1], corners[i + 2]};
    const auto& v = shape.vertices;
    const bool repeats = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    if (repeats || !hasArea(v[t[0]], v[t[1]], v[t[2]])) {
      ++shape.degenerate;
    } else {
      triangles.push_back(t);
    }
  }
  std::vector<std::pair<Corners, Index>> keys;
  for (Index t = 0; t < triangles.size(); ++t) keys.emplace_back(sorted(triangles[t]), t);
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

std::vector<EdgeUse> sortedEdges(const std::vector<Corners>& triangles) {
  std::vector<EdgeUse> edges;
  edges.reserve(3 * triangles.size());
  for (Index t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index from = triangles[t][k], to = triangles[t][(k + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), t, from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

/// What lies across the three edges of a triangle.
struct Neighbours {
  static constexpr Index kNone = 0xffffffff;
  std::array<Index, 3> beyond{kNone, kNone, kNone};
  std::array<bool, 3> against{};  ///< that neighbour is wound the other way round
  bool open = false;              ///< an edge is not shared by two
};

int slotOf(const Corners& t, const EdgeUse& edge) {
  for (int k = 0; k < 3; ++k) {
    const Index from = t[k], to = t[(k + 1) % 3];
    if (std::min(from, to) == edge.low && std::max(from, to) == edge.high) return k;
  }
  return 0;  // not reached: the edge is one of the triangle's
}

std::vector<Neighbours> link(const std::vector<Corners>& triangles, Shape& shape) {
  std::vector<Neighbours> links(triangles.size());
  const std::vector<EdgeUse> edges = sortedEdges(triangles);
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last = std::find_if(
        first, edges.end(), [&](const EdgeUse& e) { return e.corners() != first->corners(); });
    if (last - first == 2) {
      const EdgeUse &a = *first, &b = *(first + 1);
      const int ka = slotOf(triangles[a.triangle], a), kb = slotOf(triangles[b.triangle], b);
      links[a.triangle].beyond[ka] = b.triangle;
      links[b.triangle].beyond[kb] = a.triangle;
      links[a.triangle].against[ka] = links[b.triangle].against[kb] = a.forward == b.forward;
    } else {
      ++(last - first == 1 ? shape.boundaryEdges : shape.crowdedEdges);
      for (auto edge = first; edge != last; ++edge) links[edge->triangle].open = true;
    }
    first = last;
  }
  return links;
}

/// Takes the triangles connected with `seed` in the order of their finding and turns them to the
/// sense of most of them.
class SurfaceWalk {
 public:
  SurfaceWalk(std::vector<Corners>& triangles, const std::vector<Neighbours>& links)
      : triangles_(triangles), links_(links), sense_(triangles.size(), 0) {}

  bool taken(Index triangle) const { return sense_[triangle] != 0; }

  /// Appends the surface's triangles to `shape`.
  void take(Index seed, Shape& shape) {
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
    windAlike(shape);
    shape.shells.push_back(shell);
  }

 private:
  /// False where a triangle is reached in both senses: the surface has but one side.
  bool visit(const Neighbours& link, std::size_t k, signed char sense) {
    const Index next = link.beyond[k];
    if (next == Neighbours::kNone) return true;
    const auto wanted = static_cast<signed char>(link.against[k] ? -sense : sense);
    if (sense_[next] != 0) return sense_[next] == wanted;
    sense_[next] = wanted;
    found_.push_back(next);
    return true;
  }

  void windAlike(Shape& shape) {
    const auto against =
        std::count_if(found_.begin(), found_.end(), [&](Index t) { return sense_[t] < 0; });
    const bool most = 2 * static_cast<std::size_t>(against) > found_.size();
    for (const Index t : found_) {
      Corners corners = triangles_[t];
      if ((sense_[t] < 0) != most) {
        std::swap(corners[1], corners[2]);
        ++shape.rewound;
      }
      shape.triangles.push_back(corners);
    }
  }

  std::vector<Corners>& triangles_;
  const std::vector<Neighbours>& links_;
  std::vector<signed char> sense_;  // 0: not taken; 1: as the seed; -1: against it
  std::vector<Index> found_;
};

/// Vertices that no triangle uses go.
void keepUsedVertices(Shape& shape) {
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

Box boxOf(const Shape& shape, const Shell& shell) {
  Box box;
  for (Index t = shell.first; t < shell.first + shell.count; ++t) {
    for (const Index v : shape.triangles[t]) box.include(shape.vertices[v].cast<double>());
  }
  return box;
}

/// A solid with a cavity is not what its outer surface bounds.
void findCavities(Shape& shape) {
  std::vector<Box> inwardBoxes;
  for (const Shell& s : shape.shells) {
    if (s.bounds() && s.inward) inwardBoxes.push_back(boxOf(shape, s));
  }
  if (inwardBoxes.empty()) return;
  for (Shell& s : shape.shells) {
    if (!s.bounds() || s.inward) continue;
    const Box box = boxOf(shape, s);
    s.hollow = std::any_of(inwardBoxes.begin(), inwardBoxes.end(),
                           [&](const Box& inner) { return overlaps(inner, box); });
  }
}

}  // namespace

bool hasArea(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  return !collision::collinear(a.cast<double>(), b.cast<double>(), c.cast<double>());
}

std::vector<Index> verticesOf(const Shape& shape, std::span<const Shell> shells) {
  std::vector<Index> vertices;
  for (const Shell& shell : shells)
    for (Index t = shell.first; t < shell.first + shell.count; ++t)
      vertices.insert(vertices.end(), shape.triangles[t].begin(), shape.triangles[t].end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

Shape shapeOf(std::span<const Mesh> meshes, std::span<const Index> which) {
  Shape shape;
  const std::vector<Index> corners = weld(meshes, which, shape.vertices);
  std::vector<Corners> triangles = cleanTriangles(corners, shape);
  const std::vector<Neighbours> links = link(triangles, shape);
  shape.triangles.reserve(triangles.size());
  SurfaceWalk walk(triangles, links);
  for (Index t = 0; t < triangles.size(); ++t) {
    if (!walk.taken(t)) walk.take(t, shape);
  }
  keepUsedVertices(shape);
  for (Shell& shell : shape.shells) {
    if (!shell.bounds()) continue;
    const ConvexityVerdict verdict = judgeConvexity(
        shape.vertices, std::span(shape.triangles).subspan(shell.first, shell.count));
    shell.kind = verdict.kind;
    shell.inward = verdict.inward;
    if (verdict.untried) ++shape.untried;
  }
  findCavities(shape);
  return shape;
}

}  // namespace enfilade::scene
