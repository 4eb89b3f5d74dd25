#include "render/renderer.hpp"

#include <array>
#include <chrono>

#include "render/gl/gl_renderer.hpp"
#include "render/rays/ray_renderer.hpp"

namespace enfilade::render {
namespace {

struct Word {
  RendererKind kind;
  const char* word;
};
constexpr std::array<Word, 3> kWords{
    {{RendererKind::automatic, "auto"}, {RendererKind::gl, "gl"}, {RendererKind::rays, "rays"}}};

/// Drawn by one that is there already: what it took to make it is not the picture's.
template <class AnyRenderer>
Frame timed(AnyRenderer& renderer, const scene::Snapshot& snapshot, const Camera& camera,
            const FrameOptions& options) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Frame frame = renderer.render(snapshot, camera, options);
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

std::size_t drawnTriangles(const scene::Model& model) {
  std::size_t triangles = 0;
  for (const scene::Object& object : model.objects) {
    if (object.use == scene::Object::Use::solid) continue;
    for (const std::uint32_t mesh : object.meshes)
      triangles += model.meshes[mesh].indices.size() / 3;
  }
  return triangles;
}

RendererKind automaticKind(bool softwareGl, std::size_t triangles, const Channels& channels) {
  // Below, GL on processors is as quick; measured (tests/benchmarks/report/render.md).
  constexpr std::size_t kFewTriangles = 200'000;
  if (!softwareGl || channels.rgb) return RendererKind::gl;
  return triangles < kFewTriangles ? RendererKind::gl : RendererKind::rays;
}

struct Renderer::State {
  std::shared_ptr<const scene::Scene> scene;
  RendererKind kind;
  DeviceChoice device;
  std::unique_ptr<GlRenderer> gl;
  std::unique_ptr<RayRenderer> rays;
  std::size_t triangles = 0;
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
    if (!rays) rays = std::make_unique<RayRenderer>(scene);
    return *rays;
  }

  RendererKind chosen(const FrameOptions& options, RendererKind asked) const {
    const RendererKind wanted = asked == RendererKind::automatic ? kind : asked;
    if (wanted != RendererKind::automatic) return wanted;
    if (!gl) return RendererKind::rays;
    if (device.requireGpu) return RendererKind::gl;
    return automaticKind(gl->software(), triangles, options.channels);
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
  state_->triangles = drawnTriangles(state_->scene->model());
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
  if (state_->chosen(options, kind) == RendererKind::gl) {
    return timed(state_->glRenderer(), snapshot, camera, options);
  }
  return timed(state_->rayRenderer(), snapshot, camera, options);
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
