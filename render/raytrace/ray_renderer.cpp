// Steps of a frame: packets of primary rays find each pixel's triangle. Depth, id and normal are
// computed from its corners in doubles, in runs along the rows. A shadow ray towards the sun
// follows if requested, and shading. Then, for the whole frame, transparent surfaces are blended
// from back to front and ambient occlusion is applied. Threads share the rows; the result does not
// depend on their number.
#include "render/raytrace/ray_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "render/ambient_occlusion.hpp"
#include "render/raytrace/lens_frame.hpp"
#include "render/raytrace/ray_scene.hpp"
#include "render/raytrace/trace.hpp"
#include "scene/base/thread_pool.hpp"

namespace enfilade::render {
namespace {

/// Caches values of recent keys, because adjacent rows hit the same triangles.
template <class Value>
class RecentCache {
 public:
  template <class Make>
  const Value& getOrMake(HitKey key, const Make& make) {
    // Fibonacci hashing of the key chooses the slot.
    Slot& slot = slots_[(key * 0x9E37'79B9'7F4A'7C15u) >> (64 - kBits)];
    if (slot.key != key || !slot.value) {
      slot.value.emplace(make());
      slot.key = key;
    }
    return *slot.value;
  }

 private:
  static constexpr int kBits = 7;
  struct Slot {
    HitKey key = kNoHit;
    std::optional<Value> value;
  };
  std::vector<Slot> slots_ = std::vector<Slot>(std::size_t{1} << kBits);
};

struct CachedPlane {
  PlaneDepth depth;
  scene::EntityId id;
};

/// Fills the depths of a run of pixels with the same triangle.
void fillDepth(const PlaneDepth& plane, int x, int y, std::span<float> out) {
  const double numerator = plane.numerator.at(x, y), denominator = plane.denominator.at(x, y);
  const int count = static_cast<int>(out.size());
  for (int i = 0; i < count; ++i) {
    const double z =
        (numerator + i * plane.numerator.dx) / (denominator + i * plane.denominator.dx);
    out[static_cast<std::size_t>(i)] = static_cast<float>(plane.clampDepth(z));
  }
}

/// Trees whose first hit determines depth and ids; they include transparent surfaces that are drawn
/// as opaque.
std::vector<const RayTree*> collectFirstHitTrees(RayScene& scene, const FrameOptions& options) {
  std::vector<const RayTree*> trees = scene.opaqueTrees(options.hiddenEntity);
  if (options.transparency == TransparencyMode::blend) return trees;
  const std::vector<const RayTree*> transparentTrees = scene.transparentTrees();
  trees.insert(trees.end(), transparentTrees.begin(), transparentTrees.end());
  return trees;
}

/// Calls `work(frame, from, to)` for ranges of tile rows of frames of these heights, on several
/// threads.
template <class Work>
void parallelForTiles(scene::ThreadPool& workers, std::span<const int> heights, const Work& work) {
  constexpr std::size_t kBlock = 4;  // tile rows per task
  struct Task {
    std::size_t frame, from, to;
  };
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto rows = static_cast<std::size_t>((heights[i] + kTileSize - 1) / kTileSize);
    for (std::size_t from = 0; from < rows; from += kBlock)
      tasks.push_back({i, from, std::min(rows, from + kBlock)});
  }
  workers.parallelFor(tasks.size(), 1, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) work(tasks[i].frame, tasks[i].from, tasks[i].to);
  });
}

/// Traces one frame.
class FrameTracer {
 public:
  FrameTracer(const Camera& camera, const FrameOptions& options, RayScene& scene,
              const MipTextures& textures)
      : options_(options),
        rays_(computePrimaryRays(camera)),
        shading_(rays_, textures),
        opaqueTrees_(collectFirstHitTrees(scene, options)),
        origin_(scene.origin()) {
    if (options.channels.rgb && options.transparency == TransparencyMode::blend)
      transparentTrees_ = scene.transparentTrees();
    const auto pixels = countPixels(camera);
    frame_.camera = camera;
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    if (options.channels.depth || options.channels.rgb) frame_.depth.assign(pixels, kNothing);
    if (options.channels.ids) frame_.ids.assign(pixels, 0);
    if (options.channels.normals) frame_.normals.assign(3 * pixels, 0.0f);
    if (options.channels.rgb) linearColours_.resize(pixels), frame_.rgb.resize(3 * pixels);
    if (!transparentTrees_.empty()) transmittance_.assign(pixels, 1.0f);
    if (options.channels.rgb && options.shadows) shadowMask_.assign(pixels, 255);
  }

