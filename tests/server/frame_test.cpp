// Tests of images through a connection: visible objects are those of the world.
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "render/image/image.hpp"
#include "scene/world/world.hpp"
#include "server/hosting/frame_service.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

class Frames : public ServedRoom {
 protected:
  /// Ends the test without a renderer: as skipped, or in CI as failed.
  void SetUp() override {
    serve();
    ENFILADE_NEED_PICTURES(*server_);
  }
};

template <typename T>
std::vector<T> readValues(const protocol::ReceivedFrame& frame, v1::Channel channel) {
  const auto bytes = frame.plane(channel);
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

/// Spawns ann and lets her settle. Returns her id.
std::uint32_t standAt(protocol::Client& ann, double x, double z) {
  EXPECT_FALSE(ann.command(spawn("ann", x, 0.001, z)));
  return ann.step(30, true).avatars(0).id();
}

v1::FrameRequest makeEyesRequest(const std::string& avatar) {
  v1::FrameRequest request;
  request.mutable_eyes()->set_avatar(avatar);
  request.set_width(64);
  request.set_height(48);
  request.add_channels(v1::CHANNEL_IDS);
  request.add_channels(v1::CHANNEL_DEPTH);
  request.add_channels(v1::CHANNEL_RGB);
  return request;
}

v1::ErrorCode catchCode(protocol::Client& client, const v1::FrameRequest& request) {
  try {
    client.frame(request);
  } catch (const protocol::ProtocolError& error) {
    return error.code;
  }
  return v1::ERROR_UNSPECIFIED;
}

TEST_F(Frames, AnAvatarSeesTheWallItFacesAtItsDistance) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  const v1::StepReply step = ann.step(30, true);
  v1::FrameRequest request = makeEyesRequest("ann");
  request.set_tick(step.tick());
  const protocol::ReceivedFrame frame = ann.frame(request);
  const auto ids = readValues<std::uint32_t>(frame, v1::CHANNEL_IDS);
  const auto depth = readValues<float>(frame, v1::CHANNEL_DEPTH);
  ASSERT_EQ(ids.size(), 64u * 48u);
  ASSERT_EQ(depth.size(), 64u * 48u);
  EXPECT_EQ(frame.plane(v1::CHANNEL_RGB).size(), 64u * 48u * 3u);
  constexpr std::size_t middle = 24 * 64 + 32, below = 47 * 64 + 32;
  EXPECT_EQ(ids[middle], kWall);
  EXPECT_NEAR(depth[middle], 5 - step.avatars(0).feet().x(), 1e-3);
  EXPECT_EQ(ids[below], kFloor);
  EXPECT_EQ(frame.description.tick(), step.tick());
  EXPECT_EQ(frame.description.renderer(), server_->rendererName());
  for (const std::uint32_t id : ids) EXPECT_LE(id, 3u) << "own body not in the image";
}

TEST_F(Frames, AnotherAvatarIsSeenFromAboveUnderItsOwnId) {
  protocol::Client ann = makeClient("ann");
  const std::uint32_t id = standAt(ann, 1, 1);
  v1::FrameRequest request = makeEyesRequest("ann");
  v1::FreeCamera& camera = *request.mutable_free();
  *camera.mutable_eye() = makeVec(1, 6, 1);
  *camera.mutable_forward() = makeVec(0, -1, 0);
  *camera.mutable_up() = makeVec(0, 0, -1);
  camera.set_height_y(4);
  const auto ids = readValues<std::uint32_t>(ann.frame(request), v1::CHANNEL_IDS);
  EXPECT_EQ(ids[24 * 64 + 32], id);
  EXPECT_EQ(ids[0], kFloor);
  camera.set_hide_avatar("ann");
  EXPECT_EQ(readValues<std::uint32_t>(ann.frame(request), v1::CHANNEL_IDS)[24 * 64 + 32], kFloor);
}

