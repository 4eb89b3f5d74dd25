// Finds the visible items of a model among those not drawn yet. Independent of OpenGL.
#pragma once

#include <vector>

#include "collision/shapes/box_tree.hpp"
#include "render/draw_list.hpp"
#include "render/gl/box_visibility.hpp"

namespace enfilade::render {

/// Hierarchical occlusion culling of draw items.
class OcclusionCuller {
 public:
  /// `items` is kept by reference.
  explicit OcclusionCuller(const std::vector<DrawItem>& items);

  /// Replaces the set of items known to be visible.
  void markVisible(const std::vector<std::uint32_t>& items);

  struct CullingResult {
    std::vector<std::uint32_t> items;  ///< possibly visible and not marked; ascending
    std::uint32_t culled = 0, occluded = 0;
  };
  /// `depth` contains some or all of the marked items.
  CullingResult findVisible(const BoxVisibility& visibility, const DepthPyramid& depth,
                            const std::vector<BodyPlacement>& bodies,
                            scene::EntityId hiddenEntity) const;

 private:
  std::uint32_t linkNodes(std::uint32_t node);

  const std::vector<DrawItem>& items_;
  collision::BoxTree tree_;                      ///< of static items
  std::vector<std::uint32_t> itemOfTreeEntry_;   ///< draw item of each tree entry
  std::vector<std::uint32_t> nodeOfItem_;        ///< parent node of the item's leaf
  std::vector<std::uint32_t> parent_;            ///< of each node; the root's is itself
  std::vector<std::uint32_t> subtreeItemCount_;  ///< number of items below each node
  std::vector<std::uint32_t> dynamicItems_;      ///< items of bodies, ascending

  std::uint32_t generation_ = 0;  ///< counts markVisible() calls
  std::vector<std::uint32_t>
      nodeGeneration_;  ///< last generation with a marked item below the node
  std::vector<std::uint32_t> itemGeneration_;
};

}  // namespace enfilade::render
