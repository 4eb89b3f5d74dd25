// Finds the parts of a model that a camera may see beyond those that are drawn already. Knows no
// GL.
#pragma once

#include <vector>

#include "collision/shapes/box_tree.hpp"
#include "render/draw_list.hpp"
#include "render/gl/box_visibility.hpp"

namespace enfilade::render {

class PartSearch {
 public:
  /// `parts` is kept by reference.
  explicit PartSearch(const std::vector<Part>& parts);

  /// Forgets what was drawn, then marks these parts as drawn.
  void markDrawn(const std::vector<std::uint32_t>& parts);

  struct Found {
    std::vector<std::uint32_t> parts;  ///< may be seen and is not drawn; ascending
    std::uint32_t outside = 0, hidden = 0;
  };
  /// `depth` is that of what is drawn, or of a part of it.
  Found search(const BoxSight& sight, const DepthPyramid& depth,
               const std::vector<BodyPlacement>& bodies, scene::EntityId hidden) const;

 private:
  std::uint32_t link(std::uint32_t node);

  const std::vector<Part>& parts_;
  collision::BoxTree tree_;                ///< of what never moves
  std::vector<std::uint32_t> partOfItem_;  ///< of the tree's items
  std::vector<std::uint32_t> nodeOfPart_;  ///< whose leaf holds it
  std::vector<std::uint32_t> parent_;      ///< of each node; the root's is itself
  std::vector<std::uint32_t> held_;        ///< parts under each node
  std::vector<std::uint32_t> moving_;      ///< parts of bodies, ascending

  std::uint32_t turn_ = 0;               ///< of markDrawn
  std::vector<std::uint32_t> nodeTurn_;  ///< the turn in which something under it was drawn
  std::vector<std::uint32_t> partTurn_;
};

}  // namespace enfilade::render
