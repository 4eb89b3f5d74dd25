#include "render/service/renderer_selector.hpp"

#include <gtest/gtest.h>

#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

constexpr Channels kColour{true, true, true, false};
constexpr Channels kMeasured{false, true, true, false};

TEST(RendererSelector, TheWordsOfTheKindsAreReadAsTheyAreWritten) {
  for (const RendererKind kind : {RendererKind::automatic, RendererKind::gl, RendererKind::rays})
    EXPECT_EQ(parseRendererKind(toString(kind)), kind);
  EXPECT_EQ(parseRendererKind("vulkan"), std::nullopt);
}

TEST(RendererSelector, AGpuIsAlwaysPreferred) {
  for (const int size : {1, 256, 4096})
    for (const Channels& channels : {kColour, kMeasured})
      EXPECT_EQ(chooseRendererKind(false, makeSquareCamera(size), channels, 1'000'000),
                RendererKind::gl);
}

TEST(RendererSelector, EachKindDrawsWithItsOwnAndARequestGoesBeforeIt) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}});
  RendererSelector gl(scene, RendererKind::gl), rays(scene, RendererKind::rays);
  const Camera camera = makeSquareCamera(20);
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

TEST(RendererSelector, OnACpuRaysDrawSmallPicturesButForColoursOfFewTriangles) {
  for (const int size : {1, 128, 256}) {
    const auto camera = makeSquareCamera(size);
    const std::size_t many = 4u * static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
    EXPECT_EQ(chooseRendererKind(true, camera, kMeasured, 0), RendererKind::rays) << size;
    EXPECT_EQ(chooseRendererKind(true, camera, kColour, many - 1), RendererKind::gl) << size;
    EXPECT_EQ(chooseRendererKind(true, camera, kColour, many), RendererKind::rays) << size;
  }
  for (const int size : {257, 640, 4096})
    for (const Channels& channels : {kColour, kMeasured})
      EXPECT_EQ(chooseRendererKind(true, makeSquareCamera(size), channels, 100'000'000),
                RendererKind::gl)
          << size;
}

TEST(RendererSelector, AutomaticFollowsItsRule) {
  const auto scene = makeScene(makeCrowd(50));
  RendererSelector renderer(scene);
  for (const Channels& channels : {kColour, kMeasured}) {
    for (const int size : {20, 300}) {
      FrameOptions options;
      options.channels = channels;
      const Camera camera = makeSquareCamera(size);
      const bool rays = renderer.render({}, camera, options).renderer.rfind("Embree", 0) == 0;
      const RendererKind expected =
          chooseRendererKind(renderer.software(), camera, channels, 50 * 12);
      EXPECT_EQ(rays, expected == RendererKind::rays);
    }
  }
}

TEST(RendererSelector, ADeviceThatIsNotThereIsAnErrorWithTheKindsThatNeedOne) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}});
  const DeviceChoice none{"no device is called so", false};
  EXPECT_THROW(RendererSelector(scene, RendererKind::gl, none), RenderError);
  EXPECT_THROW(RendererSelector(scene, RendererKind::automatic, none), RenderError);
  RendererSelector rays(scene, RendererKind::rays, none);
  EXPECT_EQ(rays.render({}, makeSquareCamera(20)).ids.size(), 400u);
  EXPECT_THROW(rays.render({}, makeSquareCamera(20), {}, RendererKind::gl), RenderError);
  EXPECT_EQ(rays.render({}, makeSquareCamera(20)).ids.size(), 400u);
}

TEST(RendererSelector, RaysAreRefusedWhereAGpuIsRequired) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}});
  EXPECT_THROW(RendererSelector(scene, RendererKind::rays, {"", true}), RenderError);
}

TEST(RendererSelector, NamesTheRendererOfAFrameInAdvance) {
  RendererSelector selector(makeScene(makeCrowd(60)));
  for (const int size : {8, 64, 300}) {
    for (const bool colour : {false, true}) {
      const FrameOptions options{.channels = {colour, true, true, false}};
      const std::string name = selector.deviceNameFor(makeSquareCamera(size), options);
      EXPECT_EQ(name, selector.render({}, makeSquareCamera(size), options).renderer) << size;
    }
  }
}

TEST(RendererSelector, AutomaticShadowsAreForLargePerspectiveColourByProcessors) {
  RendererSelector selector(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}}), RendererKind::rays);
  FrameOptions options{.automaticShadows = true};
  Camera camera = makeSquareCamera(300);
  EXPECT_TRUE(selector.render({}, camera, options).shadows);
  options.channels.rgb = false;
  EXPECT_FALSE(selector.render({}, camera, options).shadows);
  options.channels.rgb = true;
  EXPECT_FALSE(selector.render({}, makeSquareCamera(256), options).shadows);
  camera.projection = Camera::Projection::orthographic;
  EXPECT_FALSE(selector.render({}, camera, options).shadows);
  EXPECT_FALSE(choosesShadows(false, makeSquareCamera(300), {}, 12));
  EXPECT_FALSE(choosesShadows(true, makeSquareCamera(300), {}, 2'000'001));
  EXPECT_FALSE(selector.render({}, makeSquareCamera(300)).shadows) << "off without the option";
}

}  // namespace
}  // namespace enfilade::render
