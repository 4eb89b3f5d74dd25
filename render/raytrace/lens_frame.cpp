// Depth and shading are affine in the pixel of a pinhole camera (projected_triangle.hpp). So each
// ray is expressed in one of six pinhole cameras, which look along the camera's axes, as the faces
// of a cube. The ray goes through a point between the pixels of that camera.
#include "render/raytrace/lens_frame.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <unordered_map>

#include "render/ambient_occlusion.hpp"
#include "render/camera/lens.hpp"

namespace enfilade::render {
namespace {

constexpr int kMinFaceSize = 16, kMaxFaceSize = 4096;  // pixels; it decides the textures' level

/// A pinhole camera of 90 degrees, and the sources of shading.
struct Face {
  Camera camera;
  PrimaryRays rays;
  Shading shading;
  std::unordered_map<HitKey, ShadedTriangle> triangles = {};  ///< of recent hits

  Face(const Camera& facing, const MipTextures& textures)
      : camera(facing), rays(computePrimaryRays(camera)), shading(rays, textures) {}
};

/// The ray of a pixel as a point of a face.
struct FacePoint {
  std::size_t face = 0;
  double x = 0, y = 0;  ///< pixels of the face; 0: the centre of the first one
  double length = 1;    ///< of the face's direction there; depth times it is the range
};

std::vector<Camera> makeFaceCameras(const Camera& camera, double pixelsPerRadian) {
  const Vec3 forward = camera.forward.stableNormalized();
  const Vec3 right = forward.cross(camera.up.stableNormalized()).normalized();
  const Vec3 up = right.cross(forward);
  const int size =
      static_cast<int>(std::clamp(2 * pixelsPerRadian, double{kMinFaceSize}, double{kMaxFaceSize}));
  std::vector<Camera> faces;
  for (const auto& [ahead, above] : {std::pair<Vec3, Vec3>{forward, up},
                                     {-forward, up},
                                     {right, up},
                                     {-right, up},
                                     {up, -forward},
                                     {-up, forward}}) {
    Camera face;
    face.eye = camera.eye;
    face.forward = ahead;
    face.up = above;
    face.width = face.height = size;
    face.pinhole = Pinhole{0.5 * size, 0.5 * size, 0.5 * size, 0.5 * size};
    face.near =
        camera.near / 2;  // rays are clipped by their own length, up to sqrt(3) of the depth
    face.far = camera.far;
    faces.push_back(face);
  }
  return faces;
}

class LensTracer {
 public:
  LensTracer(const Camera& camera, const FrameOptions& options, const LensMapping& lens,
             const std::vector<const RayTree*>& opaqueTrees,
             const std::vector<const RayTree*>& transparentTrees, const Vec3& origin,
             const MipTextures& textures, Frame& frame, std::vector<std::uint8_t>& transmittance)
      : camera_(camera),
        options_(options),
        lens_(lens),
        opaqueTrees_(opaqueTrees),
        transparentTrees_(transparentTrees),
        origin_(origin),
        frame_(frame),
        transmittance_(transmittance) {
    faces_.reserve(6);
    for (const Camera& face : makeFaceCameras(camera, lens.pixelsPerRadian()))
      faces_.emplace_back(std::make_unique<Face>(face, textures));
  }

  void traceRow(int y) {
    for (int x = 0; x < camera_.width; ++x) {
      const auto direction = lens_.directionAt(x + 0.5, y + 0.5);
      if (direction) tracePixel(static_cast<std::size_t>(y) * camera_.width + x, *direction);
    }
  }

