// Finds the visible items of a model, for several views at once, among those not drawn yet.
// Independent of OpenGL.
#pragma once

#include <span>
#include <vector>

#include "collision/shapes/box_tree.hpp"
#include "render/culling/box_visibility.hpp"
#include "render/draw_list.hpp"

namespace enfilade::render {

/// Hierarchical occlusion culling of draw items.
class OcclusionCuller {
 public:
  /// `items` is kept by reference.
  explicit OcclusionCuller(std::span<const DrawItem> items);

  /// A view of findVisible().
  struct CullingView {
    const BoxVisibility& visibility;
    const DepthPyramid& depth;                ///< contains some or all of the drawn items
    const std::vector<std::uint32_t>& drawn;  ///< known to be visible
    const std::vector<BodyPlacement>& bodies;
    scene::EntityId hiddenEntity;
  };
  struct CullingResult {
    std::vector<std::uint32_t> items;  ///< possibly visible and not drawn; ascending
    std::uint32_t culled = 0, occluded = 0;
  };
  static constexpr std::size_t kMaxViews = 64;
  /// One result per view, of 1..kMaxViews. All views share one traversal.
  std::vector<CullingResult> findVisible(std::span<const CullingView> views);

 private:
  std::uint32_t linkNodes(std::uint32_t node);

  std::span<const DrawItem> items_;
  collision::BoxTree tree_;                      ///< of static items
  std::vector<std::uint32_t> itemOfTreeEntry_;   ///< draw item of each tree entry
  std::vector<std::uint32_t> nodeOfItem_;        ///< parent node of the item's leaf
  std::vector<std::uint32_t> parent_;            ///< of each node; the root's is itself
  std::vector<std::uint32_t> subtreeItemCount_;  ///< number of items below each node
  std::vector<std::uint32_t> dynamicItems_;      ///< items of bodies, ascending

  /// Bit v: view v drew this item, or an item below this node. Valid in the generation that it
  /// names.
  struct Mark {
    std::uint32_t generation = 0;
    std::uint64_t views = 0;
  };
  struct CullingPass;
  void markVisible(const std::vector<std::uint32_t>& items, std::uint64_t view);
  std::uint64_t getMarkedViews(const Mark& mark) const {
    return mark.generation == generation_ ? mark.views : 0;
  }
  bool addMark(Mark& mark, std::uint64_t view);

  std::uint32_t generation_ = 0;  ///< counts calls of findVisible()
  std::vector<Mark> nodeMarks_;   ///< of the views that drew an item below the node
  std::vector<Mark> itemMarks_;   ///< of the views that drew the item
};

}  // namespace enfilade::render
