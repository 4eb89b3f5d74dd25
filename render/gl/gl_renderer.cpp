// Steps of a frame: depth prepass of the visible items of model, bodies and avatars; shading of
// colour, id and normal at equal depth, once per pixel; sky and transparent items (colour only);
// ambient occlusion on the colours read back.
//
// Visible items are found by temporal occlusion culling:
//
// 1. Items visible in an earlier frame from a similar camera are drawn into the depth buffer.
// 2. The depth is read back, and the remaining items are tested against it (occlusion_culler.hpp).
//    Usually few or none are disoccluded; they are drawn into the depth, too. If there are many (no
//    similar earlier frame), they are refined front to back: the nearest ones are drawn first and
//    occlude most of the others, then twice as many, and so on.
// 3. Items visible against the last depth are shaded. If neither colour nor normals are requested,
//    ids are drawn in the depth prepass, and shading is skipped if no item was disoccluded.
//
// In a small scene with little occlusion, all items in the frustum are drawn in one forward pass
// instead.
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
#include <iterator>
#include <optional>
#include <utility>

#include "collision/assert.hpp"
#include "render/gl/dynamic_instances.hpp"
#include "render/gl/egl_context.hpp"
#include "render/gl/occlusion_culler.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/scene_buffers.hpp"
#include "render/gl/surface_pass.hpp"
#include "render/gl/visibility_cache.hpp"

namespace enfilade::render {
namespace {

// Up to this many disoccluded items are drawn directly; more are refined front to back.
constexpr std::size_t kSmallDisocclusionThreshold = 256;
constexpr std::size_t kFirstChunkItems =
    512;                        // items of the first refinement chunk; the size doubles
constexpr int kMaxChunks = 24;  // more chunks than any scene needs
// Frames between retests of a visible item, and until an item outside the frustum is forgotten.
constexpr std::uint64_t kRetestPeriod = 8, kForgetCulledPeriod = 64;

// Up to this many items, collecting all items in the frustum is fast.
constexpr std::size_t kSmallSceneThreshold = 256;

/// Model items and avatar items to draw.
struct VisibleSet {
  std::vector<std::uint32_t> items;        ///< ascending
  std::vector<std::uint32_t> avatarItems;  ///< indices into AvatarMeshes::items, ascending
};

void mergeSorted(std::vector<std::uint32_t>& all, const std::vector<std::uint32_t>& more) {
  ENFILADE_ASSERT(std::is_sorted(all.begin(), all.end()));
  ENFILADE_ASSERT(std::is_sorted(more.begin(), more.end()));
  std::vector<std::uint32_t> merged;
  merged.reserve(all.size() + more.size());
  std::set_union(all.begin(), all.end(), more.begin(), more.end(), std::back_inserter(merged));
  all = std::move(merged);
}

/// State of the frame being rendered.
struct FrameJob {
  const scene::Snapshot& snapshot;
  const Camera& camera;
  const FrameOptions& options;
  BoxVisibility visibility;
  FrameStatistics statistics;
  bool planeDepth;            ///< depth channel and ambient occlusion use the plane depth
  std::vector<float> metres;  ///< depth of the depth buffer; empty: not computed yet

  bool needsShadows() const { return options.shadows && options.channels.rgb; }
};

}  // namespace

struct GlRenderer::State {
  std::shared_ptr<const scene::Scene> scene;
  ShadowMaskFunction shadowMask;  // may be empty
  EglContext context;             // before all members that own GL objects
  SceneBuffers buffers;
  std::vector<DrawItem> items;
  std::optional<OcclusionCuller> culler;
  std::optional<SurfacePass> surfacePass;  // empty: the scene is not uploaded yet
  DynamicInstances dynamicInstances;
  RenderTarget target;
  VisibilityCache visibilityCache;
  DepthPyramid depthPyramid;
  bool planeDepth;              // DepthSource::plane
  bool roundsVertices;          // see DeviceChoice
  bool depthIsCurrent = false;  // the pyramid's base level holds the current depth buffer
  std::uint64_t frameNumber = 0;