TEST_F(Frames, AvatarsAreFiguresAndOnRequestTheirCollisionShapes) {
  protocol::Client ann = makeClient("ann");
  const std::uint32_t id = standAt(ann, 1, 1);
  v1::FrameRequest request = makeEyesRequest("ann");
  v1::FreeCamera& camera = *request.mutable_free();
  *camera.mutable_eye() = makeVec(-1, 0.9, 1);
  *camera.mutable_forward() = makeVec(1, 0, 0);
  const auto pixels = [&](bool shapes) {
    request.set_collision_shapes(shapes);
    const protocol::ReceivedFrame frame = ann.frame(request);
    EXPECT_EQ(frame.description.collision_shapes(), shapes);
    const auto ids = readValues<std::uint32_t>(frame, v1::CHANNEL_IDS);
    return std::count(ids.begin(), ids.end(), id);
  };
  const auto figure = pixels(false), shape = pixels(true);
  EXPECT_GT(figure, 100);
  EXPECT_GT(2 * shape, 3 * figure);
}

TEST_F(Frames, SamplesSmoothTheColourAloneAndOtherNumbersAreRefused) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(30);
  v1::FrameRequest request = makeEyesRequest("ann");
  const protocol::ReceivedFrame one = ann.frame(request);
  EXPECT_EQ(one.description.samples(), 1u);
  request.set_samples(4);
  const protocol::ReceivedFrame four = ann.frame(request);
  EXPECT_EQ(four.description.samples(), 4u);
  for (const v1::Channel channel : {v1::CHANNEL_IDS, v1::CHANNEL_DEPTH}) {
    const auto a = one.plane(channel), b = four.plane(channel);
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end())) << channel;
  }
  const auto a = one.plane(v1::CHANNEL_RGB), b = four.plane(v1::CHANNEL_RGB);
  EXPECT_FALSE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
  request.set_samples(3);
  try {
    ann.frame(request);
    ADD_FAILURE() << "three samples";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_NE(std::string(error.what()).find("samples: give 1, 4 or 16, not 3"), std::string::npos)
        << error.what();
  }
}

TEST_F(Frames, ShadowsAreDrawnByDefaultInLargePictures) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(30);
  v1::FrameRequest request = makeEyesRequest("ann");
  request.set_renderer(v1::RENDERER_RAYS);
  EXPECT_FALSE(ann.frame(request).description.shadows()) << "64 x 48";
  request.set_width(320);
  request.set_height(240);
  EXPECT_TRUE(ann.frame(request).description.shadows());
  request.set_shadows(false);
  EXPECT_FALSE(ann.frame(request).description.shadows());
}

TEST_F(Frames, APngHoldsTheSamePicture) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(30);
  v1::FrameRequest request = makeEyesRequest("ann");
  const protocol::ReceivedFrame raw = ann.frame(request);
  request.set_rgb_encoding(v1::ENCODING_PNG);
  const protocol::ReceivedFrame packed = ann.frame(request);
  const auto png = packed.plane(v1::CHANNEL_RGB), plain = raw.plane(v1::CHANNEL_RGB);
  const render::Image image = render::decodePng({png.begin(), png.end()});
  EXPECT_EQ(image.rgb, std::vector<std::uint8_t>(plain.begin(), plain.end()));
}

