#include "render/renderer.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "collision/assert.hpp"
#include "render/camera/samples.hpp"

namespace enfilade::render {
namespace {

/// Samples of a picture that are rendered together.
std::size_t countSamplesPerPass(const Camera& camera, std::size_t samples) {
  return std::clamp<std::size_t>(kMaxPixelsTogether / countPixels(camera), 1, samples);
}

void validateView(const View& view) {
  if (!view.snapshot) throw RenderError("Renderer::render: no snapshot");
  if (const auto error = validateCamera(view.camera)) throw RenderError(*error);
  if (!isSampleCount(view.options.samples))
    throw RenderError("samples is " + std::to_string(view.options.samples) + "; it must be " +
                      kSampleCounts);
}

bool hasSeveralSamples(const View& view) {
  return view.options.samples > 1 && view.options.channels.rgb;
}

void describeFrame(const View& view, Frame& frame) {
  frame.camera = view.camera;
  frame.tick = view.snapshot->tick;
  frame.avatars = view.options.avatars;
  frame.shadows = view.options.shadows && view.options.channels.rgb;
  frame.samples = hasSeveralSamples(view) ? view.options.samples : 1;
}

}  // namespace

Frame Renderer::render(const scene::Snapshot& snapshot, const Camera& camera,
                       const FrameOptions& options) {
  const View view{&snapshot, camera, options};
  return std::move(render(std::span(&view, 1)).front());
}

std::vector<Frame> Renderer::render(std::span<const View> views) {
  std::vector<View> single;  // with one sample
  for (const View& view : views) {
    validateView(view);
    if (!hasSeveralSamples(view)) single.push_back(view);
  }
  std::vector<Frame> once = renderOnce(single), frames;
  ENFILADE_ASSERT(once.size() == single.size());
  auto next = once.begin();
  for (const View& view : views) {
    frames.push_back(hasSeveralSamples(view) ? renderSamples(view) : std::move(*next++));
    describeFrame(view, frames.back());
  }
  return frames;
}

Frame Renderer::renderSamples(const View& view) {
  View others = view;
  others.options.channels.rgb = false;
  std::optional<Frame> frame;
  const Channels& channels = others.options.channels;
  if (channels.ids || channels.depth || channels.normals)
    frame = std::move(renderOnce(std::span(&others, 1)).front());
  MeanColour mean(std::size_t{3} * countPixels(view.camera));
  std::vector<View> pass;
  const auto positions = getSamplePositions(static_cast<int>(view.options.samples));
  const std::size_t perPass = countSamplesPerPass(view.camera, positions.size());
  for (std::size_t from = 0; from < positions.size(); from += perPass) {
    pass.assign(std::min(perPass, positions.size() - from), view);
    for (std::size_t i = 0; i < pass.size(); ++i) {
      pass[i].camera = shiftCamera(view.camera, positions[from + i]);
      pass[i].options.channels = {true, false, false, false};
    }
    for (Frame& sample : renderOnce(pass)) {
      mean.add(sample.rgb);
      if (!frame) frame = std::move(sample);
    }
  }
  frame->rgb = mean.compute();
  return std::move(*frame);
}

}  // namespace enfilade::render
