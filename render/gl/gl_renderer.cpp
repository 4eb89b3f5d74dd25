// Steps of a frame: depth prepass of the visible items of model, bodies and avatars. Shading of
// colour, id and normal at equal depth, once per pixel. Sky and transparent items (colour only).
// Ambient occlusion on the colours read back.
//
// Visible items are found by temporal occlusion culling:
//
// 1. Items visible in an earlier frame from a similar camera are drawn into the depth buffer.
// 2. The depth is read back, and the remaining items are tested against it (occlusion_culler.hpp).
//    Usually few or none are disoccluded; they are drawn into the depth, too. If there are many (no
//    similar earlier frame), they are refined front to back. The nearest ones are drawn first and
//    occlude most of the others, then twice as many, and so on.
// 3. Items visible against the last depth are shaded. If neither colour nor normals are requested,
//    ids are drawn in the depth prepass, and shading is skipped if no item was disoccluded.
//
// In a small scene with little occlusion, all items in the frustum are drawn in one forward pass
// instead.
//
// Views of one size are drawn together, of one snapshot or of several, each in a layer of the
// target. They share the uploads, the read-back after each step, and the traversal of the items in
// step 2.
//
// With shadows, the shadow mask is computed between depth and colour. The forward pass is then
// preceded by a depth prepass, too.
//
// The frame equals one of drawing everything: in each pixel the nearest fragment wins, among equals
// the one drawn last. Every fragment of a culled item is behind a drawn one. Each pixel's winner is
// therefore drawn, and shading keeps the drawing order.
#include "render/gl/gl_renderer.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <deque>
#include <iterator>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "collision/assert.hpp"
#include "render/gl/dynamic_instances.hpp"
#include "render/gl/egl_context.hpp"
#include "render/gl/frame_in_progress.hpp"
#include "render/gl/scene_buffers.hpp"
#include "render/gl/surface_pass.hpp"

namespace enfilade::render {
namespace {

// Up to this many disoccluded items are drawn directly; more are refined front to back.
constexpr std::size_t kSmallDisocclusionThreshold = 256;
constexpr std::size_t kFirstChunkItems =
    512;                        // items of the first refinement chunk; the size doubles
constexpr int kMaxChunks = 24;  // more chunks than any scene needs

constexpr std::size_t kMaxLayers = OcclusionCuller::kMaxViews;

// Up to this many items, collecting all items in the frustum is fast.
constexpr std::size_t kSmallSceneThreshold = 256;

/// Indices of views that can be drawn together: of one size and one form of avatars.
std::vector<std::vector<std::size_t>> groupViews(std::span<const View> views) {
  using Key = std::tuple<int, int, AvatarForm>;
  std::map<Key, std::vector<std::vector<std::size_t>>> groupsByKey;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = views[i].camera;
    if (camera.lens) throw RenderError("camera: lens is given; it must be absent with OpenGL");
    const std::size_t limit =
        std::clamp<std::size_t>(kMaxPixelsTogether / countPixels(camera), 1, kMaxLayers);
    auto& groups = groupsByKey[{camera.width, camera.height, views[i].options.avatars}];
    if (groups.empty() || groups.back().size() == limit) groups.emplace_back();
    groups.back().push_back(i);
  }
  std::vector<std::vector<std::size_t>> all;
  for (auto& [key, groups] : groupsByKey)
    all.insert(all.end(), std::make_move_iterator(groups.begin()),
               std::make_move_iterator(groups.end()));
  return all;
}

}  // namespace

struct GlRenderer::State {
  std::shared_ptr<const scene::Scene> scene;
  ShadowMaskFunction shadowMask;  // may be empty
  EglContext context;             // before all members that own GL objects
  SceneBuffers buffers;
  std::span<const DrawItem> items;  // of the scene; empty until it is uploaded
  std::optional<OcclusionCuller> culler;
  std::optional<SurfacePass> surfacePass;         // empty: the scene is not uploaded yet
  std::deque<DynamicInstances> dynamicInstances;  // one per snapshot of the views drawn together
  RenderTarget target;
  VisibilityCache visibilityCache;
  std::deque<DepthPyramid> depthPyramids;     // one per layer
  bool planeDepth;                            // DepthSource::plane
  bool roundsVertices;                        // see DeviceChoice
  std::uint64_t frameNumber = 0;              // for the cache
  const FrameInProgress* selected = nullptr;  // see select()