  // The steps of a frame, the last two only with colour. Ranges of tile rows are for any thread.
  void traceOpaque(std::size_t fromTile, std::size_t toTile);
  void prepareOcclusion() { ambientOcclusion_.emplace(frame_.depth, frame_.camera); }
  void finishRows(std::size_t fromTile, std::size_t toTile);

  Frame takeFrame() {
    if (!options_.channels.depth) frame_.depth = {};
    return std::move(frame_);
  }

 private:
  TraceContext makeTraceContext(const std::vector<const RayTree*>& trees) const {
    return {
        trees, rays_, shading_, origin_, options_.hiddenEntity, options_.channels.isDepthOnly()};
  }
  int endRow(std::size_t tile) const {
    return std::min(rays_.height, static_cast<int>(tile) * kTileSize + kTileSize);
  }

  void writeDepthRow(const TraceContext& trace, int y, std::span<const HitKey> keys,
                     RecentCache<CachedPlane>& recent);
  void shadeRow(const TraceContext& trace, int y, std::span<const HitKey> keys,
                RecentCache<ShadedTriangle>& recent);
  void blendTransparent(const TraceContext& trace, int y, RecentCache<ShadedTriangle>& recent);
  void encodeRow(int y, std::span<std::uint8_t> visibility);

  const FrameOptions& options_;
  Frame frame_;
  PrimaryRays rays_;
  Shading shading_;
  std::vector<const RayTree*> opaqueTrees_, transparentTrees_;
  Vec3 origin_;
  std::vector<glsl::vec3> linearColours_;
  std::vector<float> transmittance_;      ///< of the transparent surfaces per pixel; empty: none
  std::vector<std::uint8_t> shadowMask_;  ///< empty: no shadows
  std::optional<AmbientOcclusion> ambientOcclusion_;
};

void FrameTracer::traceOpaque(std::size_t fromTile, std::size_t toTile) {
  const TraceContext trace = makeTraceContext(opaqueTrees_);
  const bool shaded = options_.channels.rgb || options_.channels.normals;
  std::vector<HitKey> keys;
  RecentCache<CachedPlane> planes;
  RecentCache<ShadedTriangle> triangles;
  for (std::size_t tile = fromTile; tile < toTile; ++tile) {
    const int top = static_cast<int>(tile) * kTileSize;
    traceRows(trace, top, keys);
    const auto row = [&](int y) {
      const auto width = static_cast<std::size_t>(rays_.width);
      return std::span<const HitKey>(keys).subspan(static_cast<std::size_t>(y - top) * width,
                                                   width);
    };
    for (int y = top; y < endRow(tile); ++y) writeDepthRow(trace, y, row(y), planes);
    if (!shadowMask_.empty()) traceShadowRows(trace, top, frame_.depth, shadowMask_);
    for (int y = top; shaded && y < endRow(tile); ++y) shadeRow(trace, y, row(y), triangles);
  }
}

void FrameTracer::writeDepthRow(const TraceContext& trace, int y, std::span<const HitKey> keys,
                                RecentCache<CachedPlane>& recent) {
  for (std::size_t x = 0; x < keys.size();) {
    const HitKey key = keys[x];
    std::size_t end = x + 1;
    while (end < keys.size() && keys[end] == key) ++end;
    if (key != kNoHit) {
      const CachedPlane& cached = recent.getOrMake(key, [&] {
        const BatchTriangle triangle = findTriangle(trace, key);
        return CachedPlane{computePlaneDepth(triangle.corners(rays_.eye), rays_),
                           triangle.batch->id};
      });
      const std::size_t first = rays_.pixelIndex(static_cast<int>(x), y), count = end - x;
      if (!frame_.depth.empty())
        fillDepth(cached.depth, static_cast<int>(x), y,
                  std::span(frame_.depth).subspan(first, count));
      if (!frame_.ids.empty())
        std::fill_n(frame_.ids.begin() + static_cast<std::ptrdiff_t>(first), count, cached.id);
    }
    x = end;
  }
}

void FrameTracer::shadeRow(const TraceContext& trace, int y, std::span<const HitKey> keys,
                           RecentCache<ShadedTriangle>& recent) {
  for (int x = 0; x < rays_.width; ++x) {
    const HitKey key = keys[static_cast<std::size_t>(x)];
    const std::size_t pixel = rays_.pixelIndex(x, y);
    if (key == kNoHit) {
      if (options_.channels.rgb) linearColours_[pixel] = shading_.shadeSky(x, y);
      continue;
    }
    const ShadedTriangle& triangle =
        recent.getOrMake(key, [&] { return ShadedTriangle(findTriangle(trace, key), rays_); });
    if (options_.channels.rgb) {
      const float sunlit = shadowMask_.empty() || shadowMask_[pixel] != 0 ? 1.0f : 0.0f;
      linearColours_[pixel] =
          shading_.shadeSurface(triangle, x, y, triangle.depth.at(x, y), sunlit).rgb;
    }
    if (options_.channels.normals) {
      const Vec3 normal = shading_.computeNormal(triangle, x, y);
      for (int i = 0; i < 3; ++i)
        frame_.normals[3 * pixel + static_cast<std::size_t>(i)] = static_cast<float>(normal[i]);
    }
  }
}

void FrameTracer::finishRows(std::size_t fromTile, std::size_t toTile) {
  const TraceContext trace = makeTraceContext(transparentTrees_);
  RecentCache<ShadedTriangle> triangles;
  std::vector<std::uint8_t> visibility(static_cast<std::size_t>(rays_.width));
  for (std::size_t tile = fromTile; tile < toTile; ++tile) {
    const int top = static_cast<int>(tile) * kTileSize;
    if (!transparentTrees_.empty()) blendTransparent(trace, top, triangles);
    for (int y = top; y < endRow(tile); ++y) encodeRow(y, visibility);
  }
}

void FrameTracer::blendTransparent(const TraceContext& trace, int y,
                                   RecentCache<ShadedTriangle>& recent) {
  struct Layer {
    std::uint32_t pixel;
    double z;
    HitKey key;
  };
  std::vector<PixelHit> hits;
  traceAllHits(trace, y, frame_.depth, hits);
  const auto triangle = [&](HitKey key) -> const ShadedTriangle& {
    return recent.getOrMake(key, [&] { return ShadedTriangle(findTriangle(trace, key), rays_); });
  };
  const auto column = [&](std::uint32_t pixel) { return static_cast<int>(pixel) % rays_.width; };
  const auto row = [&](std::uint32_t pixel) { return static_cast<int>(pixel) / rays_.width; };
  std::vector<Layer> layers;
  for (const PixelHit& hit : hits) {
    const ShadedTriangle& shadedTriangle = triangle(hit.key);
    if (shadedTriangle.batch->id == options_.hiddenEntity) continue;
    const double z = shadedTriangle.depth.at(column(hit.pixel), row(hit.pixel));
    if (z >= static_cast<double>(frame_.depth[hit.pixel])) continue;  // never of a NaN
    layers.push_back({hit.pixel, z, hit.key});
  }
  // The key makes the order of coincident surfaces deterministic.
  std::sort(layers.begin(), layers.end(), [](const Layer& a, const Layer& b) {
    return std::tuple(a.pixel, -a.z, a.key) < std::tuple(b.pixel, -b.z, b.key);
  });
  const Layer* previous = nullptr;
  for (const Layer& layer : layers) {
    // A ray through a common edge hits both triangles; the surface must tint only once.
    const bool again =
        previous && previous->pixel == layer.pixel &&
        std::abs(previous->z - layer.z) <= 1e-9 * std::abs(layer.z) &&
        haveCommonEdge(findTriangle(trace, previous->key), findTriangle(trace, layer.key));
    previous = &layer;
    if (again) continue;
    const SurfaceColour layerColour = shading_.shadeSurface(
        triangle(layer.key), column(layer.pixel), row(layer.pixel), layer.z, 1.0f);
    linearColours_[layer.pixel] =
        glsl::mix(linearColours_[layer.pixel], layerColour.rgb, layerColour.alpha);
    transmittance_[layer.pixel] *= 1 - layerColour.alpha;
  }
}

/// `visibility` is a scratch row.
void FrameTracer::encodeRow(int y, std::span<std::uint8_t> visibility) {
  ambientOcclusion_->computeRow(y, visibility);
  for (int x = 0; x < rays_.width; ++x) {
    const std::size_t pixel = rays_.pixelIndex(x, y);
    const glsl::vec3& linear = linearColours_[pixel];
    const auto transmittance = static_cast<std::uint8_t>(
        transmittance_.empty() ? 255.0f : 255 * transmittance_[pixel] + 0.5f);
    const std::array rgb{linearToSrgbByteByTable(linear.x), linearToSrgbByteByTable(linear.y),
                         linearToSrgbByteByTable(linear.z)};
    applyAo(rgb.data(), visibility[static_cast<std::size_t>(x)], transmittance,
            &frame_.rgb[3 * pixel]);
  }
}

}  // namespace

