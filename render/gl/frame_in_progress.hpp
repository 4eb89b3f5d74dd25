// The views that GlRenderer draws together, and their read-back.
#pragma once

#include <vector>

#include "render/culling/visible_items.hpp"
#include "render/gl/dynamic_instances.hpp"
#include "render/gl/render_target.hpp"

namespace enfilade::render {

/// State of a view being rendered.
struct FrameInProgress {
  const scene::Snapshot& snapshot;
  const DynamicInstances& dynamic;  ///< of the snapshot
  const Camera& camera;
  const FrameOptions& options;
  int layer;        ///< of the target
  bool planeDepth;  ///< depth channel and ambient occlusion use the plane depth
  BoxVisibility visibility;
  DepthPyramid& pyramid;
  FrameStatistics statistics = {};
  CachedView* cached = nullptr;  ///< with occlusion culling
  VisibleSet drawn = {};         ///< into the depth
  VisibleSet disoccluded = {};   ///< not drawn yet
  bool isComplete = false;       ///< the prepass drew ids and depth; nothing needs shading
  bool depthIsRead = false;      ///< the pyramid's base level holds the view's depth
  bool needsPyramid = false;     ///< built before any item was drawn: build it again before shading
  DrawList transparent = {};
  std::vector<float> metres = {};  ///< depth of the depth buffer; empty: not computed yet

  bool needsShadows() const { return options.shadows && options.channels.rgb; }
  bool needsDepth() const { return options.channels.depth || options.channels.rgb; }
  ViewTests makeTests() const { return {visibility, pyramid, options.hiddenEntity}; }
};

/// Views of one size, in ascending order of their layers.
using FramesInProgress = std::vector<FrameInProgress*>;

/// Those that satisfy the condition.
template <class Condition>
FramesInProgress filterViews(const FramesInProgress& views, const Condition& condition) {
  FramesInProgress some;
  for (FrameInProgress* view : views)
    if (condition(*view)) some.push_back(view);
  return some;
}

/// Reads the depth of the views into the base levels of their pyramids.
void readDepth(const RenderTarget& target, const FramesInProgress& views);

/// Depth of the view's depth buffer in metres, computed once per frame.
const std::vector<float>& getDepthMetres(const RenderTarget& target, FrameInProgress& view);

/// Reads the channels of all drawn views; layer i is view i.
std::vector<Frame> readFrames(const RenderTarget& target, const FramesInProgress& views);

}  // namespace enfilade::render
