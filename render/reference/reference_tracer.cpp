#include "render/reference/reference_tracer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "render/raytrace/ray_scene.hpp"
#include "render/raytrace/trace.hpp"
#include "scene/physics/thread_pool.hpp"

namespace enfilade::render {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
// Objects nearer to one another than this are in one place: see TrueFrame::ties.
constexpr double kTie = 2e-5, kTieOfDepth = 1e-6;  // metres, of the depth
constexpr double kEdgeOfDepth = 1e-3;              // see TrueFrame::edge
// What Embree's floats may be off: the rounding of coordinates up to 1 km from the trees' origin,
// and of distances. Triangles seen edge on are off by more; see the head of the header.
constexpr double kFloatError = 2e-4, kFloatErrorOfDepth = 1e-5;  // metres, of the depth

struct Surface {
  scene::EntityId id;
  double z;
  DepthOfPlane plane;
};

/// The triangle where the pixel's ray truly meets it.
std::optional<Surface> metBy(const Casting& casting, HitKey key, int x, int y) {
  const PieceTriangle triangle = triangleOf(casting, key);
  const SeenCorners corners = triangle.corners(casting.rays.eye);
  const auto w = weightsOf(corners, casting.rays).at(x, y);
  const bool front = w[0] >= 0 && w[1] >= 0 && w[2] >= 0,
             back = w[0] <= 0 && w[1] <= 0 && w[2] <= 0;
  if (!front && !back) return std::nullopt;
  const DepthOfPlane plane = depthOf(corners, casting.rays);
  const double z = plane.over.at(x, y) / plane.under.at(x, y);
  if (!(z >= casting.rays.near && z <= casting.rays.far)) return std::nullopt;
  if (triangle.piece->pass == Pass::mask) {
    const ShadedTriangle shaded(triangle, casting.rays);
    const float alpha = casting.shading.albedo(shaded, x, y)[3];
    if (alpha < triangle.piece->material->surface[0]) return std::nullopt;
  }
  return Surface{triangle.piece->id, z, plane};
}

/// One picture's truth in the making; rows may be looked at by several threads.
class Looking {
 public:
  Looking(const Camera& camera, const FrameOptions& options, RayScene& scene,
          const MipTextures& textures)
      : rays_(pixelRaysOf(camera)),
        shading_(rays_, textures),
        trees_(scene.solid()),
        casting_{trees_, rays_, shading_, scene.origin(), options.hidden} {
    if (options.glass == Glass::solid) {
      const std::vector<const RayTree*> glass = scene.glass();
      trees_.insert(trees_.end(), glass.begin(), glass.end());
    }
    const auto pixels =
        static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    truth.camera = camera;
    truth.ids.resize(pixels);
    truth.depth.assign(pixels, kNothing);
    planes_.resize(pixels);
  }

  TrueFrame truth;

  void lookAtRows(std::size_t from, std::size_t to) {
    std::vector<TrueFrame::Tie> ties;
    std::size_t undecided = 0;
    for (int y = static_cast<int>(from); y < static_cast<int>(to); ++y) {
      for (int x = 0; x < rays_.width; ++x) {
        if (!lookAt(x, y, ties)) ++undecided;
      }
    }
    const std::lock_guard lock(mutex_);
    truth.undecided += undecided;
    truth.ties.insert(truth.ties.end(), ties.begin(), ties.end());
  }

  void finish() {
    std::sort(truth.ties.begin(), truth.ties.end(),
              [](const TrueFrame::Tie& a, const TrueFrame::Tie& b) {
                return std::pair(a.pixel, a.id) < std::pair(b.pixel, b.id);
              });
    truth.edge.resize(truth.ids.size());
    for (int y = 0; y < rays_.height; ++y)
      for (int x = 0; x < rays_.width; ++x) truth.edge[index(x, y)] = atEdge(x, y);
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(rays_.width) +
           static_cast<std::size_t>(x);
  }

  /// False where the search was given up.
  bool lookAt(int x, int y, std::vector<TrueFrame::Tie>& ties) {
    double from = rays_.near;
    std::vector<HitKey> keys;
    for (int step = 0; step < TrueFrame::kMostSteps; ++step) {
      const double z = castBehind(casting_, x, y, from);
      if (std::isnan(z)) return true;
      const double slack = kFloatError + kFloatErrorOfDepth * z;
      keys.clear();
      castBetween(casting_, x, y, std::max(rays_.near, z - slack), z + slack, keys);
      if (settle(keys, x, y, ties)) return true;
      from = z + slack;
    }
    return false;
  }

  bool settle(const std::vector<HitKey>& keys, int x, int y, std::vector<TrueFrame::Tie>& ties) {
    std::vector<Surface> met;
    for (const HitKey key : keys)
      if (const auto surface = metBy(casting_, key, x, y)) met.push_back(*surface);
    if (met.empty()) return false;
    const auto first =
        std::min_element(met.begin(), met.end(), [](const Surface& a, const Surface& b) {
          return std::pair(a.z, a.id) < std::pair(b.z, b.id);
        });
    const std::size_t pixel = index(x, y);
    truth.ids[pixel] = first->id;
    truth.depth[pixel] = first->z;
    planes_[pixel] = first->plane;
    for (const Surface& other : met) {
      if (other.id != first->id && other.z - first->z <= kTie + kTieOfDepth * first->z)
        ties.push_back({static_cast<std::uint32_t>(pixel), other.id});
    }
    return true;
  }

  bool atEdge(int x, int y) const {
    const std::size_t here = index(x, y);
    for (int v = std::max(0, y - 1); v <= std::min(rays_.height - 1, y + 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(rays_.width - 1, x + 1); ++u) {
        const std::size_t there = index(u, v);
        if (truth.ids[there] != truth.ids[here]) return true;
        if (truth.ids[here] == 0) continue;
        const DepthOfPlane& plane = planes_[here];
        const double expected = plane.over.at(u, v) / plane.under.at(u, v);
        if (!(std::abs(truth.depth[there] - expected) <= kEdgeOfDepth * truth.depth[here]))
          return true;
      }
    }
    return false;
  }

  PixelRays rays_;
  Shading shading_;
  std::vector<const RayTree*> trees_;
  Casting casting_;
  std::vector<DepthOfPlane> planes_;
  std::mutex mutex_;
};

}  // namespace

struct TrueRays::State {
  RayScene scene;
  MipTextures textures;
  scene::Workers workers;

  State(std::shared_ptr<const scene::Scene> shared, int threads)
      : scene(std::move(shared), true, maskFilter()), textures(scene.model()), workers(threads) {}
};

TrueRays::TrueRays(std::shared_ptr<const scene::Scene> scene, int threads)
    : state_(std::make_unique<State>(std::move(scene), threads)) {}

TrueRays::~TrueRays() = default;

TrueFrame TrueRays::look(const scene::Snapshot& snapshot, const Camera& camera,
                         const FrameOptions& options) {
  if (const auto why = refusal(camera)) throw RenderError(*why);
  state_->scene.follow(snapshot);
  Looking looking(camera, options, state_->scene, state_->textures);
  constexpr std::size_t kRows = 8;  // that a thread takes at a time
  state_->workers.share(static_cast<std::size_t>(camera.height), kRows,
                        [&](std::size_t from, std::size_t to) { looking.lookAtRows(from, to); });
  looking.finish();
  return std::move(looking.truth);
}

}  // namespace enfilade::render