struct RayRenderer::State {
  RayScene scene;
  MipTextures textures;
  scene::ThreadPool workers;
  std::string name = scene::getEmbreeName();

  State(std::shared_ptr<const scene::Scene> shared, const RayOptions& options)
      : scene(std::move(shared)), textures(scene.model()), workers(options.threads) {}
};

namespace {

/// Traces the views together, so that all threads have work until the last one.
template <class State>
std::vector<Frame> traceFrames(State& state, std::span<const View> views) {
  std::deque<FrameTracer> tracers;
  std::vector<int> heights, colouredHeights;
  std::vector<FrameTracer*> coloured;
  for (const View& view : views) {
    FrameTracer& tracer =
        tracers.emplace_back(view.camera, view.options, state.scene, state.textures);
    heights.push_back(view.camera.height);
    if (!view.options.channels.rgb) continue;
    coloured.push_back(&tracer);
    colouredHeights.push_back(view.camera.height);
  }
  parallelForTiles(state.workers, heights, [&](std::size_t i, std::size_t from, std::size_t to) {
    tracers[i].traceOpaque(from, to);
  });
  for (FrameTracer* tracer : coloured) tracer->prepareOcclusion();
  parallelForTiles(
      state.workers, colouredHeights,
      [&](std::size_t i, std::size_t from, std::size_t to) { coloured[i]->finishRows(from, to); });
  std::vector<Frame> frames;
  for (FrameTracer& tracer : tracers) frames.push_back(tracer.takeFrame());
  return frames;
}

template <class State>
Frame traceThroughLens(State& state, const View& view) {
  return traceLensFrame(view.camera, view.options, collectFirstHitTrees(state.scene, view.options),
                        state.scene.transparentTrees(), state.scene.origin(), state.textures,
                        state.workers);
}

}  // namespace

