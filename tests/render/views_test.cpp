// Views that are rendered together have the frames that they have alone.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "render/culling/occlusion_culler.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "render/service/render_thread.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

/// More items than a renderer draws without culling, some transparent, in a dense heap.
std::shared_ptr<const scene::Scene> heap() {
  std::vector<PlacedBox> boxes = crowd(400);
  boxes.push_back({{0, -6, 0}, {60, 1, 60}, coloured(0.4f, 0.4f, 0.4f)});
  return sceneOf(boxes);
}

std::shared_ptr<const scene::Snapshot> twoAvatars() {
  auto snapshot = std::make_shared<scene::Snapshot>();
  snapshot->tick = 7;
  snapshot->avatars = {avatarAt(1000, {1, -4, -6}), avatarAt(1001, {-1, -4, -7})};
  return snapshot;
}

/// Views of several sizes, channels and kinds of cameras, from the same and from other places.
std::vector<View> manyViews() {
  std::vector<View> views;
  std::mt19937 random(11);
  const auto number = [&](double size) {
    return size * (static_cast<double>(random() % 2001) / 1000 - 1);
  };
  for (int i = 0; i < 14; ++i) {
    View view{squareCamera(i % 3 == 0 ? 48 : 64), {}};
    view.camera.eye = {number(4), number(2), number(4) + 6};
    view.camera.forward = {number(1), number(0.3), -1};
    if (i % 5 == 1) view.camera.projection = Camera::Projection::orthographic;
    view.options.channels = {i % 2 == 0, i % 4 != 3, i % 3 != 1, i % 5 == 0};
    if (i % 7 == 2) view.options.hiddenEntity = 1000;
    if (i % 7 == 3) view.options.avatars = AvatarForm::collision;
    if (i % 7 == 4) view.options.transparency = TransparencyMode::opaque;
    if (i % 7 == 5) view.options.samples = 4;
    if (i == 6) view.options.culling = Culling::frustum;
    views.push_back(view);
  }
  views.push_back(views.front());
  return views;
}

template <class Value>
bool haveEqualBytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

void expectSame(const Frame& a, const Frame& b, std::size_t i) {
  EXPECT_TRUE(haveEqualBytes(a.rgb, b.rgb)) << "colour of view " << i;
  EXPECT_TRUE(haveEqualBytes(a.ids, b.ids)) << "ids of view " << i;
  EXPECT_TRUE(haveEqualBytes(a.depth, b.depth)) << "depth of view " << i;
  EXPECT_TRUE(haveEqualBytes(a.normals, b.normals)) << "normals of view " << i;
  EXPECT_EQ(a.tick, b.tick);
  EXPECT_EQ(a.renderer, b.renderer);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.avatars, b.avatars);
}

void expectFramesOfEachAlone(Renderer& together, Renderer& alone) {
  const auto snapshot = twoAvatars();
  const std::vector<View> views = manyViews();
  for (int round = 0; round < 3; ++round) {  // the second knows what the first saw
    const std::vector<Frame> frames = together.render(*snapshot, views);
    ASSERT_EQ(frames.size(), views.size());
    for (std::size_t i = 0; i < views.size(); ++i)
      expectSame(frames[i], alone.render(*snapshot, views[i].camera, views[i].options), i);
  }
  EXPECT_TRUE(together.render(*snapshot, std::span<const View>()).empty());
}

TEST(Views, TogetherHaveTheFramesOfEachAlone) {
  for (const DepthSource depthSource : {DepthSource::buffer, DepthSource::plane}) {
    const DeviceChoice device{.device = "", .depthSource = depthSource};
    GlRenderer together(heap(), device), alone(heap(), device);
    expectFramesOfEachAlone(together, alone);
  }
  RayRenderer together(heap()), alone(heap());
  expectFramesOfEachAlone(together, alone);
}

TEST(Views, MoreThanATraversalTakesAreDivided) {
  GlRenderer renderer(heap());
  const auto snapshot = twoAvatars();
  std::vector<View> views(OcclusionCuller::kMaxViews + 3, View{squareCamera(16), {}});
  for (std::size_t i = 0; i < views.size(); ++i)
    views[i].camera.forward = Vec3(0.02 * static_cast<double>(i) - 0.7, 0, -1);
  const std::vector<Frame> frames = renderer.render(*snapshot, views);
  for (std::size_t i = 0; i < views.size(); ++i)
    expectSame(frames[i], renderer.render(*snapshot, views[i].camera, views[i].options), i);
}

TEST(Views, ARefusedViewFailsAndTheOthersAreRendered) {
  RenderThread renders(heap());
  std::vector<ViewRequest> requests(3, ViewRequest{{squareCamera(16), {}}});
  requests[1].view.camera.eye.x() = std::numeric_limits<double>::quiet_NaN();
  std::promise<RenderThread::Frames> promise;
  renders.render(twoAvatars(), requests,
                 [&](RenderThread::Frames frames) { promise.set_value(std::move(frames)); });
  RenderThread::Frames frames = promise.get_future().get();
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].get().tick, 7u);
  EXPECT_THROW(frames[1].get(), RenderError);
  EXPECT_EQ(frames[2].get().tick, 7u);
}

}  // namespace
}  // namespace enfilade::render