  State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device,
        ShadowMaskFunction shadows);
  ~State();
  void prepareScene();
  scene::Aabb itemAabb(std::uint32_t item) const;
  bool isTransparent(const FrameJob& job, std::uint32_t item) const;
  DrawList drawSurfaces(const FrameJob& job, const VisibleSet& visibleSet);
  void drawTransparent(const DrawList& transparent);
  void readDepth(const Camera& camera);
  const std::vector<float>& getDepthMetres(FrameJob& job);
  void beginShading(FrameJob& job);
  std::size_t countTriangles(const std::vector<std::uint32_t>& some) const;
  VisibleSet collectInFrustum(const FrameJob& job) const;
  bool isMostlyVisible(const FrameJob& job, const VisibleSet& all) const;
  DrawList drawAllInFrustum(FrameJob& job, const VisibleSet& all);
  DrawList drawVisible(FrameJob& job);
  VisibleSet predictVisible(const FrameJob& job, const CachedView& cached) const;
  VisibleSet findDisoccluded(FrameJob& job, const VisibleSet& drawn);
  VisibleSet refineFrontToBack(FrameJob& job, VisibleSet drawn, VisibleSet disoccluded);
  VisibleSet filterVisible(const FrameJob& job, const VisibleSet& drawn) const;
  void updateCache(const FrameJob& job, const VisibleSet& drawn, CachedView& cached) const;
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
  items = buildDrawItems(scene->model());
  culler.emplace(items);
  surfacePass.emplace(roundsVertices);
}

GlRenderer::State::~State() {
  // The members below the context delete their GL names in it.
  try {
    context.makeCurrent();
  } catch (const RenderError&) {
    // Destroyed on the wrong thread: the objects are freed with the context.
  }
}

scene::Aabb GlRenderer::State::itemAabb(std::uint32_t item) const {
  return computeItemAabb(items[item], dynamicInstances.bodyPlacements());
}

bool GlRenderer::State::isTransparent(const FrameJob& job, std::uint32_t item) const {
  return items[item].alphaMode == AlphaMode::blend &&
         job.options.transparency == TransparencyMode::blend;
}