RayRenderer::RayRenderer(std::shared_ptr<const scene::Scene> scene, const RayOptions& options)
    : state_(std::make_unique<State>(std::move(scene), options)) {}

RayRenderer::~RayRenderer() = default;

std::vector<Frame> RayRenderer::renderOnce(std::span<const View> views) {
  State& s = *state_;
  // The trees hold one snapshot, and one form of the avatars.
  std::map<std::pair<const scene::Snapshot*, AvatarForm>, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < views.size(); ++i)
    groups[{views[i].snapshot, views[i].options.avatars}].push_back(i);
  std::vector<Frame> frames(views.size());
  for (const auto& [key, group] : groups) {
    s.scene.update(*key.first, key.second);
    std::vector<View> together;
    std::vector<std::size_t> indices;  // of `together`
    std::size_t pixels = 0;
    const auto traceTogether = [&] {
      std::vector<Frame> traced = traceFrames(s, together);
      for (std::size_t i = 0; i < traced.size(); ++i) frames[indices[i]] = std::move(traced[i]);
      together.clear(), indices.clear();
      pixels = 0;
    };
    for (const std::size_t i : group) {
      if (views[i].camera.lens) {
        frames[i] = traceThroughLens(s, views[i]);
        continue;
      }
      const std::size_t more = countPixels(views[i].camera);
      if (pixels + more > kMaxPixelsTogether && !together.empty()) traceTogether();
      together.push_back(views[i]);
      indices.push_back(i);
      pixels += more;
    }
    if (!together.empty()) traceTogether();
  }
  for (Frame& frame : frames) frame.renderer = s.name, frame.software = true;
  return frames;
}

std::vector<std::uint8_t> RayRenderer::computeShadowMask(const scene::Snapshot& snapshot,
                                                         const Camera& camera,
                                                         const FrameOptions& options,
                                                         const std::vector<float>& depth) {
  State& s = *state_;
  s.scene.update(snapshot, options.avatars);
  const std::vector<const RayTree*> trees = collectFirstHitTrees(s.scene, options);
  const PrimaryRays rays = computePrimaryRays(camera);
  const Shading shading(rays, s.textures);
  const TraceContext trace{trees, rays, shading, s.scene.origin(), options.hiddenEntity};
  std::vector<std::uint8_t> mask(depth.size(), 255);
  parallelForTiles(s.workers, std::array{rays.height},
                   [&](std::size_t, std::size_t from, std::size_t to) {
                     for (std::size_t tile = from; tile < to; ++tile)
                       traceShadowRows(trace, static_cast<int>(tile) * kTileSize, depth, mask);
                   });
  return mask;
}

const std::string& RayRenderer::deviceName() const {
  return state_->name;
}
const std::string& RayRenderer::deviceWarning() const {
  static const std::string none;
  return none;
}

}  // namespace enfilade::render
