#include "server/plans/floor_plan_section.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::server {
namespace {

using Segment = std::array<Vec3, 2>;

/// Cuts a triangle. A corner at the height counts as above, so that a shared edge is cut once, and
/// each edge is cut from its lower end, so that both its triangles get the same point.
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
  return count == 2 ? std::optional(ends) : std::nullopt;
}

/// Joins segments that share exact end points.
class Chains {
 public:
  explicit Chains(const std::vector<Segment>& segments)
      : segments_(segments), used_(segments.size()) {
    for (std::size_t i = 0; i < segments.size(); ++i)
      for (const Vec3& end : segments[i]) byEnd_.emplace(makeKey(end), i);
  }

  void collect(ObjectSection& section) {
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      if (used_[i]) continue;
      used_[i] = true;
      std::vector<Vec3> chain{segments_[i][0], segments_[i][1]};
      extend(chain);
      if (makeKey(chain.front()) == makeKey(chain.back())) {
        chain.pop_back();
        section.loops.push_back(std::move(chain));
        continue;
      }
      std::reverse(chain.begin(), chain.end());
      extend(chain);
      section.lines.push_back(std::move(chain));
    }
  }

 private:
  using Key = std::pair<double, double>;
  static Key makeKey(const Vec3& point) { return {point.x(), point.z()}; }

  /// Appends segments until the chain ends or returns to its beginning.
  void extend(std::vector<Vec3>& chain) {
    while (makeKey(chain.front()) != makeKey(chain.back())) {
      const std::optional<Vec3> next = takeNext(chain.back());
      if (!next) return;
      chain.push_back(*next);
    }
  }
  std::optional<Vec3> takeNext(const Vec3& end) {
    const auto [first, last] = byEnd_.equal_range(makeKey(end));
    for (auto at = first; at != last; ++at) {
      if (used_[at->second]) continue;
      used_[at->second] = true;
      const Segment& segment = segments_[at->second];
      return makeKey(segment[0]) == makeKey(end) ? segment[1] : segment[0];
    }
    return std::nullopt;
  }

  const std::vector<Segment>& segments_;
  std::vector<bool> used_;
  std::multimap<Key, std::size_t> byEnd_;
};

}  // namespace

ObjectSection cutObject(const scene::Model& model, std::uint32_t object, double height) {
  ObjectSection section;
  section.object = object;
  std::vector<Segment> segments;
  for (const collision::Triangle& triangle : scene::collectSolidTriangles(model, object)) {
    section.box.include(collision::computeAabb(triangle));
    if (const auto segment = cutTriangle(triangle, height)) segments.push_back(*segment);
  }
  Chains(segments).collect(section);
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