  State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device,
        ShadowMaskFunction shadows);
  ~State();
  void prepareScene();
  void prepareTarget(const Camera& camera, std::size_t layers);
  std::vector<const DynamicInstances*> updateInstances(std::span<const View* const> views);
  std::deque<FrameInProgress> beginViews(std::span<const View* const> views);
  SceneItems sceneItems(const FrameInProgress& view) const {
    return {items, view.dynamic.bodyPlacements(), view.dynamic.avatars().items};
  }
  bool isTransparent(const FrameInProgress& view, std::uint32_t item) const;
  void select(const FrameInProgress& view);
  DrawList drawSurfaces(const FrameInProgress& view, const VisibleSet& visibleSet);
  void drawTransparent(const DrawList& transparent);
  void beginShading(FrameInProgress& view);
  std::size_t countTriangles(const std::vector<std::uint32_t>& some) const;
  bool isMostlyVisible(const FrameInProgress& view, const VisibleSet& all) const;
  void drawAllInFrustum(FrameInProgress& view, const VisibleSet& all);
  bool tryDrawAll(FrameInProgress& view);
  void drawPredicted(FrameInProgress& view);
  void findDisoccluded(const FramesInProgress& views);
  void refineFrontToBack(FrameInProgress& view);
  void drawDisoccluded(FrameInProgress& view);
  void shadeVisible(FrameInProgress& view);
  void drawViews(const FramesInProgress& views);
  std::vector<Frame> renderTogether(std::span<const View* const> views);
};

GlRenderer::State::State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device,
                         ShadowMaskFunction shadows)
    : scene(std::move(shared)),
      shadowMask(std::move(shadows)),
      context(device),
      planeDepth(device.depthSource == DepthSource::automatic
                     ? !context.software()
                     : device.depthSource == DepthSource::plane),
      roundsVertices(device.roundsVertices) {
  if (!scene) throw RenderError("GlRenderer: there is no scene");
}

/// Uploads the scene with the first frame, so that an unused scene is never uploaded.
void GlRenderer::State::prepareScene() {
  if (surfacePass) return;
  buffers = uploadModel(scene->model());
  items = scene->drawItems();
  culler.emplace(items);
  surfacePass.emplace(roundsVertices, planeDepth);
}

GlRenderer::State::~State() {
  // The members below the context delete their GL names in it.
  try {
    context.makeCurrent();
  } catch (const RenderError&) {
    // Destroyed on the wrong thread: the objects are freed with the context.
  }
}

void GlRenderer::State::prepareTarget(const Camera& camera, std::size_t layers) {
  if (!target.hasSize(camera.width, camera.height) ||
      static_cast<std::size_t>(target.layers()) < layers)
    target = RenderTarget(camera.width, camera.height, static_cast<int>(layers));
  while (depthPyramids.size() < layers) depthPyramids.emplace_back();
}

/// The instances of each view's snapshot. Slots are given in the order of the views: as long as
/// that stays, only what moved is uploaded.
std::vector<const DynamicInstances*> GlRenderer::State::updateInstances(
    std::span<const View* const> views) {
  std::vector<const scene::Snapshot*> snapshots;  // by index into `dynamicInstances`
  std::vector<const DynamicInstances*> ofViews;
  for (const View* view : views) {
    const auto known = std::ranges::find(snapshots, view->snapshot);
    const auto i = static_cast<std::size_t>(known - snapshots.begin());
    if (known == snapshots.end()) {
      snapshots.push_back(view->snapshot);
      if (dynamicInstances.size() < snapshots.size()) dynamicInstances.emplace_back();
      dynamicInstances[i].update(*scene, *view->snapshot, view->options.avatars);
    }
    ofViews.push_back(&dynamicInstances[i]);
  }
  return ofViews;
}

