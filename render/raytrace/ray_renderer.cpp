// A picture, step by step: rays in packets find each pixel's triangle; depth, id and normal follow
// from that triangle's corners in doubles, run by run along the rows; then, where shadows are asked
// for, a ray from there towards the sun; then its colour. Over the
// whole picture then come glass from back to front, and hollows. Rows are shared among threads;
// no pixel's result depends on another's thread.
#include "render/raytrace/ray_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "render/ambient_occlusion.hpp"
#include "render/raytrace/ray_scene.hpp"
#include "render/raytrace/trace.hpp"
#include "scene/physics/thread_pool.hpp"

namespace enfilade::render {
namespace {

/// Remembers what was made for the last keys; neighbouring rows meet the same triangles.
template <class Value>
class Recent {
 public:
  template <class Make>
  const Value& of(HitKey key, const Make& make) {
    // The triangle's number, spread by Fibonacci's constant, chooses the place.
    Place& place = places_[(key * 0x9E37'79B9'7F4A'7C15u) >> (64 - kBits)];
    if (place.key != key || !place.value) {
      place.value.emplace(make());
      place.key = key;
    }
    return *place.value;
  }

 private:
  static constexpr int kBits = 7;
  struct Place {
    HitKey key = kMissed;
    std::optional<Value> value;
  };
  std::vector<Place> places_ = std::vector<Place>(std::size_t{1} << kBits);
};

struct SeenPlane {
  DepthOfPlane depth;
  scene::EntityId id;
};

/// Fills the depths of a run of pixels that see one triangle.
void fillDepth(const DepthOfPlane& plane, int x, int y, std::span<float> out) {
  const double over = plane.over.at(x, y), under = plane.under.at(x, y);
  const int count = static_cast<int>(out.size());
  for (int i = 0; i < count; ++i) {
    const double z = (over + i * plane.over.dx) / (under + i * plane.under.dx);
    out[static_cast<std::size_t>(i)] = static_cast<float>(plane.bounded(z));
  }
}

/// What depth and ids show; with solid glass, it too.
std::vector<const RayTree*> firstHitsOf(RayScene& scene, Glass glass) {
  std::vector<const RayTree*> trees = scene.solid();
  if (glass == Glass::clear) return trees;
  const std::vector<const RayTree*> panes = scene.glass();
  trees.insert(trees.end(), panes.begin(), panes.end());
  return trees;
}

/// Calls `work(from, to)` for tiles of rows that reach over a picture, on several threads.
template <class Work>
void shareTiles(scene::Workers& workers, int height, const Work& work) {
  constexpr std::size_t kBlock = 4;  // rows of tiles that a thread takes at a time
  workers.share(static_cast<std::size_t>((height + kTile - 1) / kTile), kBlock, work);
}

/// One picture in the making.
class Picture {
 public:
  Picture(const Camera& camera, const FrameOptions& options, RayScene& scene,
          const MipTextures& textures)
      : options_(options),
        rays_(pixelRaysOf(camera)),
        shading_(rays_, textures),
        solid_(firstHitsOf(scene, options.glass)),
        origin_(scene.origin()) {
    if (options.channels.rgb && options.glass == Glass::clear) glass_ = scene.glass();
    const auto pixels =
        static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    frame.camera = camera;
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    if (options.channels.depth || options.channels.rgb) frame.depth.assign(pixels, kNothing);
    if (options.channels.ids) frame.ids.assign(pixels, 0);
    if (options.channels.normals) frame.normals.assign(3 * pixels, 0.0f);
    if (options.channels.rgb) linear_.resize(pixels), frame.rgb.resize(3 * pixels);
    if (!glass_.empty()) clear_.assign(pixels, 1.0f);
    if (options.channels.rgb && options.shadows) sunlit_.assign(pixels, 255);
  }

  Frame frame;

  void draw(scene::Workers& workers) {
    const int height = rays_.height;
    shareTiles(workers, height, [&](std::size_t from, std::size_t to) { drawSolid(from, to); });
    if (!options_.channels.rgb) return;
    hollows_.emplace(frame.depth, frame.camera);
    shareTiles(workers, height, [&](std::size_t from, std::size_t to) { finish(from, to); });
    if (!options_.channels.depth) frame.depth = {};
  }

 private:
  Casting casting(const std::vector<const RayTree*>& trees) const {
    return {trees, rays_, shading_, origin_, options_.hidden};
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(rays_.width) +
           static_cast<std::size_t>(x);
  }
  int endRow(std::size_t tile) const {
    return std::min(rays_.height, static_cast<int>(tile) * kTile + kTile);
  }

  void drawSolid(std::size_t fromTile, std::size_t toTile);
  void measureRow(const Casting& with, int y, std::span<const HitKey> keys,
                  Recent<SeenPlane>& recent);
  void paintRow(const Casting& with, int y, std::span<const HitKey> keys,
                Recent<ShadedTriangle>& recent);
  void finish(std::size_t fromTile, std::size_t toTile);
  void blendGlass(const Casting& with, int y, Recent<ShadedTriangle>& recent);
  void encodeRow(int y, std::span<std::uint8_t> left);

  const FrameOptions& options_;
  PixelRays rays_;
  Shading shading_;
  std::vector<const RayTree*> solid_, glass_;
  Vec3 origin_;
  std::vector<glsl::vec3> linear_;
  std::vector<float> clear_;  ///< how much of what glass lies before is seen; empty: no glass
  std::vector<std::uint8_t> sunlit_;  ///< empty: all is
  std::optional<Hollows> hollows_;
};

void Picture::drawSolid(std::size_t fromTile, std::size_t toTile) {
  const Casting with = casting(solid_);
  const bool painted = options_.channels.rgb || options_.channels.normals;
  std::vector<HitKey> keys;
  Recent<SeenPlane> planes;
  Recent<ShadedTriangle> triangles;
  for (std::size_t tile = fromTile; tile < toTile; ++tile) {
    const int top = static_cast<int>(tile) * kTile;
    castRows(with, top, keys);
    const auto row = [&](int y) {
      const auto width = static_cast<std::size_t>(rays_.width);
      return std::span<const HitKey>(keys).subspan(static_cast<std::size_t>(y - top) * width,
                                                   width);
    };
    for (int y = top; y < endRow(tile); ++y) measureRow(with, y, row(y), planes);
    if (!sunlit_.empty()) castSunRows(with, top, frame.depth, sunlit_);
    for (int y = top; painted && y < endRow(tile); ++y) paintRow(with, y, row(y), triangles);
  }
}

void Picture::measureRow(const Casting& with, int y, std::span<const HitKey> keys,
                         Recent<SeenPlane>& recent) {
  for (std::size_t x = 0; x < keys.size();) {
    const HitKey key = keys[x];
    std::size_t end = x + 1;
    while (end < keys.size() && keys[end] == key) ++end;
    if (key != kMissed) {
      const SeenPlane& seen = recent.of(key, [&] {
        const PieceTriangle triangle = triangleOf(with, key);
        return SeenPlane{depthOf(triangle.corners(rays_.eye), rays_), triangle.piece->id};
      });
      const std::size_t first = index(static_cast<int>(x), y), count = end - x;
      if (!frame.depth.empty())
        fillDepth(seen.depth, static_cast<int>(x), y, std::span(frame.depth).subspan(first, count));
      if (!frame.ids.empty())
        std::fill_n(frame.ids.begin() + static_cast<std::ptrdiff_t>(first), count, seen.id);
    }
    x = end;
  }
}

void Picture::paintRow(const Casting& with, int y, std::span<const HitKey> keys,
                       Recent<ShadedTriangle>& recent) {
  for (int x = 0; x < rays_.width; ++x) {
    const HitKey key = keys[static_cast<std::size_t>(x)];
    const std::size_t pixel = index(x, y);
    if (key == kMissed) {
      if (options_.channels.rgb) linear_[pixel] = shading_.sky(x, y);
      continue;
    }
    const ShadedTriangle& triangle =
        recent.of(key, [&] { return ShadedTriangle(triangleOf(with, key), rays_); });
    if (options_.channels.rgb) {
      const float sunlit = sunlit_.empty() || sunlit_[pixel] != 0 ? 1.0f : 0.0f;
      linear_[pixel] = shading_.colour(triangle, x, y, triangle.depth.at(x, y), sunlit).rgb;
    }
    if (options_.channels.normals) {
      const Vec3 normal = shading_.normal(triangle, x, y);
      for (int i = 0; i < 3; ++i)
        frame.normals[3 * pixel + static_cast<std::size_t>(i)] = static_cast<float>(normal[i]);
    }
  }
}

void Picture::finish(std::size_t fromTile, std::size_t toTile) {
  const Casting with = casting(glass_);
  Recent<ShadedTriangle> triangles;
  std::vector<std::uint8_t> left(static_cast<std::size_t>(rays_.width));
  for (std::size_t tile = fromTile; tile < toTile; ++tile) {
    const int top = static_cast<int>(tile) * kTile;
    if (!glass_.empty()) blendGlass(with, top, triangles);
    for (int y = top; y < endRow(tile); ++y) encodeRow(y, left);
  }
}

void Picture::blendGlass(const Casting& with, int y, Recent<ShadedTriangle>& recent) {
  struct Pane {
    std::uint32_t pixel;
    double z;
    HitKey key;
  };
  std::vector<Crossing> crossings;
  castThroughRows(with, y, frame.depth, crossings);
  const auto triangle = [&](HitKey key) -> const ShadedTriangle& {
    return recent.of(key, [&] { return ShadedTriangle(triangleOf(with, key), rays_); });
  };
  const auto column = [&](std::uint32_t pixel) { return static_cast<int>(pixel) % rays_.width; };
  const auto row = [&](std::uint32_t pixel) { return static_cast<int>(pixel) / rays_.width; };
  std::vector<Pane> panes;
  for (const Crossing& crossing : crossings) {
    const ShadedTriangle& seen = triangle(crossing.key);
    if (seen.piece->id == options_.hidden) continue;
    const double z = seen.depth.at(column(crossing.pixel), row(crossing.pixel));
    if (z >= static_cast<double>(frame.depth[crossing.pixel])) continue;  // never of a NaN
    panes.push_back({crossing.pixel, z, crossing.key});
  }
  // The key only decides between panes in one place, so that threads do not.
  std::sort(panes.begin(), panes.end(), [](const Pane& a, const Pane& b) {
    return std::tuple(a.pixel, -a.z, a.key) < std::tuple(b.pixel, -b.z, b.key);
  });
  const Pane* before = nullptr;
  for (const Pane& pane : panes) {
    // A ray through the edge of two triangles meets both; a surface tints once.
    const bool again = before && before->pixel == pane.pixel &&
                       std::abs(before->z - pane.z) <= 1e-9 * std::abs(pane.z) &&
                       shareEdge(triangleOf(with, before->key), triangleOf(with, pane.key));
    before = &pane;
    if (again) continue;
    const SurfaceColour glass =
        shading_.colour(triangle(pane.key), column(pane.pixel), row(pane.pixel), pane.z, 1.0f);
    linear_[pane.pixel] = glsl::mix(linear_[pane.pixel], glass.rgb, glass.alpha);
    clear_[pane.pixel] *= 1 - glass.alpha;
  }
}

/// `left` has room for a row.
void Picture::encodeRow(int y, std::span<std::uint8_t> left) {
  hollows_->row(y, left);
  for (int x = 0; x < rays_.width; ++x) {
    const std::size_t pixel = index(x, y);
    const glsl::vec3& linear = linear_[pixel];
    const auto clear =
        static_cast<std::uint8_t>(clear_.empty() ? 255.0f : 255 * clear_[pixel] + 0.5f);
    const std::array rgb{srgbOfLinear(linear.x), srgbOfLinear(linear.y), srgbOfLinear(linear.z)};
    darken(rgb.data(), left[static_cast<std::size_t>(x)], clear, &frame.rgb[3 * pixel]);
  }
}

}  // namespace

struct RayRenderer::State {
  RayScene scene;
  MipTextures textures;
  scene::Workers workers;
  std::string name = embreeName();