TEST_F(Frames, IntrinsicsRangeAndNormalsTravel) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(30);
  v1::FrameRequest request = makeEyesRequest("ann");
  request.add_channels(v1::CHANNEL_RANGE);
  request.add_channels(v1::CHANNEL_NORMALS);
  request.set_glass(v1::GLASS_SOLID);
  request.set_shadows(true);
  v1::Intrinsics& intrinsics = *request.mutable_intrinsics();
  intrinsics.set_fx(40);
  intrinsics.set_fy(40);
  intrinsics.set_cx(12.5);  // the axis goes through the middle of column 12
  intrinsics.set_cy(24.5);
  const protocol::ReceivedFrame frame = ann.frame(request);
  EXPECT_EQ(frame.description.intrinsics().cx(), 12.5);
  EXPECT_EQ(frame.description.glass(), v1::GLASS_SOLID);
  EXPECT_TRUE(frame.description.shadows());
  EXPECT_FALSE(frame.description.camera().has_fov_y());
  const auto depth = readValues<float>(frame, v1::CHANNEL_DEPTH);
  const auto range = readValues<float>(frame, v1::CHANNEL_RANGE);
  const auto normals = readValues<float>(frame, v1::CHANNEL_NORMALS);
  ASSERT_EQ(range.size(), 64u * 48u);
  ASSERT_EQ(normals.size(), 3u * 64u * 48u);
  constexpr std::size_t axis = 24 * 64 + 12, aside = 24 * 64 + 42;
  EXPECT_NEAR(range[axis], depth[axis], 1e-5);
  EXPECT_NEAR(range[aside], depth[aside] * 1.25, 1e-4);  // 30 pixels aside: 3, 4, 5
  EXPECT_NEAR(normals[3 * axis], -1, 1e-4) << "the wall ahead looks back along x";
  request.mutable_eyes()->set_fov_y(1);
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_BAD_CAMERA) << "both kinds of opening";
  request.mutable_eyes()->clear_fov_y();
  intrinsics.set_fx(0);
  try {
    ann.frame(request);
    ADD_FAILURE() << "no focal length";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.field, "frame.intrinsics.fx");
  }
}

TEST_F(Frames, TheRequestedRendererDrawsTheSameScene) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(30);
  v1::FrameRequest request = makeEyesRequest("ann");
  request.set_renderer(v1::RENDERER_GL);
  const protocol::ReceivedFrame drawn = ann.frame(request);
  request.set_renderer(v1::RENDERER_RAYS);
  const protocol::ReceivedFrame cast = ann.frame(request);
  EXPECT_EQ(cast.description.renderer().rfind("Embree ", 0), 0u);
  EXPECT_NE(drawn.description.renderer(), cast.description.renderer());
  for (const auto* frame : {&drawn, &cast}) EXPECT_GT(frame->description.drawing_seconds(), 0);
  constexpr std::size_t middle = 24 * 64 + 32;
  EXPECT_EQ(readValues<std::uint32_t>(cast, v1::CHANNEL_IDS)[middle], kWall);
  EXPECT_NEAR(readValues<float>(cast, v1::CHANNEL_DEPTH)[middle],
              readValues<float>(drawn, v1::CHANNEL_DEPTH)[middle], 1e-3);
  request.set_renderer(static_cast<v1::Renderer>(9));
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_BAD_MESSAGE);
}

TEST_F(Frames, AnImageAboveTheClientLimitIsRefusedAndTheConnectionContinues) {
  protocol::Client ann = makeClient("ann");
  v1::FrameRequest request;
  request.mutable_free();
  request.set_width(4096);
  request.set_height(4096);
  request.add_channels(v1::CHANNEL_DEPTH);
  request.add_channels(v1::CHANNEL_NORMALS);
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_TOO_LARGE);
  EXPECT_EQ(ann.step(1, false).tick(), 1u);
}

TEST_F(Frames, InvalidFrameRequestsAreRefusedByName) {
  protocol::Client ann = makeClient("ann");
  v1::FrameRequest request = makeEyesRequest("unknown");
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_UNKNOWN_AVATAR);
  request.mutable_free();
  request.set_width(5000);
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_BAD_CAMERA);
  request.set_width(64);
  *request.mutable_free()->mutable_forward() = makeVec(0, 0, 0);
  try {
    ann.frame(request);
    ADD_FAILURE() << "a camera without a direction";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.code, v1::ERROR_BAD_CAMERA);
    EXPECT_EQ(error.field, "frame.forward");
  }
  *request.mutable_free()->mutable_forward() = makeVec(1, 0, 0);
  request.set_tick(77);
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_TICK_GONE);
  request.clear_tick();
  request.add_channels(v1::CHANNEL_RGB);
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_BAD_MESSAGE) << "rgb twice";
  request.clear_channels();
  request.set_rgb_encoding(static_cast<v1::Encoding>(9));
  try {
    ann.frame(request);
    ADD_FAILURE() << "an unknown encoding";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.code, v1::ERROR_BAD_MESSAGE);
    EXPECT_EQ(error.field, "frame.rgb_encoding");
  }
  request.clear_rgb_encoding();
  request.mutable_free()->set_fov_y(4);
  try {
    ann.frame(request);
    ADD_FAILURE() << "a field of view beyond 180 degrees";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_EQ(error.field, "frame.fov_y");
  }
  request.mutable_free()->clear_fov_y();
  EXPECT_EQ(catchCode(ann, request), v1::ERROR_UNSPECIFIED);
}

