// The kinds of renderers, and the rule that chooses between them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "render/frame.hpp"

namespace enfilade::render {

enum class RendererKind : std::uint8_t { automatic, gl, rays };

/// A frame to render, by a renderer of this kind.
struct ViewRequest {
  Camera camera;
  FrameOptions options;
  RendererKind renderer = RendererKind::automatic;
};

/// A frame to render, of a snapshot.
struct RenderRequest {
  std::shared_ptr<const scene::Snapshot> snapshot;  ///< required
  ViewRequest view;
};

/// "auto", "gl" or "rays".
const char* toString(RendererKind kind);
std::optional<RendererKind> parseRendererKind(const std::string& name);

/// The rule for `automatic`. It depends only on device, size, channels and the scene's triangles
/// and not on time. A frame's bytes therefore do not vary between runs, nor its style during a
/// capture.
RendererKind chooseRendererKind(bool softwareGl, const Camera& camera, const Channels& channels,
                                std::size_t triangles);

/// The rule for FrameOptions::automaticShadows: whether shadows cost little in comparison with the
/// rest of the picture. `software`: the renderer's.
bool choosesShadows(bool software, const Camera& camera, const Channels& channels,
                    std::size_t triangles);

}  // namespace enfilade::render
