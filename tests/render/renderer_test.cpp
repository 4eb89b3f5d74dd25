#include "render/renderer.hpp"

#include <gtest/gtest.h>

#include "tests/render/things_to_see.hpp"

namespace enfilade::render {
namespace {

constexpr Channels kColour{true, true, true, false};
constexpr Channels kMeasured{false, true, true, false};

TEST(Renderer, TheWordsOfTheKindsAreReadAsTheyAreWritten) {
  for (const RendererKind kind : {RendererKind::automatic, RendererKind::gl, RendererKind::rays})
    EXPECT_EQ(rendererKindFrom(wordOf(kind)), kind);
  EXPECT_EQ(rendererKindFrom("vulkan"), std::nullopt);
}

TEST(Renderer, AGpuIsAlwaysPreferred) {
  for (const std::size_t triangles : {std::size_t{0}, std::size_t{100'000'000}})
    for (const Channels& channels : {kColour, kMeasured})
      EXPECT_EQ(automaticKind(false, triangles, channels), RendererKind::gl);
}

TEST(Renderer, EachKindDrawsWithItsOwnAndARequestGoesBeforeIt) {
  const auto scene = sceneOf({{{0, 0, -5}, {2, 2, 2}, {}}});
  Renderer gl(scene, RendererKind::gl), rays(scene, RendererKind::rays);
  const Camera camera = squareCamera(20);
  const std::string glName = gl.render({}, camera).renderer;
  const std::string raysName = rays.render({}, camera).renderer;
  EXPECT_EQ(glName, gl.deviceName());
  EXPECT_EQ(raysName, rays.deviceName());
  EXPECT_EQ(raysName.rfind("Embree ", 0), 0u);
  EXPECT_NE(glName, raysName);
  EXPECT_EQ(gl.render({}, camera, {}, RendererKind::rays).renderer, raysName);
  EXPECT_EQ(rays.render({}, camera, {}, RendererKind::gl).renderer, glName);
  EXPECT_EQ(rays.render({}, camera).renderer, raysName);
}

TEST(Renderer, OnACpuRaysMeasureLargeScenesAndGlDrawsAllColours) {
  for (const std::size_t triangles : {std::size_t{1'000'000}, std::size_t{100'000'000}}) {
    EXPECT_EQ(automaticKind(true, triangles, kMeasured), RendererKind::rays) << triangles;
    EXPECT_EQ(automaticKind(true, triangles, kColour), RendererKind::gl) << triangles;
  }
  for (const std::size_t triangles : {std::size_t{0}, std::size_t{10'000}})
    EXPECT_EQ(automaticKind(true, triangles, kMeasured), RendererKind::gl) << triangles;
}

TEST(Renderer, AutomaticFollowsItsRule) {
  const auto scene = sceneOf(crowd(50));
  Renderer renderer(scene);
  for (const Channels& channels : {kColour, kMeasured}) {
    FrameOptions options;
    options.channels = channels;
    const bool rays =
        renderer.render({}, squareCamera(20), options).renderer.rfind("Embree", 0) == 0;
    const RendererKind expected =
        automaticKind(renderer.software(), drawnTriangles(scene->model()), channels);
    EXPECT_EQ(rays, expected == RendererKind::rays);
  }
}

TEST(Renderer, ADeviceThatIsNotThereIsAnErrorWithTheKindsThatNeedOne) {
  const auto scene = sceneOf({{{0, 0, -5}, {2, 2, 2}, {}}});
  const DeviceChoice none{"no device is called so", false};
  EXPECT_THROW(Renderer(scene, RendererKind::gl, none), RenderError);
  EXPECT_THROW(Renderer(scene, RendererKind::automatic, none), RenderError);
  Renderer rays(scene, RendererKind::rays, none);
  EXPECT_EQ(rays.render({}, squareCamera(20)).ids.size(), 400u);
  EXPECT_THROW(rays.render({}, squareCamera(20), {}, RendererKind::gl), RenderError);
  EXPECT_EQ(rays.render({}, squareCamera(20)).ids.size(), 400u);
}

TEST(Renderer, RaysAreRefusedWhereAGpuIsRequired) {
  const auto scene = sceneOf({{{0, 0, -5}, {2, 2, 2}, {}}});
  EXPECT_THROW(Renderer(scene, RendererKind::rays, {"", true}), RenderError);
}

}  // namespace
}  // namespace enfilade::render
