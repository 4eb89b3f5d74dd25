#include "server/floors/floor_plan_section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::server {
namespace {

// Scans have holes. Lines of a surface whose ends are this close are joined. The resulting outline
// must be around something solid, and holes must be a small share of it.
constexpr double kMaxHole = 0.25;      // metres
constexpr double kMaxHoleShare = 0.2;  // of the length of an outline
constexpr double kOneWinding = 0.9;    // share of a line that lies on one side of its surface

using Segment = std::array<Vec3, 2>;

/// Cuts a triangle. A corner at the height counts as above, so that a shared edge is cut once. Each
/// edge is cut from its lower end, so that both its triangles get the same point. The segment runs
/// clockwise, as seen from above with z upwards, around a solid with outward normals.
std::optional<Segment> cutTriangle(const collision::Triangle& triangle, double height) {
  Segment ends;
  std::size_t count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = triangle[k], &b = triangle[(k + 1) % 3];
    const bool isBelow = a.y() < height;
    if (isBelow == (b.y() < height)) continue;
    const Vec3 &low = isBelow ? a : b, &high = isBelow ? b : a;
    ends[count] = low + (height - low.y()) / (high.y() - low.y()) * (high - low);
    ends[count++].y() = height;
  }
  if (count != 2) return std::nullopt;
  const Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  const Vec3 along = ends[1] - ends[0];
  if (along.x() * normal.z() < along.z() * normal.x()) std::swap(ends[0], ends[1]);
  return ends;
}

/// Segments that follow one another.
struct Chain {
  std::vector<Vec3> points;
  double length = 0;   ///< metres
  double forward = 0;  ///< metres: of segments along the chain, minus those against it

  void reverse() {
    std::ranges::reverse(points);
    forward = -forward;
  }
};

/// Joins segments that share exact end points.
class Chains {
 public:
  explicit Chains(const std::vector<Segment>& segments)
      : segments_(segments), used_(segments.size()) {
    for (std::size_t i = 0; i < segments.size(); ++i)
      for (const Vec3& end : segments[i]) byEnd_.emplace(makeKey(end), i);
  }

  /// Adds closed outlines to the section. Returns the other chains.
  std::vector<Chain> collect(ObjectSection& section) {
    std::vector<Chain> open;
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      if (used_[i]) continue;
      used_[i] = true;
      const double length = (segments_[i][1] - segments_[i][0]).norm();
      Chain chain{{segments_[i][0], segments_[i][1]}, length, length};
      extend(chain);
      if (isClosed(chain)) {
        chain.points.pop_back();
        section.loops.push_back(std::move(chain.points));
        continue;
      }
      chain.reverse();
      extend(chain);
      open.push_back(std::move(chain));
    }
    return open;
  }

 private:
  using Key = std::pair<double, double>;
  static Key makeKey(const Vec3& point) { return {point.x(), point.z()}; }
  static bool isClosed(const Chain& chain) {
    return makeKey(chain.points.front()) == makeKey(chain.points.back());
  }

  /// Appends segments until the chain ends or returns to its beginning.
  void extend(Chain& chain) {
    while (!isClosed(chain) && appendNext(chain)) continue;
  }
  bool appendNext(Chain& chain) {
    const Key end = makeKey(chain.points.back());
    const auto [first, last] = byEnd_.equal_range(end);
    for (auto at = first; at != last; ++at) {
      if (used_[at->second]) continue;
      used_[at->second] = true;
      const Segment& segment = segments_[at->second];
      const bool isForward = makeKey(segment[0]) == end;
      const double length = (segment[1] - segment[0]).norm();
      chain.points.push_back(segment[isForward ? 1 : 0]);
      chain.length += length;
      chain.forward += isForward ? length : -length;
      return true;
    }
    return false;
  }

  const std::vector<Segment>& segments_;
  std::vector<bool> used_;
  std::multimap<Key, std::size_t> byEnd_;
};

