#include "render/reference/reference_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "render/raytrace/ray_scene.hpp"
#include "render/raytrace/trace.hpp"
#include "scene/base/thread_pool.hpp"

namespace enfilade::render {
namespace {

constexpr double kNoDepth = std::numeric_limits<double>::quiet_NaN();
// Objects closer than this coincide: see ReferenceFrame::ties.
constexpr double kTieDistance = 2e-5, kTieDepthFraction = 1e-6;  // metres; fraction of the depth
constexpr double kEdgeDepthFraction = 1e-3;                      // see ReferenceFrame::edge
// Error bound of Embree's floats: rounding of coordinates up to 1 km from the trees' origin, and of
// distances. Triangles seen edge on have larger errors; see the header's first comment.
constexpr double kFloatError = 2e-4, kFloatErrorFraction = 1e-5;  // metres; fraction of the depth

struct SeenSurface {
  scene::EntityId id;
  double z;
  PlaneDepth plane;
};

/// The exact hit of a pixel's ray with a triangle; nullopt: it misses.
std::optional<SeenSurface> intersectExactly(const TraceContext& trace, HitKey key, int x, int y) {
  const BatchTriangle triangle = findTriangle(trace, key);
  const EyeSpaceCorners corners = triangle.corners(trace.rays.eye);
  const auto w = computeWeights(corners, trace.rays).at(x, y);
  const bool front = w[0] >= 0 && w[1] >= 0 && w[2] >= 0,
             back = w[0] <= 0 && w[1] <= 0 && w[2] <= 0;
  if (!front && !back) return std::nullopt;
  const PlaneDepth plane = computePlaneDepth(corners, trace.rays);
  const double z = plane.numerator.at(x, y) / plane.denominator.at(x, y);
  if (!(z >= trace.rays.near && z <= trace.rays.far)) return std::nullopt;
  const scene::Material& material = *triangle.batch->material;
  if (material.alpha == scene::Material::Alpha::mask) {
    const ShadedTriangle shaded(triangle, trace.rays);
    const float alpha = trace.shading.computeAlbedo(shaded, x, y)[3];
    if (alpha < material.alphaCutoff) return std::nullopt;
  }
  return SeenSurface{triangle.batch->id, z, plane};
}

/// Builds one reference frame; several threads may resolve rows.
class ReferenceFrameBuilder {
 public:
  ReferenceFrameBuilder(const Camera& camera, const FrameOptions& options, RayScene& scene,
                        const MipTextures& textures)
      : rays_(computePrimaryRays(camera)),
        shading_(rays_, textures),
        trees_(scene.opaqueTrees()),
        trace_{trees_, rays_, shading_, scene.origin(), options.hiddenEntity} {
    if (options.transparency == TransparencyMode::opaque) {
      const std::vector<const RayTree*> transparentTrees = scene.transparentTrees();
      trees_.insert(trees_.end(), transparentTrees.begin(), transparentTrees.end());
    }
    const auto pixels = countPixels(camera);
    frame.camera = camera;
    frame.ids.resize(pixels);
    frame.depth.assign(pixels, kNoDepth);
    planes_.resize(pixels);
  }

  ReferenceFrame frame;

  void resolveRows(std::size_t from, std::size_t to) {
    std::vector<ReferenceFrame::Tie> ties;
    std::size_t undecided = 0;
    for (int y = static_cast<int>(from); y < static_cast<int>(to); ++y) {
      for (int x = 0; x < rays_.width; ++x) {
        if (!resolvePixel(x, y, ties)) ++undecided;
      }
    }
    const std::lock_guard lock(mutex_);
    frame.undecided += undecided;
    frame.ties.insert(frame.ties.end(), ties.begin(), ties.end());
  }

  void finish() {
    std::sort(frame.ties.begin(), frame.ties.end(),
              [](const ReferenceFrame::Tie& a, const ReferenceFrame::Tie& b) {
                return std::pair(a.pixel, a.id) < std::pair(b.pixel, b.id);
              });
    frame.edge.resize(frame.ids.size());
    for (int y = 0; y < rays_.height; ++y)
      for (int x = 0; x < rays_.width; ++x) frame.edge[rays_.pixelIndex(x, y)] = isAtEdge(x, y);
  }

