// Views that are rendered together have the frames that they have alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <future>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "render/culling/occlusion_culler.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "render/service/render_thread.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

/// More items than a renderer draws without culling, some transparent, in a dense heap.
std::shared_ptr<const scene::Scene> makeHeap() {
  std::vector<PlacedBox> boxes = makeCrowd(400);
  boxes.push_back({{0, -6, 0}, {60, 1, 60}, makeColoured(0.4f, 0.4f, 0.4f)});
  return makeScene(boxes);
}

std::shared_ptr<const scene::Snapshot> makeTwoAvatars() {
  auto snapshot = std::make_shared<scene::Snapshot>();
  snapshot->tick = 7;
  snapshot->avatars = {makeAvatarAt(1000, {1, -4, -6}), makeAvatarAt(1001, {-1, -4, -7})};
  return snapshot;
}

/// Views of several sizes, channels and kinds of cameras, from the same and from other places.
std::vector<View> makeViews(const std::vector<const scene::Snapshot*>& snapshots) {
  std::vector<View> views;
  std::mt19937 random(11);
  const auto number = [&](double size) {
    return size * (static_cast<double>(random() % 2001) / 1000 - 1);
  };
  for (int i = 0; i < 14; ++i) {
    View view{snapshots[static_cast<std::size_t>(i) % snapshots.size()],
              makeSquareCamera(i % 3 == 0 ? 48 : 64),
              {}};
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
  if (a.empty() || a.size() != b.size()) return a.size() == b.size();
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
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

void expectFramesOfEachAlone(const std::vector<View>& views, Renderer& together, Renderer& alone) {
  for (int round = 0; round < 3; ++round) {  // the second knows what the first saw
    const std::vector<Frame> frames = together.render(views);
    ASSERT_EQ(frames.size(), views.size());
    for (std::size_t i = 0; i < views.size(); ++i)
      expectSame(frames[i], alone.render(*views[i].snapshot, views[i].camera, views[i].options), i);
  }
  EXPECT_TRUE(together.render(std::span<const View>()).empty());
}

TEST(Views, TogetherHaveTheFramesOfEachAlone) {
  const auto snapshot = makeTwoAvatars();
  const std::vector<View> views = makeViews({snapshot.get()});
  for (const DepthSource depthSource : {DepthSource::buffer, DepthSource::plane}) {
    const DeviceChoice device{.device = "", .depthSource = depthSource};
    GlRenderer together(makeHeap(), device), alone(makeHeap(), device);
    expectFramesOfEachAlone(views, together, alone);
  }
  RayRenderer together(makeHeap()), alone(makeHeap());
  expectFramesOfEachAlone(views, together, alone);
}

/// A heap whose second box is a lift.
std::shared_ptr<const scene::Scene> makeHeapWithLift() {
  scene::Model model = makeHeap()->model();
  scene::BodySpec lift;
  lift.name = "lift";
  lift.kind = scene::BodyKind::lift;
  lift.objects = {1};
  lift.high = 3;
  lift.stops = {0, 3};
  model.bodies.push_back(lift);
  return std::make_shared<const scene::Scene>(std::move(model));
}

TEST(Views, OfSeveralWorldsHaveTheFramesOfEachAlone) {
  const auto scene = makeHeapWithLift();
  std::vector<scene::Snapshot> snapshots;
  std::vector<const scene::Snapshot*> shown;
  for (const double height : {0.0, 0.6, 1.2, 3.0}) {
    snapshots.push_back(makeSnapshotOfLift(*scene, height));
    if (height != 1.2) snapshots.back().avatars = {makeAvatarAt(1000, {1 - height, -4, -6})};
  }
  for (const scene::Snapshot& snapshot : snapshots) shown.push_back(&snapshot);
  const std::vector<View> views = makeViews(shown);
  GlRenderer any(scene);
  EXPECT_NE(any.render(snapshots[0], makeSquareCamera(64)).ids,
            any.render(snapshots[3], makeSquareCamera(64)).ids);
  GlRenderer together(scene), alone(scene);
  expectFramesOfEachAlone(views, together, alone);
  RayRenderer raysTogether(scene), raysAlone(scene);
  expectFramesOfEachAlone(views, raysTogether, raysAlone);
}

/// A few panes before a few boxes on a floor: fewer items than a renderer culls.
std::shared_ptr<const scene::Scene> makePanesBeforeBoxes() {
  std::vector<PlacedBox> boxes{{{0, -1.5, -6}, {20, 1, 20}, makeColoured(0.6f, 0.5f, 0.4f)}};
  for (int i = 0; i < 12; ++i) {
    boxes.push_back({{i - 6.0, 0, -6.0 - i % 3},
                     {0.7, 1.6, 0.7},
                     makeColoured(0.1f, 0.05f * static_cast<float>(i), 0.5f)});
    boxes.push_back({{i - 6.0, 0, -4}, {0.5, 1, 0.05}, makeColoured(0.8f, 0.2f, 0.2f, 0.5f)});
  }
  return makeScene(boxes);
}

/// Views that take each of the renderer's ways, in one order and in the other.
TEST(Views, NoneLeavesItsStateToAnother) {
  const auto snapshot = makeTwoAvatars();
  View drawsAll{snapshot.get(), makeSquareCamera(64), {}};
  drawsAll.options.culling = Culling::frustum;
  View culled{snapshot.get(), makeSquareCamera(64), {}};
  culled.camera.forward = {0.4, -0.1, -1};
  View shadowed = drawsAll;
  shadowed.options.shadows = true;
  View depthAlone = culled;
  depthAlone.options.channels = {false, true, true, false};
  for (const auto& scene : {makePanesBeforeBoxes(), makeHeap()}) {
    RayRenderer caster(scene);
    const auto makeRenderer = [&] {
      return std::make_unique<GlRenderer>(scene, DeviceChoice{}, [&](const auto&... frame) {
        return caster.computeShadowMask(frame...);
      });
    };
    for (std::vector<View> order :
         {std::vector{culled, drawsAll, depthAlone, shadowed}, std::vector{drawsAll, depthAlone}}) {
      const auto together = makeRenderer(), alone = makeRenderer();
      for (int turn = 0; turn < 12; ++turn) {
        const std::vector<Frame> frames = together->render(order);
        for (std::size_t i = 0; i < order.size(); ++i)
          expectSame(frames[i], alone->render(*snapshot, order[i].camera, order[i].options), i);
        if (turn == 5) std::swap(order[0], order[1]);
        std::rotate(order.begin(), order.begin() + 1, order.end());
        if (turn % 4 != 3) continue;  // the same places again: nothing is disoccluded
        for (View& view : order) view.camera.eye.x() += 0.3;
      }
    }
  }
}

TEST(Views, MoreThanATraversalTakesAreDivided) {
  GlRenderer renderer(makeHeap());
  const auto snapshot = makeTwoAvatars();
  std::vector<View> views(OcclusionCuller::kMaxViews + 3,
                          View{snapshot.get(), makeSquareCamera(16), {}});
  for (std::size_t i = 0; i < views.size(); ++i)
    views[i].camera.forward = Vec3(0.02 * static_cast<double>(i) - 0.7, 0, -1);
  const std::vector<Frame> frames = renderer.render(views);
  for (std::size_t i = 0; i < views.size(); ++i)
    expectSame(frames[i], renderer.render(*snapshot, views[i].camera, views[i].options), i);
}

TEST(Views, ARefusedViewFailsAndTheOthersAreRendered) {
  RenderThread renders(makeHeap());
  std::vector<RenderRequest> requests(3, {makeTwoAvatars(), {makeSquareCamera(16), {}}});
  requests[1].view.camera.eye.x() = std::numeric_limits<double>::quiet_NaN();
  std::promise<RenderThread::Frames> promise;
  renders.render(requests,
                 [&](RenderThread::Frames frames) { promise.set_value(std::move(frames)); });
  RenderThread::Frames frames = promise.get_future().get();
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].get().tick, 7u);
  EXPECT_THROW(frames[1].get(), RenderError);
  EXPECT_EQ(frames[2].get().tick, 7u);
}

}  // namespace
}  // namespace enfilade::render
