#include "render/renderer_kind.hpp"

#include <array>

namespace enfilade::render {
namespace {

struct KindName {
  RendererKind kind;
  const char* name;
};
constexpr std::array<KindName, 3> kKindNames{
    {{RendererKind::automatic, "auto"}, {RendererKind::gl, "gl"}, {RendererKind::rays, "rays"}}};

}  // namespace

const char* toString(RendererKind kind) {
  for (const KindName& kindName : kKindNames)
    if (kindName.kind == kind) return kindName.name;
  return "?";
}

std::optional<RendererKind> parseRendererKind(const std::string& name) {
  for (const KindName& kindName : kKindNames)
    if (name == kindName.name) return kindName.kind;
  return std::nullopt;
}

RendererKind chooseRendererKind(bool softwareGl, const Camera& camera, const Channels& channels,
                                std::size_t triangles) {
  if (!softwareGl) return RendererKind::gl;
  // Measured for depth and ids in four scenes of 146 thousand to 2.4 million triangles. Rays took
  // 0.3 to 0.8 of GL's time at 128 x 128, and 0.7 to 1.4 at 256 x 256. At 640 x 480 they took 1.2
  // to 2.5.
  constexpr std::size_t kSmallFrameThreshold = 256 * 256;
  const std::size_t pixels = countPixels(camera);
  if (pixels > kSmallFrameThreshold) return RendererKind::gl;
  // A pixel's colour costs as much as some triangles of software GL. With colour, rays took 0.2 to
  // 0.8 of GL's time with at least 9 triangles a pixel, and 1.4 to 2.3 with at most 1.
  constexpr std::size_t kTrianglesPerColouredPixel = 4;
  return channels.rgb && triangles < kTrianglesPerColouredPixel * pixels ? RendererKind::gl
                                                                         : RendererKind::rays;
}

bool choosesShadows(bool software, const Camera& camera, const Channels& channels,
                    std::size_t triangles) {
  // Shadows add 5 to 9 ms to 640 x 480 pixels on two processors. A GPU draws the whole picture in
  // less time than that.
  if (!software || !channels.rgb) return false;
  if (camera.projection != Camera::Projection::perspective) return false;  // plans stay plain
  // The tree takes 0.5 s and 100 MB per million triangles.
  constexpr std::size_t kMaxTriangles = 2'000'000;
  if (triangles > kMaxTriangles) return false;
  // Small pictures are mostly those of agents that learn, where each millisecond counts.
  constexpr std::size_t kSmallFrame = 256 * 256;
  return countPixels(camera) > kSmallFrame;
}

}  // namespace enfilade::render
