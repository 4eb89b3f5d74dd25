#include "render/service/renderer_selector.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <thread>
#include <utility>

#include "collision/assert.hpp"
#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"

namespace enfilade::render {
namespace {

/// More threads have too little work each at the usual sizes.
int countRayThreads() {
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8);
}

}  // namespace

struct RendererSelector::State {
  std::shared_ptr<const scene::Scene> scene;
  std::size_t triangles = 0;  ///< of all objects
  RendererKind kind;
  DeviceChoice device;
  std::unique_ptr<GlRenderer> gl;
  std::unique_ptr<RayRenderer> rays;
  std::string glFailure;  ///< why GL is unavailable; empty: available or not tried yet
  std::string warning;

  GlRenderer& glRenderer() {
    if (gl) return *gl;
    if (!glFailure.empty()) throw RendererUnavailable(glFailure);
    try {
      gl = std::make_unique<GlRenderer>(scene, device, [this](const auto&... frame) {
        return shadowTracer().computeShadowMask(frame...);
      });
    } catch (const RenderError& error) {
      glFailure = error.what();  // devices are not probed again for every frame
      throw RendererUnavailable(glFailure);
    }
    return *gl;
  }

  RayRenderer& rayRenderer() {
    if (device.requireGpu) {
      throw RendererUnavailable(
          "the ray renderer runs on the CPU, but a GPU is required: request gl");
    }
    return shadowTracer();
  }

  /// The ray renderer; it computes the shadow masks of both renderers.
  RayRenderer& shadowTracer() {
    if (!rays)
      rays = std::make_unique<RayRenderer>(scene, RayOptions{.threads = countRayThreads()});
    return *rays;
  }

  RendererKind chooseKind(const Camera& camera, const FrameOptions& options,
                          RendererKind requested) const {
    if (camera.lens) {
      if (requested == RendererKind::gl)
        throw RenderError("camera: lens is given; it must be absent with OpenGL: request rays");
      return RendererKind::rays;
    }
    const RendererKind wanted = requested == RendererKind::automatic ? kind : requested;
    if (wanted != RendererKind::automatic) return wanted;
    if (!gl) return RendererKind::rays;
    if (device.requireGpu) return RendererKind::gl;
    return chooseRendererKind(gl->software(), camera, options.channels, triangles);
  }

  FrameOptions decideShadows(const Renderer& renderer, const Camera& camera,
                             FrameOptions options) const {
    if (options.automaticShadows)
      options.shadows = choosesShadows(renderer.software(), camera, options.channels, triangles);
    return options;
  }

  /// Creates the renderer of `one` kind, which is not automatic, on first use.
  Renderer& findOrCreate(RendererKind one) {
    ENFILADE_ASSERT(one != RendererKind::automatic);
    if (one == RendererKind::rays) return rayRenderer();
    return glRenderer();
  }

  const Renderer& defaultRenderer() const {
    ENFILADE_ASSERT(gl || rays);
    if (gl) return *gl;
    return *rays;
  }

  /// Initialises `automatic`: GL, otherwise rays.
  void tryGl() {
    try {
      warning = glRenderer().deviceWarning();
    } catch (const RenderError& error) {
      if (device.requireGpu || !device.device.empty()) throw;
      warning = std::string("rendering with rays, because OpenGL is unavailable: ") + error.what();
      rayRenderer();
    }
  }
};

RendererSelector::RendererSelector(std::shared_ptr<const scene::Scene> scene, RendererKind kind,
                                   const DeviceChoice& device)
    : state_(std::make_unique<State>()) {
  if (!scene) throw RenderError("Renderer: no scene");
  for (const scene::Object& object : scene->model().objects)
    for (const std::uint32_t mesh : object.meshes)
      state_->triangles += scene->model().meshes[mesh].triangleCount();
  state_->scene = std::move(scene);
  state_->kind = kind;
  state_->device = device;
  if (kind == RendererKind::automatic)
    state_->tryGl();
  else
    state_->warning = state_->findOrCreate(kind).deviceWarning();
}

RendererSelector::~RendererSelector() = default;

Frame RendererSelector::render(const scene::Snapshot& snapshot, const Camera& camera,
                               const FrameOptions& options, RendererKind kind) {
  // The request does not own the snapshot.
  const RenderRequest request{{std::shared_ptr<const scene::Snapshot>(), &snapshot},
                              {camera, options, kind}};
  return std::move(render(std::span(&request, 1)).front());
}

std::vector<Frame> RendererSelector::render(std::span<const RenderRequest> requests) {
  std::map<RendererKind, std::vector<std::size_t>> requestsByKind;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const auto& [camera, options, kind] = requests[i].view;
    requestsByKind[state_->chooseKind(camera, options, kind)].push_back(i);
  }
  std::vector<Frame> frames(requests.size());
  for (const auto& [kind, indices] : requestsByKind) {
    Renderer& renderer = state_->findOrCreate(kind);
    std::vector<View> together;
    for (const std::size_t i : indices) {
      const ViewRequest& view = requests[i].view;
      together.push_back({requests[i].snapshot.get(), view.camera,
                          state_->decideShadows(renderer, view.camera, view.options)});
    }
    // The time excludes the creation of the renderer.
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    std::vector<Frame> rendered = renderer.render(together);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    for (std::size_t i = 0; i < rendered.size(); ++i) {
      rendered[i].statistics.seconds = seconds / static_cast<double>(rendered.size());
      frames[indices[i]] = std::move(rendered[i]);
    }
  }
  return frames;
}

const std::string& RendererSelector::deviceNameFor(const Camera& camera,
                                                   const FrameOptions& options) {
  return state_->findOrCreate(state_->chooseKind(camera, options, RendererKind::automatic))
      .deviceName();
}

const std::string& RendererSelector::deviceName() const {
  return state_->defaultRenderer().deviceName();
}
bool RendererSelector::software() const {
  return state_->defaultRenderer().software();
}
const std::string& RendererSelector::deviceWarning() const {
  return state_->warning;
}

}  // namespace enfilade::render
