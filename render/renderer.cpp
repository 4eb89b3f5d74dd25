#include "render/renderer.hpp"

#include <optional>
#include <utility>

#include "render/samples.hpp"

namespace enfilade::render {

Frame Renderer::render(const scene::Snapshot& snapshot, const Camera& camera,
                       const FrameOptions& options) {
  if (const auto error = validateCamera(camera)) throw RenderError(*error);
  if (!isSampleCount(options.samples))
    throw RenderError("samples is " + std::to_string(options.samples) + "; it must be " +
                      kSampleCounts);
  const bool several = options.samples > 1 && options.channels.rgb;
  Frame frame =
      several ? renderSamples(snapshot, camera, options) : renderOnce(snapshot, camera, options);
  frame.camera = camera;
  frame.tick = snapshot.tick;
  frame.avatars = options.avatars;
  frame.shadows = options.shadows && options.channels.rgb;
  frame.samples = several ? options.samples : 1;
  return frame;
}

Frame Renderer::renderSamples(const scene::Snapshot& snapshot, const Camera& camera,
                              const FrameOptions& options) {
  FrameOptions colour = options, others = options;
  colour.channels = {true, false, false, false};
  others.channels.rgb = false;
  std::optional<Frame> frame;
  if (others.channels.ids || others.channels.depth || others.channels.normals)
    frame = renderOnce(snapshot, camera, others);
  MeanColour mean(std::size_t{3} * static_cast<std::size_t>(camera.width) *
                  static_cast<std::size_t>(camera.height));
  for (const Eigen::Vector2d& position : getSamplePositions(static_cast<int>(options.samples))) {
    Frame sample = renderOnce(snapshot, shiftCamera(camera, position), colour);
    mean.add(sample.rgb);
    if (!frame) frame = std::move(sample);
  }
  frame->rgb = mean.compute();
  return std::move(*frame);
}

}  // namespace enfilade::render