 private:
  FacePoint findFacePoint(const Vec3& direction) const {
    FacePoint best;
    double ahead = 0;
    for (std::size_t i = 0; i < faces_.size(); ++i)
      if (const double d = direction.dot(faces_[i]->camera.forward.normalized()); d > ahead)
        ahead = d, best.face = i;
    const Face& face = *faces_[best.face];
    const Vec3 forward = face.camera.forward.normalized(), up = face.camera.up.normalized();
    const Vec3 right = forward.cross(up);
    const Pinhole& pinhole = *face.camera.pinhole;
    best.x = pinhole.cx + pinhole.fx * direction.dot(right) / ahead - 0.5;
    best.y = pinhole.cy - pinhole.fy * direction.dot(up) / ahead - 0.5;
    best.length = 1 / ahead;
    return best;
  }

  TraceContext makeContext(const Face& face, const std::vector<const RayTree*>& trees) const {
    return {trees,
            face.rays,
            face.shading,
            origin_,
            options_.hiddenEntity,
            options_.channels.isDepthOnly()};
  }

  const ShadedTriangle& findShaded(Face& face, const TraceContext& trace, HitKey key) {
    constexpr std::size_t kMaxCached = 4096;
    if (face.triangles.size() > kMaxCached) face.triangles.clear();
    if (const auto found = face.triangles.find(key); found != face.triangles.end())
      return found->second;
    return face.triangles.try_emplace(key, ShadedTriangle(findTriangle(trace, key), face.rays))
        .first->second;
  }

  void tracePixel(std::size_t pixel, const Vec3& direction) {
    const FacePoint at = findFacePoint(direction);
    Face& face = *faces_[at.face];
    const TraceContext trace = makeContext(face, opaqueTrees_);
    const double near = camera_.near / at.length, far = camera_.far / at.length;
    const HitKey key = traceFirst(trace, at.x, at.y, near, far);
    double z = far;
    glsl::vec3 colour{0, 0, 0};
    if (key == kNoHit) {
      if (options_.channels.rgb) colour = face.shading.shadeSky(at.x, at.y);
    } else {
      const ShadedTriangle& triangle = findShaded(face, trace, key);
      z = triangle.depth.at(at.x, at.y);
      write(pixel, triangle, face, at, z, direction);
      if (options_.channels.rgb) {
        const bool shadow = options_.shadows && isInShadow(trace, at.x, at.y, z);
        colour = face.shading.shadeSurface(triangle, at.x, at.y, z, shadow ? 0.0f : 1.0f).rgb;
      }
    }
    if (!options_.channels.rgb) return;
    float transmittance = 1;
    colour = blendTransparent(colour, face, at, near, z, transmittance);
    transmittance_[pixel] = static_cast<std::uint8_t>(255 * transmittance + 0.5f);
    const float channels[3] = {colour.x, colour.y, colour.z};
    for (std::size_t i = 0; i < 3; ++i)
      frame_.rgb[3 * pixel + i] = linearToSrgbByteByTable(channels[i]);
  }

  void write(std::size_t pixel, const ShadedTriangle& triangle, const Face& face,
             const FacePoint& at, double z, const Vec3& direction) {
    const double range = z * at.length;
    if (!frame_.range.empty()) {
      frame_.range[pixel] = static_cast<float>(range);
      frame_.depth[pixel] =
          static_cast<float>(range * direction.dot(camera_.forward.stableNormalized()));
    }
    if (options_.channels.ids) frame_.ids[pixel] = triangle.batch->id;
    if (!options_.channels.normals) return;
    const Vec3 normal = face.shading.computeNormal(triangle, at.x, at.y);
    for (int i = 0; i < 3; ++i)
      frame_.normals[3 * pixel + static_cast<std::size_t>(i)] = static_cast<float>(normal[i]);
  }