 private:
  /// False if the search was abandoned.
  bool resolvePixel(int x, int y, std::vector<ReferenceFrame::Tie>& ties) {
    double from = rays_.near;
    std::vector<HitKey> keys;
    for (int step = 0; step < ReferenceFrame::kMaxSteps; ++step) {
      const double z = traceFirstBehind(trace_, x, y, from);
      if (std::isnan(z)) return true;
      const double slack = kFloatError + kFloatErrorFraction * z;
      keys.clear();
      traceBetween(trace_, x, y, std::max(rays_.near, z - slack), z + slack, keys);
      if (chooseNearest(keys, x, y, ties)) return true;
      from = z + slack;
    }
    return false;
  }

  bool chooseNearest(const std::vector<HitKey>& keys, int x, int y,
                     std::vector<ReferenceFrame::Tie>& ties) {
    std::vector<SeenSurface> surfaces;
    for (const HitKey key : keys)
      if (const auto surface = intersectExactly(trace_, key, x, y)) surfaces.push_back(*surface);
    if (surfaces.empty()) return false;
    const auto first = std::min_element(surfaces.begin(), surfaces.end(),
                                        [](const SeenSurface& a, const SeenSurface& b) {
                                          return std::pair(a.z, a.id) < std::pair(b.z, b.id);
                                        });
    const std::size_t pixel = rays_.pixelIndex(x, y);
    frame.ids[pixel] = first->id;
    frame.depth[pixel] = first->z;
    planes_[pixel] = first->plane;
    for (const SeenSurface& other : surfaces) {
      if (other.id != first->id &&
          other.z - first->z <= kTieDistance + kTieDepthFraction * first->z)
        ties.push_back({static_cast<std::uint32_t>(pixel), other.id});
    }
    return true;
  }

  bool isAtEdge(int x, int y) const {
    const std::size_t here = rays_.pixelIndex(x, y);
    for (int v = std::max(0, y - 1); v <= std::min(rays_.height - 1, y + 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(rays_.width - 1, x + 1); ++u) {
        const std::size_t there = rays_.pixelIndex(u, v);
        if (frame.ids[there] != frame.ids[here]) return true;
        if (frame.ids[here] == 0) continue;
        const PlaneDepth& plane = planes_[here];
        const double expected = plane.numerator.at(u, v) / plane.denominator.at(u, v);
        if (!(std::abs(frame.depth[there] - expected) <= kEdgeDepthFraction * frame.depth[here]))
          return true;
      }
    }
    return false;
  }

  PrimaryRays rays_;
  Shading shading_;
  std::vector<const RayTree*> trees_;
  TraceContext trace_;
  std::vector<PlaneDepth> planes_;
  std::mutex mutex_;
};

}  // namespace

struct ReferenceTracer::State {
  RayScene scene;
  MipTextures textures;
  scene::ThreadPool workers;

  State(std::shared_ptr<const scene::Scene> shared, int threads)
      : scene(std::move(shared)), textures(scene.model()), workers(threads) {}
};

ReferenceTracer::ReferenceTracer(std::shared_ptr<const scene::Scene> scene, int threads)
    : state_(std::make_unique<State>(std::move(scene), threads)) {}

ReferenceTracer::~ReferenceTracer() = default;

ReferenceFrame ReferenceTracer::render(const scene::Snapshot& snapshot, const Camera& camera,
                                       const FrameOptions& options) {
  if (const auto error = validateCamera(camera)) throw RenderError(*error);
  state_->scene.update(snapshot, options.avatars);
  ReferenceFrameBuilder builder(camera, options, state_->scene, state_->textures);
  constexpr std::size_t kRows = 8;  // per task
  state_->workers.parallelFor(
      static_cast<std::size_t>(camera.height), kRows,
      [&](std::size_t from, std::size_t to) { builder.resolveRows(from, to); });
  builder.finish();
  return std::move(builder.frame);
}

}  // namespace enfilade::render