TEST(FrameOrder, RawImagesDoNotOvertakeEncodedOnes) {
  FrameService service(makeSmallRoom());
  ENFILADE_NEED_PICTURES(service.deviceName());
  const scene::World world(makeSmallRoom());
  std::mutex mutex;
  std::vector<std::uint64_t> order;
  std::uint64_t id = 0;
  for (const v1::Encoding encoding :
       {v1::ENCODING_PNG, v1::ENCODING_RAW, v1::ENCODING_PNG, v1::ENCODING_RAW}) {
    FrameJob job;
    job.snapshot = world.snapshot();
    job.request.mutable_free()->mutable_eye()->set_y(1);
    job.request.set_rgb_encoding(encoding);
    job.request.set_width(encoding == v1::ENCODING_PNG ? 1024 : 2);
    job.request.set_height(job.request.width());
    job.view = std::get<render::ViewRequest>(viewFromProto(job.request, *job.snapshot));
    service.renderFrame(std::move(job), [&, number = ++id](const EncodedMessage& reply) {
      const std::lock_guard lock(mutex);
      EXPECT_TRUE(reply);
      order.push_back(number);
    });
  }
  service.finish();
  EXPECT_EQ(order, (std::vector<std::uint64_t>{1, 2, 3, 4}));
}

TEST(FrameOrder, ImagesThatWaitAreDrawnTogetherAlsoOfSeveralWorlds) {
  FrameService service(makeSmallRoom());
  ENFILADE_NEED_PICTURES(service.deviceName());
  const scene::World world(makeSmallRoom());
  std::mutex mutex;
  std::vector<double> seconds;  // views drawn together share their time equally
  std::vector<std::uint64_t> ticks;
  const auto request = [&](const std::shared_ptr<const scene::Snapshot>& snapshot, unsigned size) {
    FrameJob job;
    job.snapshot = snapshot;
    job.request.mutable_free()->mutable_eye()->set_y(1);
    job.request.set_width(size);
    job.request.set_height(size);
    job.view = std::get<render::ViewRequest>(viewFromProto(job.request, *job.snapshot));
    job.onRendered = [&](const v1::Frame& frame, std::span<const std::uint8_t>) {
      const std::lock_guard lock(mutex);
      seconds.push_back(frame.drawing_seconds());
      ticks.push_back(frame.tick());
    };
    service.renderFrame(std::move(job), [](const EncodedMessage& reply) { EXPECT_TRUE(reply); });
  };
  const auto elsewhere = std::make_shared<scene::Snapshot>(*world.snapshot());
  elsewhere->tick = 5;
  request(world.snapshot(), 1024);  // the others wait for it
  for (int i = 0; i < 3; ++i) request(world.snapshot(), 16);
  for (int i = 0; i < 2; ++i) request(elsewhere, 16);
  service.finish();
  ASSERT_EQ(seconds.size(), 6u);
  EXPECT_NE(seconds[0], seconds[1]);
  for (std::size_t i = 2; i < 6; ++i) EXPECT_EQ(seconds[1], seconds[i]) << i;
  EXPECT_EQ(ticks, (std::vector<std::uint64_t>{0, 0, 0, 0, 5, 5}));
}

}  // namespace
}  // namespace enfilade::server::testing
