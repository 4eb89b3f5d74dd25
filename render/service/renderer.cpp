#include "render/service/renderer.hpp"

#include <array>
#include <chrono>

#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"

namespace enfilade::render {
namespace {

struct Word {
  RendererKind kind;
  const char* word;
};
constexpr std::array<Word, 3> kWords{
    {{RendererKind::automatic, "auto"}, {RendererKind::gl, "gl"}, {RendererKind::rays, "rays"}}};

/// Drawn by one that is there already: what it took to make it is not the picture's.
template <class Draw>
Frame timed(const Draw& draw) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Frame frame = draw();
  frame.statistics.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return frame;
}

}  // namespace

const char* wordOf(RendererKind kind) {
  for (const Word& word : kWords)
    if (word.kind == kind) return word.word;
  return "?";
}

std::optional<RendererKind> rendererKindFrom(const std::string& word) {
  for (const Word& known : kWords)
    if (word == known.word) return known.kind;
  return std::nullopt;
}

RendererKind automaticKind(bool softwareGl, const Camera& camera, const Channels& channels) {
  if (!softwareGl || channels.rgb) return RendererKind::gl;
  // Along walks in four scenes of 146 thousand to 2.4 million triangles, depth and ids alone: rays
  // took 0.3 to 0.8 of GL's time at 128 x 128, 0.7 to 1.4 at 256 x 256 and 1.2 to 2.5 at 640 x 480.
  constexpr std::int64_t kFewPixels = 256 * 256;
  const bool few = std::int64_t{camera.width} * camera.height <= kFewPixels;
  return few ? RendererKind::rays : RendererKind::gl;
}

struct Renderer::State {
  std::shared_ptr<const scene::Scene> scene;
  RendererKind kind;
  DeviceChoice device;
  std::unique_ptr<GlRenderer> gl;
  std::unique_ptr<RayRenderer> rays;
  std::string glFailure;  ///< why there is no GL; empty: there is, or nobody asked
  std::string note;

  GlRenderer& glRenderer() {
    if (gl) return *gl;
    if (!glFailure.empty()) throw NoRenderer(glFailure);
    try {
      gl = std::make_unique<GlRenderer>(scene, device);
    } catch (const RenderError& error) {
      glFailure = error.what();  // devices are not tried again with every picture
      throw NoRenderer(glFailure);
    }
    return *gl;
  }

  RayRenderer& rayRenderer() {
    if (device.requireGpu) {
      throw NoRenderer("rays are cast on processors, and a GPU is required: ask for gl");
    }
    return caster();
  }

  /// Shadows are cast by it whoever draws.
  RayRenderer& caster() {
    if (!rays) rays = std::make_unique<RayRenderer>(scene);
    return *rays;
  }

  RendererKind chosen(const Camera& camera, const FrameOptions& options, RendererKind asked) const {
    const RendererKind wanted = asked == RendererKind::automatic ? kind : asked;
    if (wanted != RendererKind::automatic) return wanted;
    if (!gl) return RendererKind::rays;
    if (device.requireGpu) return RendererKind::gl;
    return automaticKind(gl->software(), camera, options.channels);
  }

  /// What `automatic` begins with.
  void tryGl() {
    try {
      note = glRenderer().deviceNote();
    } catch (const RenderError& error) {
      if (device.requireGpu || !device.device.empty()) throw;
      note = std::string("pictures are cast with rays, since there is no OpenGL: ") + error.what();
      rayRenderer();
    }
  }
};

Renderer::Renderer(std::shared_ptr<const scene::Scene> scene, RendererKind kind,
                   const DeviceChoice& device)
    : state_(std::make_unique<State>()) {
  if (!scene) throw RenderError("Renderer: there is no scene");
  state_->scene = std::move(scene);
  state_->kind = kind;
  state_->device = device;
  switch (kind) {
    case RendererKind::automatic:
      state_->tryGl();
      break;
    case RendererKind::gl:
      state_->note = state_->glRenderer().deviceNote();
      break;
    case RendererKind::rays:
      state_->rayRenderer();
      break;
  }
}

Renderer::~Renderer() = default;

Frame Renderer::render(const scene::Snapshot& snapshot, const Camera& camera,
                       const FrameOptions& options, RendererKind kind) {
  State& s = *state_;
  if (s.chosen(camera, options, kind) == RendererKind::rays) {
    RayRenderer& rays = s.rayRenderer();
    return timed([&] { return rays.render(snapshot, camera, options); });
  }
  GlRenderer& gl = s.glRenderer();
  const Sunlit sunlit = [&](const std::vector<float>& depth) {
    return s.caster().sunlit(snapshot, camera, options, depth);
  };
  return timed([&] { return gl.render(snapshot, camera, options, sunlit); });
}

const std::string& Renderer::deviceName() const {
  return state_->gl ? state_->gl->deviceName() : state_->rays->deviceName();
}
bool Renderer::software() const {
  return state_->gl ? state_->gl->software() : true;
}
const std::string& Renderer::deviceNote() const {
  return state_->note;
}

}  // namespace enfilade::render