  /// Blends the transparent surfaces before `z` over a colour, from back to front.
  glsl::vec3 blendTransparent(glsl::vec3 colour, Face& face, const FacePoint& at, double near,
                              double z, float& transmittance) {
    if (options_.transparency == TransparencyMode::opaque || transparentTrees_.empty())
      return colour;
    const TraceContext trace = makeContext(face, transparentTrees_);
    std::vector<HitKey> keys;
    traceBetween(trace, at.x, at.y, near, z, keys);
    std::vector<std::pair<double, HitKey>> layers;
    for (const HitKey key : keys) {
      const ShadedTriangle triangle(findTriangle(trace, key), face.rays);
      const double depth = triangle.depth.at(at.x, at.y);
      if (depth < z) layers.emplace_back(-depth, key);
    }
    std::sort(layers.begin(), layers.end());
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const BatchTriangle source = findTriangle(trace, layers[i].second);
      // A ray through a common edge hits both triangles; the surface must tint only once.
      const bool again =
          i > 0 &&
          std::abs(layers[i].first - layers[i - 1].first) <= 1e-9 * std::abs(layers[i].first) &&
          haveCommonEdge(findTriangle(trace, layers[i - 1].second), source);
      if (again) continue;
      const SurfaceColour layer = face.shading.shadeSurface(ShadedTriangle(source, face.rays), at.x,
                                                            at.y, -layers[i].first, 1.0f);
      colour = glsl::mix(colour, layer.rgb, layer.alpha);
      transmittance *= 1 - layer.alpha;
    }
    return colour;
  }

  const Camera& camera_;
  const FrameOptions& options_;
  const LensMapping& lens_;
  const std::vector<const RayTree*>&opaqueTrees_, &transparentTrees_;
  Vec3 origin_;
  Frame& frame_;
  std::vector<std::uint8_t>& transmittance_;  ///< of the transparent surfaces before each pixel
  std::vector<std::unique_ptr<Face>> faces_;
};

}  // namespace

Frame traceLensFrame(const Camera& camera, const FrameOptions& options,
                     const std::vector<const RayTree*>& opaqueTrees,
                     const std::vector<const RayTree*>& transparentTrees, const Vec3& origin,
                     const MipTextures& textures, scene::ThreadPool& workers) {
  constexpr std::size_t kRowsPerTask = 16;
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  const auto pixels = countPixels(camera);
  Frame frame;
  frame.camera = camera;
  if (options.channels.depth || options.channels.rgb) {
    frame.depth.assign(pixels, kNothing);
    frame.range.assign(pixels, kNothing);
  }
  if (options.channels.ids) frame.ids.assign(pixels, 0);
  if (options.channels.normals) frame.normals.assign(3 * pixels, 0.0f);
  if (options.channels.rgb) frame.rgb.assign(3 * pixels, 0);
  std::vector<std::uint8_t> transmittance(options.channels.rgb ? pixels : 0, 255);
  const LensMapping lens(camera);
  workers.parallelFor(static_cast<std::size_t>(camera.height), kRowsPerTask,
                      [&](std::size_t from, std::size_t to) {
                        LensTracer tracer(camera, options, lens, opaqueTrees, transparentTrees,
                                          origin, textures, frame, transmittance);
                        for (std::size_t y = from; y < to; ++y)
                          tracer.traceRow(static_cast<int>(y));
                      });
  if (!options.channels.rgb) return frame;
  const AmbientOcclusion occlusion(frame.range, camera, lens.pixelsPerRadian());
  workers.parallelFor(static_cast<std::size_t>(camera.height), kRowsPerTask,
                      [&](std::size_t from, std::size_t to) {
                        const auto width = static_cast<std::size_t>(camera.width);
                        std::vector<std::uint8_t> visibility(width);
                        for (std::size_t y = from; y < to; ++y) {
                          occlusion.computeRow(static_cast<int>(y), visibility);
                          for (std::size_t x = 0; x < width; ++x) {
                            const std::size_t pixel = y * width + x;
                            std::uint8_t* rgb = &frame.rgb[3 * pixel];
                            applyAo(rgb, visibility[x], transmittance[pixel], rgb);
                          }
                        }
                      });
  if (!options.channels.depth) frame.depth = frame.range = {};
  return frame;
}

}  // namespace enfilade::render
