#include "render/gl/frame_in_progress.hpp"

#include <epoxy/gl.h>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

/// Reads a channel of all views at once. `read(layers, values)` reads `valuesPerPixel` values for
/// each pixel; `getDestination(view)` is the vector that receives them.
template <class Value, class Read, class GetDestination>
void readTogether(const FramesInProgress& views, std::size_t valuesPerPixel, const Read& read,
                  const GetDestination& getDestination) {
  if (views.empty()) return;
  const std::size_t size = valuesPerPixel * countPixels(views.front()->camera);
  const Layers layers{views.front()->layer, views.back()->layer - views.front()->layer + 1};
  ENFILADE_ASSERT(layers.count >= static_cast<int>(views.size()));
  if (layers.count == 1) {
    std::vector<Value>& to = getDestination(*views.front());
    to.resize(size);
    return read(layers, std::span<Value>(to));
  }
  std::vector<Value> all(size * static_cast<std::size_t>(layers.count));
  read(layers, std::span<Value>(all));
  for (FrameInProgress* view : views) {
    const auto from =
        all.begin() +
        static_cast<std::ptrdiff_t>(size * static_cast<std::size_t>(view->layer - layers.first));
    getDestination(*view).assign(from, from + static_cast<std::ptrdiff_t>(size));
  }
}

}  // namespace

void readDepth(const RenderTarget& target, const FramesInProgress& views) {
  readTogether<float>(
      views, 1, [&](Layers layers, std::span<float> depth) { target.readDepth(layers, depth); },
      [](FrameInProgress& view) -> std::vector<float>& {
        view.depthIsRead = true;
        return view.pyramid.baseLevel(view.camera.width, view.camera.height);
      });
}

const std::vector<float>& getDepthMetres(const RenderTarget& target, FrameInProgress& view) {
  if (!view.depthIsRead) readDepth(target, {&view});
  if (view.metres.empty())
    view.metres = convertDepthToMetres(
        view.pyramid.baseLevel(view.camera.width, view.camera.height), view.camera);
  ENFILADE_ASSERT(view.metres.size() == countPixels(view.camera));
  return view.metres;
}

std::vector<Frame> readFrames(const RenderTarget& target, const FramesInProgress& views) {
  std::vector<Frame> frames(views.size());
  const auto getFrame = [&](const FrameInProgress& view) -> Frame& {
    return frames[static_cast<std::size_t>(view.layer)];
  };
  const auto selectViews = [&](const auto& condition) { return filterViews(views, condition); };
  glFlush();  // if the depth was already read, the device works while this thread continues
  readDepth(target, selectViews([](const FrameInProgress& view) {
              return view.needsDepth() && !view.planeDepth && !view.depthIsRead;
            }));
  for (FrameInProgress* view : views) {
    if (!view->needsDepth() || view->planeDepth) continue;
    getDepthMetres(target, *view);
    getFrame(*view).depth = std::move(view->metres);
  }
  readTogether<float>(
      selectViews([](const FrameInProgress& view) { return view.planeDepth; }), 1,
      [&](Layers layers, std::span<float> to) { target.readPlaneDepth(layers, to); },
      [&](FrameInProgress& view) -> std::vector<float>& { return getFrame(view).depth; });
  readTogether<std::uint8_t>(
      selectViews([](const FrameInProgress& view) { return view.options.channels.rgb; }), 4,
      [&](Layers layers, std::span<std::uint8_t> to) { target.readColour(layers, to); },
      [&](FrameInProgress& view) -> std::vector<std::uint8_t>& { return getFrame(view).rgb; });
  readTogether<std::uint32_t>(
      selectViews([](const FrameInProgress& view) { return view.options.channels.ids; }), 1,
      [&](Layers layers, std::span<std::uint32_t> to) { target.readIds(layers, to); },
      [&](FrameInProgress& view) -> std::vector<std::uint32_t>& { return getFrame(view).ids; });
  readTogether<float>(
      selectViews([](const FrameInProgress& view) { return view.options.channels.normals; }), 3,
      [&](Layers layers, std::span<float> to) { target.readNormals(layers, to); },
      [&](FrameInProgress& view) -> std::vector<float>& { return getFrame(view).normals; });
  for (const FrameInProgress* view : views) {
    Frame& frame = getFrame(*view);
    if (view->options.channels.rgb)
      frame.rgb = applyOcclusion(frame.rgb, view->camera.width, view->camera.height,
                                 AmbientOcclusion(frame.depth, view->camera));
    if (!view->options.channels.depth) frame.depth = {};
    frame.statistics = view->statistics;
  }
  return frames;
}

}  // namespace enfilade::render
