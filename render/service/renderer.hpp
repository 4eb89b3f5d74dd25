// Both renderers behind one face, and the rule that chooses between them.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "render/device.hpp"
#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

enum class RendererKind : std::uint8_t { automatic, gl, rays };

/// "auto", "gl", "rays".
const char* wordOf(RendererKind kind);
std::optional<RendererKind> rendererKindFrom(const std::string& word);

/// The rule for `automatic`. It never looks at a clock: the same device, size and channels are
/// always drawn by the same renderer, so that a picture's bytes do not change from run to run, nor
/// its style in the middle of a capture; and colours are GL's at every size.
RendererKind automaticKind(bool softwareGl, const Camera& camera, const Channels& channels);

/// Owns a GlRenderer, a RayRenderer or both, each made when first needed; one thread makes, uses
/// and destroys it. RenderThread does that for you.
class Renderer {
 public:
  /// Throws RenderError where `kind` is gl, or a GPU is required, and no device gives a context;
  /// `automatic` is then rays alone, and deviceNote() says so.
  explicit Renderer(std::shared_ptr<const scene::Scene> scene,
                    RendererKind kind = RendererKind::automatic, const DeviceChoice& device = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// `kind`: other than automatic, it goes before the constructor's. Throws RenderError as both
  /// renderers do, and for rays where a GPU is required.
  Frame render(const scene::Snapshot& snapshot, const Camera& camera,
               const FrameOptions& options = {}, RendererKind kind = RendererKind::automatic);

  /// Of what the constructor's kind begins with: GL_RENDERER or "Embree ...".
  const std::string& deviceName() const;
  bool software() const;
  const std::string& deviceNote() const;  ///< as GlRenderer's; "" where there is nothing to tell

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