/// Gives each view a cleared layer.
std::deque<FrameInProgress> GlRenderer::State::beginViews(std::span<const View* const> views) {
  const std::vector<const DynamicInstances*> instances = updateInstances(views);
  prepareTarget(views.front()->camera, views.size());
  selected = nullptr;
  std::deque<FrameInProgress> begun;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& view = *views[i];
    FrameInProgress& frame = begun.emplace_back(FrameInProgress{
        *view.snapshot, *instances[i], view.camera, view.options, static_cast<int>(i),
        planeDepth && (view.options.channels.depth || view.options.channels.rgb),
        BoxVisibility(view.camera), depthPyramids[i]});
    if (frame.needsShadows() && !shadowMask)
      throw RenderError("GlRenderer: shadows need a shadow mask");
    target.select(frame.layer);
    target.begin(frame.options.channels, frame.planeDepth);
  }
  return begun;
}

bool GlRenderer::State::isTransparent(const FrameInProgress& view, std::uint32_t item) const {
  return items[item].alphaMode == AlphaMode::blend &&
         view.options.transparency == TransparencyMode::blend;
}

/// The following draws are the view's.
void GlRenderer::State::select(const FrameInProgress& view) {
  if (selected == &view) return;
  selected = &view;
  target.select(view.layer);
  surfacePass->begin(view.camera);
}

/// Draws the surfaces; returns the transparent items, which are drawn last.
DrawList GlRenderer::State::drawSurfaces(const FrameInProgress& view,
                                         const VisibleSet& visibleSet) {
  DrawLists lists =
      buildDrawLists({scene->model(), items, buffers.ranges, buffers.materials},
                     view.dynamic.bodyPlacements(), view.camera, view.options, visibleSet.items);
  surfacePass->draw(lists.surfaces, {buffers.vertices.name(), buffers.indices.name(),
                                     buffers.colours.name(), buffers.textures});
  surfacePass->draw(
      buildAvatarDrawList(view.dynamic.avatars(), view.camera, visibleSet.avatarItems),
      view.dynamic.avatarGeometry(buffers.textures));
  return std::move(lists.transparent);
}

/// Draws sky and transparent items, which have only colour.
void GlRenderer::State::drawTransparent(const DrawList& transparent) {
  target.setDrawChannels({true, false, false, false});
  surfacePass->drawSky();
  if (transparent.commands.empty()) return;
  surfacePass->beginTransparentPass();
  surfacePass->draw(transparent, {buffers.vertices.name(), buffers.indices.name(),
                                  buffers.colours.name(), buffers.textures});
}

/// Prepares shading at equal depth; the depth buffer must be complete.
void GlRenderer::State::beginShading(FrameInProgress& view) {
  const Channels& channels = view.options.channels;
  target.setDrawChannels(channels, view.planeDepth);
  if (view.needsShadows())
    target.setShadowMask(
        shadowMask(view.snapshot, view.camera, view.options, getDepthMetres(target, view)));
  surfacePass->beginEqualDepthPass(channels.normals, view.needsShadows(), view.planeDepth);
}

std::size_t GlRenderer::State::countTriangles(const std::vector<std::uint32_t>& some) const {
  std::size_t triangles = 0;
  for (const std::uint32_t item : some)
    triangles += buffers.ranges[items[item].mesh].indexCount / 3;
  return triangles;
}

/// Whether an earlier frame from a similar camera showed at least half of the triangles. Drawing
/// all items once is then faster than drawing the visible ones twice (depth and shading).
bool GlRenderer::State::isMostlyVisible(const FrameInProgress& view, const VisibleSet& all) const {
  const CachedView* cached = visibilityCache.findNearest(view.camera);
  return cached &&
         countTriangles(all.items) <=
             2 * countTriangles(predictVisible(sceneItems(view), view.makeTests(), *cached).items);
}

void GlRenderer::State::drawAllInFrustum(FrameInProgress& view, const VisibleSet& all) {
  view.statistics.drawn = static_cast<std::uint32_t>(all.items.size());
  view.statistics.frustumCulled = static_cast<std::uint32_t>(items.size() - all.items.size());
  if (view.needsShadows()) {
    target.setDrawChannels({false, false, false, false});
    surfacePass->beginDepthPrepass(false);
    drawSurfaces(view, all);
    beginShading(view);
  } else {
    surfacePass->beginForwardPass(view.options.channels.normals, view.planeDepth);
  }
  view.transparent = drawSurfaces(view, all);
}