/// For each chain the one that begins closest to its end, if that is close and each begins once.
std::vector<std::optional<std::size_t>> findSuccessors(const std::vector<Chain>& chains) {
  using Cell = std::pair<long, long>;
  const auto findCell = [](const Vec3& point) {
    return Cell{std::lround(point.x() / kMaxHole), std::lround(point.z() / kMaxHole)};
  };
  std::multimap<Cell, std::size_t> starts;
  for (std::size_t i = 0; i < chains.size(); ++i)
    starts.emplace(findCell(chains[i].points.front()), i);
  std::vector<std::tuple<double, std::size_t, std::size_t>> holes;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const Vec3& end = chains[i].points.back();
    const auto [x, z] = findCell(end);
    for (long cell = 0; cell < 9; ++cell) {
      const auto [first, last] = starts.equal_range({x + cell % 3 - 1, z + cell / 3 - 1});
      for (auto at = first; at != last; ++at) {
        const double hole = (chains[at->second].points.front() - end).norm();
        if (hole <= kMaxHole) holes.emplace_back(hole, i, at->second);
      }
    }
  }
  std::ranges::sort(holes);
  std::vector<std::optional<std::size_t>> next(chains.size());
  std::vector<bool> isFollowed(chains.size(), false);
  for (const auto& [hole, from, to] : holes)
    if (!next[from] && !isFollowed[to]) next[from] = to, isFollowed[to] = true;
  return next;
}

/// Twice the area within an outline, square metres: below 0 around a solid (see cutTriangle()).
double computeTwiceArea(const std::vector<Vec3>& loop) {
  double area = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3 &a = loop[i], &b = loop[(i + 1) % loop.size()];
    area += a.x() * b.z() - b.x() * a.z();
  }
  return area;
}

/// Adds outlines that holes interrupt to the loops, and the other chains to the lines.
void closeHoles(std::vector<Chain> chains, ObjectSection& section) {
  std::vector<Chain> directed;
  for (Chain& chain : chains) {
    if (chain.forward < 0) chain.reverse();
    auto& lines = section.lines;
    if (chain.forward < kOneWinding * chain.length)
      lines.push_back(std::move(chain.points));
    else
      directed.push_back(std::move(chain));
  }
  const auto next = findSuccessors(directed);
  std::vector<bool> isUsed(directed.size(), false);
  for (std::size_t first = 0; first < directed.size(); ++first) {
    std::vector<std::size_t> members;
    std::vector<Vec3> loop;
    double length = 0, holes = 0;
    std::optional<std::size_t> at = first;
    for (; at && !isUsed[*at]; at = next[*at]) {
      isUsed[*at] = true;
      const Chain& chain = directed[*at];
      if (!members.empty()) holes += (chain.points.front() - loop.back()).norm();
      members.push_back(*at);
      loop.insert(loop.end(), chain.points.begin(), chain.points.end());
      length += chain.length;
    }
    if (members.empty()) continue;
    holes += (loop.front() - loop.back()).norm();
    if (at == first && holes <= kMaxHoleShare * (length + holes) && computeTwiceArea(loop) < 0) {
      section.loops.push_back(std::move(loop));
      continue;
    }
    for (const std::size_t member : members)
      section.lines.push_back(std::move(directed[member].points));
  }
}

}  // namespace

ObjectSection cutObject(const scene::Model& model, std::uint32_t object, double height) {
  ObjectSection section;
  section.object = object;
  std::vector<Segment> segments;
  for (const collision::Triangle& triangle : scene::collectSolidTriangles(model, object)) {
    section.box.include(collision::computeAabb(triangle));
    if (const auto segment = cutTriangle(triangle, height)) segments.push_back(*segment);
  }
  closeHoles(Chains(segments).collect(section), section);
  return section;
}

std::vector<ObjectSection> cutStatic(const scene::Scene& scene, double height) {
  std::vector<ObjectSection> sections;
  ENFILADE_ASSERT(scene.solidObjects().size() == scene.staticBoxes().size());
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    const scene::Aabb& box = scene.staticBoxes()[i];
    if (!(box.min.y() < height && box.max.y() >= height)) continue;
    ObjectSection section = cutObject(scene.model(), scene.solidObjects()[i], height);
    if (!section.empty()) sections.push_back(std::move(section));
  }
  return sections;
}

}  // namespace enfilade::server
