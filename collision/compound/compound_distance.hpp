// How near two concave or articulated objects come, however far apart: the exact verdict, and the
// two parts that attain it.
#pragma once

#include <functional>
#include <span>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/box_tree.hpp"

namespace enfilade::collision {

/// Convex parts under a tree of boxes that somebody else holds. An object is some of these.
struct TreeOfParts {
  const BoxTree* boxes = nullptr;
  Mat3 rotation = Mat3::Identity();  ///< worldFromTree
  Vec3 translation = Vec3::Zero();   ///< metres
  /// The part that is this item of the tree, in the world.
  std::function<ConvexBody(std::uint32_t)> part;
};

/// Of all its parts, in the world: not smaller than theirs. `boxes` must not be empty.
Box boxOf(const TreeOfParts& tree);

struct NearestParts {
  enum class Found : std::uint8_t {
    nearest,  ///< `decision` of the parts `a` and `b`
    none,     ///< all are farther apart than was looked
    gaveUp    ///< the work was used up before anything was known
  };
  Found found = Found::none;
  Decision decision;  ///< penetrating if any two parts are, else touching, else the least distance
  ConvexBody a, b;
};

/// What a decision on two parts costs, beside 1 for two boxes.
inline constexpr std::size_t kDecisionWork = 16;

/// `within`: metres, >= 0 or infinite; parts beyond are not looked at (those a little beyond may be
/// found nevertheless). Takes what it does from `work`, and stops when nothing is left.
NearestParts nearestParts(std::span<const TreeOfParts> a, std::span<const TreeOfParts> b,
                          double within, std::size_t& work);

}  // namespace enfilade::collision