/// Draws all items in the frustum where that is requested or faster.
bool GlRenderer::State::tryDrawAll(FrameInProgress& view) {
  const bool isRequested = view.options.culling != Culling::occlusion;
  if (!isRequested && items.size() > kSmallSceneThreshold) return false;
  const VisibleSet all = findInFrustum(sceneItems(view), view.makeTests());
  if (!isRequested && !isMostlyVisible(view, all)) return false;
  drawAllInFrustum(view, all);
  return true;
}

/// Draws what an earlier frame showed into the depth.
void GlRenderer::State::drawPredicted(FrameInProgress& view) {
  view.cached = &visibilityCache.lookup(view.camera, ++frameNumber);
  view.drawn = predictVisible(sceneItems(view), view.makeTests(), *view.cached);
  const Channels& channels = view.options.channels;
  view.isComplete = !channels.rgb && !channels.normals;
  target.setDrawChannels({false, view.isComplete && channels.ids, false, false},
                         view.isComplete && view.planeDepth);
  surfacePass->beginDepthPrepass(view.isComplete && view.planeDepth);
  drawSurfaces(view, view.drawn);
}

/// Finds possibly visible items that are not drawn. The pyramids hold the depth of those drawn.
void GlRenderer::State::findDisoccluded(const FramesInProgress& views) {
  std::vector<OcclusionCuller::CullingView> tested;
  for (const FrameInProgress* view : views)
    tested.push_back({view->visibility, view->pyramid, view->drawn.items,
                      view->dynamic.bodyPlacements(), view->options.hiddenEntity});
  std::vector<OcclusionCuller::CullingResult> found = culler->findVisible(tested);
  for (std::size_t i = 0; i < views.size(); ++i) {
    FrameInProgress& view = *views[i];
    view.statistics.frustumCulled = found[i].culled;
    view.disoccluded = {std::move(found[i].items),
                        findDisoccludedAvatars(sceneItems(view), view.makeTests(), view.drawn)};
  }
}

/// Draws the disoccluded items into the depth, nearest first, until the rest is occluded. Of the
/// drawn items, those that are visible remain.
void GlRenderer::State::refineFrontToBack(FrameInProgress& view) {
  const auto toEyeSpace = [&](std::uint32_t item) {
    return view.visibility.toEyeSpace(sceneItems(view).computeAabb(item));
  };
  std::vector<std::pair<double, std::uint32_t>> remaining;  // squared distance to the nearest point
  for (const std::uint32_t item : view.disoccluded.items) {
    const EyeSpaceAabb box = toEyeSpace(item);
    remaining.emplace_back((box.centre.cwiseAbs() - box.halfExtent).cwiseMax(0.0).squaredNorm(),
                           item);
  }
  std::sort(remaining.begin(), remaining.end());
  std::size_t chunkSize = kFirstChunkItems;
  for (int i = 0; i < kMaxChunks && !remaining.empty(); ++i, chunkSize *= 2) {
    const auto end =
        remaining.begin() + static_cast<std::ptrdiff_t>(std::min(chunkSize, remaining.size()));
    VisibleSet chunk;
    for (auto entry = remaining.begin(); entry != end; ++entry)
      chunk.items.push_back(entry->second);
    std::sort(chunk.items.begin(), chunk.items.end());
    if (i == 0) chunk.avatarItems = view.disoccluded.avatarItems;
    remaining.erase(remaining.begin(), end);
    drawSurfaces(view, chunk);
    mergeSorted(view.drawn.items, chunk.items);
    readDepth(target, {&view});
    view.pyramid.build();
    ++view.statistics.passes;
    std::erase_if(remaining, [&](const auto& entry) {
      return view.visibility.test(toEyeSpace(entry.second), view.pyramid) != Visibility::visible;
    });
  }
  mergeSorted(view.drawn.avatarItems, view.disoccluded.avatarItems);
  view.drawn = filterVisible(sceneItems(view), view.makeTests(), view.drawn);
}