/// Draws the surfaces; returns the transparent items, which are drawn last.
DrawList GlRenderer::State::drawSurfaces(const FrameJob& job, const VisibleSet& visibleSet) {
  DrawLists lists =
      buildDrawLists({scene->model(), items, buffers.ranges, buffers.materials},
                     dynamicInstances.bodyPlacements(), job.camera, job.options, visibleSet.items);
  surfacePass->draw(lists.surfaces, {buffers.vertices.name(), buffers.indices.name(),
                                     buffers.colours.name(), buffers.textures});
  surfacePass->draw(
      buildAvatarDrawList(dynamicInstances.avatars(), job.camera, visibleSet.avatarItems),
      dynamicInstances.avatarGeometry(buffers.textures));
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

void GlRenderer::State::readDepth(const Camera& camera) {
  target.readDepth(depthPyramid.baseLevel(camera.width, camera.height));
  depthIsCurrent = true;
}

/// Depth of the current depth buffer in metres, computed once per frame.
const std::vector<float>& GlRenderer::State::getDepthMetres(FrameJob& job) {
  if (!depthIsCurrent) readDepth(job.camera);
  if (job.metres.empty())
    job.metres = convertDepthToMetres(depthPyramid.baseLevel(job.camera.width, job.camera.height),
                                      job.camera);
  ENFILADE_ASSERT(job.metres.size() == static_cast<std::size_t>(job.camera.width) *
                                           static_cast<std::size_t>(job.camera.height));
  return job.metres;
}

/// Prepares shading at equal depth; the depth buffer must be complete.
void GlRenderer::State::beginShading(FrameJob& job) {
  const Channels& channels = job.options.channels;
  target.setDrawChannels(channels, job.planeDepth);
  if (job.needsShadows())
    target.setShadowMask(shadowMask(job.snapshot, job.camera, job.options, getDepthMetres(job)));
  surfacePass->beginEqualDepthPass(channels.normals, job.needsShadows(), job.planeDepth);
}

std::size_t GlRenderer::State::countTriangles(const std::vector<std::uint32_t>& some) const {
  std::size_t triangles = 0;
  for (const std::uint32_t item : some)
    triangles += buffers.ranges[items[item].mesh].indexCount / 3;
  return triangles;
}

/// All items in the frustum.
VisibleSet GlRenderer::State::collectInFrustum(const FrameJob& job) const {
  VisibleSet all;
  all.items = findItemsInFrustum(items, dynamicInstances.bodyPlacements(), job.camera,
                                 job.options.hiddenEntity);
  const std::vector<AvatarMeshes::Item>& avatarItems = dynamicInstances.avatars().items;
  for (std::uint32_t i = 0; i < avatarItems.size(); ++i) {
    if (avatarItems[i].id == job.options.hiddenEntity) continue;
    if (!job.visibility.isOutsideFrustum(job.visibility.toEyeSpace(avatarItems[i].box)))
      all.avatarItems.push_back(i);
  }
  return all;
}

/// Whether an earlier frame from a similar camera showed at least half of the triangles. Drawing
/// all items once is then faster than drawing the visible ones twice (depth and shading).
bool GlRenderer::State::isMostlyVisible(const FrameJob& job, const VisibleSet& all) const {
  const CachedView* cached = visibilityCache.findNearest(job.camera);
  return cached &&
         countTriangles(all.items) <= 2 * countTriangles(predictVisible(job, *cached).items);
}

DrawList GlRenderer::State::drawAllInFrustum(FrameJob& job, const VisibleSet& all) {
  job.statistics.drawn = static_cast<std::uint32_t>(all.items.size());
  job.statistics.frustumCulled = static_cast<std::uint32_t>(items.size() - all.items.size());
  if (job.needsShadows()) {
    target.setDrawChannels({false, false, false, false});
    surfacePass->beginDepthPrepass(false);
    drawSurfaces(job, all);
    beginShading(job);
  } else {
    surfacePass->beginForwardPass(job.options.channels.normals, job.planeDepth);
  }
  return drawSurfaces(job, all);
}

/// Items of the cached view that are in the frustum.
VisibleSet GlRenderer::State::predictVisible(const FrameJob& job, const CachedView& cached) const {
  VisibleSet visibleSet;
  for (const std::uint32_t item : cached.items) {
    if (items[item].object + 1 == job.options.hiddenEntity) continue;
    if (!job.visibility.isOutsideFrustum(job.visibility.toEyeSpace(itemAabb(item))))
      visibleSet.items.push_back(item);
  }
  const std::vector<AvatarMeshes::Item>& avatarItems = dynamicInstances.avatars().items;
  ENFILADE_ASSERT(std::ranges::is_sorted(cached.items) && std::ranges::is_sorted(cached.avatars));
  for (std::uint32_t i = 0; i < avatarItems.size(); ++i) {
    if (avatarItems[i].id == job.options.hiddenEntity) continue;
    if (!std::binary_search(cached.avatars.begin(), cached.avatars.end(), avatarItems[i].id))
      continue;
    if (!job.visibility.isOutsideFrustum(job.visibility.toEyeSpace(avatarItems[i].box)))
      visibleSet.avatarItems.push_back(i);
  }
  return visibleSet;
}

/// Possibly visible items other than `drawn`, whose depth is in the pyramid.
VisibleSet GlRenderer::State::findDisoccluded(FrameJob& job, const VisibleSet& drawn) {
  culler->markVisible(drawn.items);
  OcclusionCuller::CullingResult found = culler->findVisible(
      job.visibility, depthPyramid, dynamicInstances.bodyPlacements(), job.options.hiddenEntity);
  job.statistics.frustumCulled = found.culled;
  VisibleSet visibleSet;
  visibleSet.items = std::move(found.items);
  const std::vector<AvatarMeshes::Item>& avatarItems = dynamicInstances.avatars().items;
  for (std::uint32_t i = 0; i < avatarItems.size(); ++i) {
    if (avatarItems[i].id == job.options.hiddenEntity) continue;
    if (std::binary_search(drawn.avatarItems.begin(), drawn.avatarItems.end(), i)) continue;
    const EyeSpaceAabb box = job.visibility.toEyeSpace(avatarItems[i].box);
    if (job.visibility.test(box, depthPyramid) == Visibility::visible)
      visibleSet.avatarItems.push_back(i);
  }
  return visibleSet;
}

/// Draws the disoccluded items into the depth, nearest first, until the rest is occluded. Returns
/// the visible items among all drawn ones.
VisibleSet GlRenderer::State::refineFrontToBack(FrameJob& job, VisibleSet drawn,
                                                VisibleSet disoccluded) {
  const auto mayBeVisible = [&](std::uint32_t item) {
    return job.visibility.test(job.visibility.toEyeSpace(itemAabb(item)), depthPyramid) ==
           Visibility::visible;
  };
  std::vector<std::pair<double, std::uint32_t>> remaining;  // squared distance to the nearest point
  for (const std::uint32_t item : disoccluded.items) {
    const EyeSpaceAabb box = job.visibility.toEyeSpace(itemAabb(item));
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
    if (i == 0) chunk.avatarItems = disoccluded.avatarItems;
    remaining.erase(remaining.begin(), end);
    drawSurfaces(job, chunk);
    mergeSorted(drawn.items, chunk.items);
    readDepth(job.camera);
    depthPyramid.build();
    ++job.statistics.passes;
    std::erase_if(remaining, [&](const auto& entry) { return !mayBeVisible(entry.second); });
  }
  mergeSorted(drawn.avatarItems, disoccluded.avatarItems);
  return filterVisible(job, drawn);
}

/// Updates the cached view for the next frame: the drawn items without those now occluded, and
/// previously visible items that are outside the frustum now.
void GlRenderer::State::updateCache(const FrameJob& job, const VisibleSet& drawn,
                                    CachedView& cached) const {
  std::vector<std::uint32_t> kept;
  for (const std::uint32_t item : drawn.items) {
    const bool due = cached.items.empty() || (item + frameNumber) % kRetestPeriod == 0;
    if (due && job.visibility.test(job.visibility.toEyeSpace(itemAabb(item)), depthPyramid) ==
                   Visibility::occluded)
      continue;
    kept.push_back(item);
  }
  ENFILADE_ASSERT(std::ranges::is_sorted(drawn.items) && std::ranges::is_sorted(drawn.avatarItems));
  for (const std::uint32_t item : cached.items) {
    if (std::binary_search(drawn.items.begin(), drawn.items.end(), item)) continue;
    if ((item + frameNumber) % kForgetCulledPeriod != 0) kept.push_back(item);
  }
  std::sort(kept.begin(), kept.end());
  cached.items = std::move(kept);
  cached.avatars.clear();
  for (const std::uint32_t avatarItem : drawn.avatarItems)
    cached.avatars.push_back(dynamicInstances.avatars().items[avatarItem].id);
  std::sort(cached.avatars.begin(), cached.avatars.end());
}

/// The items of `drawn` that are visible against the last depth pyramid.
VisibleSet GlRenderer::State::filterVisible(const FrameJob& job, const VisibleSet& drawn) const {
  VisibleSet visible;
  visible.avatarItems = drawn.avatarItems;
  for (const std::uint32_t item : drawn.items) {
    if (job.visibility.test(job.visibility.toEyeSpace(itemAabb(item)), depthPyramid) ==
        Visibility::visible)
      visible.items.push_back(item);
  }
  return visible;
}

/// Draws the visible items; returns the transparent ones.
DrawList GlRenderer::State::drawVisible(FrameJob& job) {
  if (items.size() <= kSmallSceneThreshold) {
    const VisibleSet all = collectInFrustum(job);
    if (isMostlyVisible(job, all)) return drawAllInFrustum(job, all);
  }
  CachedView& cached = visibilityCache.lookup(job.camera, ++frameNumber);
  VisibleSet drawn = predictVisible(job, cached);
  const Channels& channels = job.options.channels;
  bool done = !channels.rgb && !channels.normals;
  target.setDrawChannels({false, done && channels.ids, false, false}, done && job.planeDepth);
  surfacePass->beginDepthPrepass(done && job.planeDepth);
  drawSurfaces(job, drawn);
  readDepth(job.camera);
  depthPyramid.build();
  VisibleSet disoccluded = findDisoccluded(job, drawn);
  if (disoccluded.items.size() > kSmallDisocclusionThreshold) {
    done = false;
    drawn = refineFrontToBack(job, std::move(drawn), std::move(disoccluded));
  } else {
    const bool transparentOnly =
        disoccluded.avatarItems.empty() &&
        std::all_of(disoccluded.items.begin(), disoccluded.items.end(),
                    [&](std::uint32_t item) { return isTransparent(job, item); });
    if (!transparentOnly) {
      done = false;  // a disoccluded item may precede a drawn one in the drawing order
      drawSurfaces(job, disoccluded);
      // Read the depth now and not after shading, so that CPU work overlaps with shading. The
      // pyramid is not rebuilt: it is conservative, because its depth is farther in places. Without
      // drawn items, it is empty and must be rebuilt.
      depthIsCurrent = false;
      if (!job.planeDepth || drawn.items.empty()) readDepth(job.camera);
      if (drawn.items.empty()) depthPyramid.build();
      ++job.statistics.passes;
    }
    mergeSorted(drawn.items, disoccluded.items);
    mergeSorted(drawn.avatarItems, disoccluded.avatarItems);
  }
  const VisibleSet shaded = filterVisible(job, drawn);
  DrawList transparent;
  if (!done) {
    beginShading(job);
    transparent = drawSurfaces(job, shaded);
  }
  updateCache(job, drawn, cached);
  job.statistics.drawn = static_cast<std::uint32_t>(shaded.items.size());
  ENFILADE_ASSERT(job.statistics.drawn + job.statistics.frustumCulled <= items.size());
  job.statistics.occluded = static_cast<std::uint32_t>(items.size()) - job.statistics.drawn -
                            job.statistics.frustumCulled;
  return transparent;
}

GlRenderer::GlRenderer(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device,
                       ShadowMaskFunction shadowMask)
    : state_(std::make_unique<State>(std::move(scene), device, std::move(shadowMask))) {}

GlRenderer::~GlRenderer() = default;

Frame GlRenderer::renderOnce(const scene::Snapshot& snapshot, const Camera& camera,
                             const FrameOptions& options) {
  if (camera.lens) throw RenderError("camera: lens is given; it must be absent with OpenGL");
  State& s = *state_;
  s.context.makeCurrent();
  s.prepareScene();
  s.dynamicInstances.update(*s.scene, snapshot, options.avatars);
  if (!s.target.hasSize(camera.width, camera.height)) {
    s.target = RenderTarget(camera.width, camera.height);
  }
  s.surfacePass->begin(camera);
  const bool needsDepth = options.channels.depth || options.channels.rgb;
  const bool planeDepth = s.planeDepth && needsDepth;
  s.target.begin(options.channels, planeDepth);
  s.depthIsCurrent = false;
  FrameJob job{snapshot, camera, options, BoxVisibility(camera), {}, planeDepth, {}};
  if (job.needsShadows() && !s.shadowMask)
    throw RenderError("GlRenderer: shadows need a shadow mask");
  const DrawList transparent = options.culling == Culling::occlusion
                                   ? s.drawVisible(job)
                                   : s.drawAllInFrustum(job, s.collectInFrustum(job));
  if (options.channels.rgb) s.drawTransparent(transparent);
  Frame frame;
  frame.renderer = deviceName();
  frame.software = software();
  frame.statistics = job.statistics;
  if (planeDepth) {
    s.target.readPlaneDepth(frame.depth);
  } else if (needsDepth) {
    glFlush();  // if the depth was already read, the device works while this thread continues
    s.getDepthMetres(job);
    frame.depth = std::move(job.metres);
  }
  if (options.channels.rgb) s.target.readColour(frame, AmbientOcclusion(frame.depth, camera));
  s.target.readChannels(frame, options.channels);
  if (!options.channels.depth) frame.depth = {};
  checkGl("drawing a frame");
  return frame;
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