  State(std::shared_ptr<const scene::Scene> shared, const RayOptions& options)
      : scene(std::move(shared), options.robust, maskFilter()),
        textures(scene.model()),
        workers(options.threads) {}
};

RayRenderer::RayRenderer(std::shared_ptr<const scene::Scene> scene, const RayOptions& options)
    : state_(std::make_unique<State>(std::move(scene), options)) {}

RayRenderer::~RayRenderer() = default;

Frame RayRenderer::render(const scene::Snapshot& snapshot, const Camera& camera,
                          const FrameOptions& options) {
  if (const auto why = refusal(camera)) throw RenderError(*why);
  state_->scene.follow(snapshot);
  Picture picture(camera, options, state_->scene, state_->textures);
  picture.draw(state_->workers);
  picture.frame.tick = snapshot.tick;
  picture.frame.renderer = state_->name;
  picture.frame.software = true;
  return std::move(picture.frame);
}

std::vector<std::uint8_t> RayRenderer::sunlit(const scene::Snapshot& snapshot, const Camera& camera,
                                              const FrameOptions& options,
                                              const std::vector<float>& depth) {
  if (const auto why = refusal(camera)) throw RenderError(*why);
  State& s = *state_;
  s.scene.follow(snapshot);
  const std::vector<const RayTree*> trees = firstHitsOf(s.scene, options.glass);
  const PixelRays rays = pixelRaysOf(camera);
  const Shading shading(rays, s.textures);
  const Casting casting{trees, rays, shading, s.scene.origin(), options.hidden};
  std::vector<std::uint8_t> sunlit(depth.size(), 255);
  shareTiles(s.workers, rays.height, [&](std::size_t from, std::size_t to) {
    for (std::size_t tile = from; tile < to; ++tile)
      castSunRows(casting, static_cast<int>(tile) * kTile, depth, sunlit);
  });
  return sunlit;
}

const std::string& RayRenderer::deviceName() const {
  return state_->name;
}

}  // namespace enfilade::render