/// Completes the view's depth.
void GlRenderer::State::drawDisoccluded(FrameInProgress& view) {
  const VisibleSet& disoccluded = view.disoccluded;
  if (disoccluded.items.size() > kSmallDisocclusionThreshold) {
    view.isComplete = false;
    return refineFrontToBack(view);
  }
  const bool transparentOnly =
      disoccluded.avatarItems.empty() &&
      std::all_of(disoccluded.items.begin(), disoccluded.items.end(),
                  [&](std::uint32_t item) { return isTransparent(view, item); });
  if (!transparentOnly) {
    view.isComplete = false;  // a disoccluded item may precede a drawn one in the drawing order
    drawSurfaces(view, disoccluded);
    view.depthIsRead = false;
    // The pyramid is not built again: it is conservative, because its depth is farther in places.
    // Without drawn items, it is empty.
    view.needsPyramid = view.drawn.items.empty();
    ++view.statistics.passes;
  }
  mergeSorted(view.drawn.items, disoccluded.items);
  mergeSorted(view.drawn.avatarItems, disoccluded.avatarItems);
}

/// Shades the visible items at their complete depth.
void GlRenderer::State::shadeVisible(FrameInProgress& view) {
  const VisibleSet shaded = filterVisible(sceneItems(view), view.makeTests(), view.drawn);
  if (!view.isComplete) {
    beginShading(view);
    view.transparent = drawSurfaces(view, shaded);
  }
  updateCachedView(sceneItems(view), view.makeTests(), view.drawn, *view.cached);
  view.statistics.drawn = static_cast<std::uint32_t>(shaded.items.size());
  const std::size_t seen = view.statistics.drawn + view.statistics.frustumCulled;
  ENFILADE_ASSERT(seen <= items.size());
  view.statistics.occluded = static_cast<std::uint32_t>(items.size() - seen);
}

void GlRenderer::State::drawViews(const FramesInProgress& views) {
  FramesInProgress culled;
  for (FrameInProgress* view : views) {
    select(*view);
    if (tryDrawAll(*view)) continue;
    drawPredicted(*view);
    culled.push_back(view);
  }
  if (!culled.empty()) {
    readDepth(target, culled);
    for (FrameInProgress* view : culled) view->pyramid.build();
    findDisoccluded(culled);
  }
  for (FrameInProgress* view : culled) {
    select(*view);
    surfacePass->beginDepthPrepass(view->isComplete && view->planeDepth);
    drawDisoccluded(*view);
  }
  // Reading the depth now and not after shading lets the device shade while this thread works.
  readDepth(target, filterViews(culled, [](const FrameInProgress& view) {
              return !view.depthIsRead && (!view.planeDepth || view.needsPyramid);
            }));
  for (FrameInProgress* view : culled) {
    if (view->needsPyramid) view->pyramid.build();
    select(*view);
    shadeVisible(*view);
  }
  for (FrameInProgress* view : views) {
    if (!view->options.channels.rgb) continue;
    select(*view);
    drawTransparent(view->transparent);
  }
}

/// `views` have one size and one form of avatars.
std::vector<Frame> GlRenderer::State::renderTogether(std::span<const View* const> views) {
  std::deque<FrameInProgress> begun = beginViews(views);
  FramesInProgress all;
  for (FrameInProgress& view : begun) all.push_back(&view);
  drawViews(all);
  std::vector<Frame> frames = readFrames(target, all);
  checkGl("drawing a frame");
  return frames;
}

GlRenderer::GlRenderer(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device,
                       ShadowMaskFunction shadowMask)
    : state_(std::make_unique<State>(std::move(scene), device, std::move(shadowMask))) {}

GlRenderer::~GlRenderer() = default;

std::vector<Frame> GlRenderer::renderOnce(std::span<const View> views) {
  State& s = *state_;
  s.context.makeCurrent();
  s.prepareScene();
  std::vector<Frame> frames(views.size());
  for (const std::vector<std::size_t>& group : groupViews(views)) {
    std::vector<const View*> together;
    for (const std::size_t i : group) together.push_back(&views[i]);
    std::vector<Frame> rendered = s.renderTogether(together);
    for (std::size_t i = 0; i < rendered.size(); ++i) frames[group[i]] = std::move(rendered[i]);
  }
  for (Frame& frame : frames) frame.renderer = deviceName(), frame.software = software();
  return frames;
}

const std::string& GlRenderer::deviceWarning() const {
  return state_->context.warning();
}
const std::string& GlRenderer::deviceName() const {
  return state_->context.deviceName();
}
bool GlRenderer::software() const {
  return state_->context.software();
}

}  // namespace enfilade::render
