#include "render/service/render_thread.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "tests/render/hand_made_scene.hpp"

namespace enfilade::render {
namespace {

std::shared_ptr<const scene::Snapshot> makeSnapshot(std::uint64_t tick) {
  auto snapshot = std::make_shared<scene::Snapshot>();
  snapshot->tick = tick;
  return snapshot;
}

TEST(RenderThread, SeveralThreadsEachGetTheirOwnPictures) {
  RenderThread renders(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}, {{5, 0, 0}, {2, 2, 2}, {}}}));
  const auto ask = [&](std::uint64_t first, const Vec3& forward, std::uint32_t expected) {
    for (std::uint64_t tick = first; tick < first + 10; ++tick) {
      Camera camera = makeSquareCamera(32);
      camera.forward = forward;
      const Frame frame = renders.render(makeSnapshot(tick), camera).get();
      EXPECT_EQ(frame.tick, tick);
      EXPECT_EQ(frame.ids[getPixelIndex(frame, 16, 16)], expected);
    }
  };
  std::thread one(ask, 100, -Vec3::UnitZ(), 1u);
  std::thread two(ask, 200, Vec3::UnitX(), 2u);
  std::thread three(ask, 300, Vec3::UnitZ(), 0u);
  one.join();
  two.join();
  three.join();
  EXPECT_FALSE(renders.deviceName().empty());
}

TEST(RenderThread, ARefusedCameraFailsItsFutureAndTheThreadContinues) {
  RenderThread renders(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}));
  Camera bad = makeSquareCamera(32);
  bad.eye.x() = std::nan("");
  auto refused = renders.render(makeSnapshot(1), bad);
  auto missing = renders.render(nullptr, makeSquareCamera(32));
  auto fine = renders.render(makeSnapshot(2), makeSquareCamera(32));
  EXPECT_THROW(refused.get(), RenderError);
  EXPECT_THROW(missing.get(), RenderError);
  EXPECT_EQ(fine.get().tick, 2u);
}

TEST(RenderThread, QueuedImagesAreFinishedBeforeTheEnd) {
  std::vector<std::future<Frame>> frames;
  {
    RenderThread renders(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}));
    for (std::uint64_t tick = 0; tick < 8; ++tick) {
      frames.push_back(renders.render(makeSnapshot(tick), makeSquareCamera(32)));
    }
  }
  for (std::uint64_t tick = 0; tick < frames.size(); ++tick) {
    EXPECT_EQ(frames[tick].get().tick, tick);
  }
}

TEST(RenderThread, WithoutADeviceEachImageIsRefusedWithTheReason) {
  RenderThread renders(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}), {.device = "no such device"});
  auto first =
      renders.render(makeSnapshot(1), makeSquareCamera(32));  // while the device is being opened
  EXPECT_TRUE(renders.deviceName().empty());
  EXPECT_NE(renders.unavailableReason().find("no such device"), std::string::npos)
      << renders.unavailableReason();
  auto second = renders.render(makeSnapshot(2), makeSquareCamera(32));
  EXPECT_THROW(first.get(), RendererUnavailable);
  EXPECT_THROW(second.get(), RendererUnavailable);
}

TEST(RenderThread, WithoutASceneThereIsAnErrorAndNoThread) {
  EXPECT_THROW(RenderThread{nullptr}, RenderError);
}

}  // namespace
}  // namespace enfilade::render
