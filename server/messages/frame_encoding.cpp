#include "server/messages/frame_encoding.hpp"

#include <cstring>

#include "collision/assert.hpp"
#include "render/camera/lens.hpp"
#include "render/image/depth_noise.hpp"
#include "render/image/encode.hpp"
#include "render/image/image.hpp"
#include "render/optical_flow.hpp"

namespace enfilade::server {
namespace {

constexpr int kJpegQuality = 85;

template <typename T>
void appendBytes(std::vector<std::uint8_t>& bytes, const std::vector<T>& values) {
  const std::size_t start = bytes.size();
  bytes.resize(start + values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(bytes.data() + start, values.data(), values.size() * sizeof(T));
}

std::vector<float> makeNoisyDepth(const render::Frame& frame, const v1::FrameRequest& request) {
  std::vector<float> depth = frame.depth;
  const double scale = request.depth_noise().scale();
  render::DepthNoise noise{request.depth_noise().seed(), scale == 0 ? 1 : scale, {}, 0};
  const std::string& table = request.depth_noise().distortion();
  noise.distortion.resize(table.size() / sizeof(float));
  if (!table.empty())
    std::memcpy(noise.distortion.data(), table.data(), noise.distortion.size() * sizeof(float));
  noise.distortionRows = static_cast<int>(request.depth_noise().distortion_rows());
  render::addDepthNoise(depth, frame.camera.width, frame.camera.height, noise, frame.tick);
  return depth;
}

/// The intrinsics of a pinhole or fisheye camera.
std::optional<render::Pinhole> findIntrinsics(const render::Camera& camera) {
  if (camera.projection != render::Camera::Projection::perspective) return std::nullopt;
  if (!camera.lens) return render::computeIntrinsics(camera);
  if (camera.lens->kind != render::Camera::Lens::Kind::fisheye) return std::nullopt;
  return render::computeFisheyeIntrinsics(camera);
}

void appendChannel(std::vector<std::uint8_t>& bytes, const render::Frame& frame,
                   const FrameSource& source, v1::Channel channel, v1::Encoding encoding) {
  const v1::FrameRequest& request = source.request;
  if (channel == v1::CHANNEL_IDS) {
    appendBytes(bytes, frame.ids);
  } else if (channel == v1::CHANNEL_CLASS) {
    appendBytes(bytes, source.scene.objectClasses().getClasses(frame.ids));
  } else if (channel == v1::CHANNEL_THING) {
    appendBytes(bytes, source.scene.objectClasses().getThings(frame.ids));
  } else if (channel == v1::CHANNEL_FLOW) {
    ENFILADE_ASSERT(source.earlier);
    appendBytes(bytes,
                render::computeOpticalFlow(frame, source.scene, source.snapshot,
                                           *source.earlier->snapshot, source.earlier->camera));
  } else if (channel == v1::CHANNEL_NORMALS) {
    appendBytes(bytes, frame.normals);
  } else if (channel == v1::CHANNEL_RANGE) {
    appendBytes(bytes, render::computeRange(frame));
  } else if (channel == v1::CHANNEL_DEPTH) {
    appendBytes(bytes, request.has_depth_noise() ? makeNoisyDepth(frame, request) : frame.depth);
  } else if (encoding == v1::ENCODING_JPEG) {
    const render::Camera& camera = frame.camera;
    appendBytes(bytes,
                render::encodeJpeg({camera.width, camera.height, 3, frame.rgb}, kJpegQuality));
  } else if (encoding == v1::ENCODING_PNG) {
    appendBytes(bytes, render::encodePng(render::toImage(frame)));
  } else {
    appendBytes(bytes, frame.rgb);
  }
}

void addPlane(v1::Frame& message, std::vector<std::uint8_t>& attachment, const render::Frame& frame,
              const FrameSource& source, v1::Channel channel) {
  const v1::Encoding rgbEncoding = source.request.rgb_encoding();
  const bool compressed = channel == v1::CHANNEL_RGB &&
                          (rgbEncoding == v1::ENCODING_PNG || rgbEncoding == v1::ENCODING_JPEG);
  v1::Plane& plane = *message.add_planes();
  plane.set_channel(channel);
  plane.set_encoding(compressed ? rgbEncoding : v1::ENCODING_RAW);
  plane.set_width(message.width());
  plane.set_height(message.height());
  plane.set_offset(attachment.size());
  appendChannel(attachment, frame, source, channel, plane.encoding());
  plane.set_length(attachment.size() - plane.offset());
}

}  // namespace

v1::Frame encodeFrame(const render::Frame& frame, const FrameSource& source,
                      std::vector<std::uint8_t>& attachment) {
  const v1::FrameRequest& request = source.request;
  v1::Frame message;
  if (source.earlier) message.set_flow_from(source.earlier->snapshot->tick);
  message.set_tick(frame.tick);
  message.set_time(source.snapshot.time);
  message.set_renderer(frame.renderer);
  message.set_software(frame.software);
  message.set_drawing_seconds(frame.statistics.seconds);
  *message.mutable_camera() = toProto(frame.camera);
  message.set_width(static_cast<std::uint32_t>(frame.camera.width));
  message.set_height(static_cast<std::uint32_t>(frame.camera.height));
  if (const auto pinhole = findIntrinsics(frame.camera)) {
    v1::Intrinsics& intrinsics = *message.mutable_intrinsics();
    intrinsics.set_fx(pinhole->fx);
    intrinsics.set_fy(pinhole->fy);
    intrinsics.set_cx(pinhole->cx);
    intrinsics.set_cy(pinhole->cy);
  }
  message.set_glass(request.glass() == v1::GLASS_SOLID ? v1::GLASS_SOLID : v1::GLASS_CLEAR);
  message.set_shadows(frame.shadows);
  message.set_samples(frame.samples);
  message.set_collision_shapes(frame.avatars == render::AvatarForm::collision);
  attachment.reserve(attachment.size() +
                     computeBytesPerPixel(request) * message.width() * message.height());
  for (const int channel : request.channels()) {
    addPlane(message, attachment, frame, source, static_cast<v1::Channel>(channel));
  }
  if (request.channels().empty()) {
    addPlane(message, attachment, frame, source, v1::CHANNEL_RGB);
  }
  return message;
}

std::optional<EncodedImage> extractImage(const v1::Frame& frame,
                                         std::span<const std::uint8_t> attachment) {
  for (const v1::Plane& plane : frame.planes()) {
    if (plane.channel() != v1::CHANNEL_RGB) continue;
    const auto bytes = attachment.subspan(plane.offset(), plane.length());
    if (plane.encoding() == v1::ENCODING_JPEG)
      return EncodedImage{"jpeg", {bytes.begin(), bytes.end()}};
    if (plane.encoding() == v1::ENCODING_PNG)
      return EncodedImage{"png", {bytes.begin(), bytes.end()}};
    const std::vector<std::uint8_t> rgb(bytes.begin(), bytes.end());
    const int width = static_cast<int>(plane.width()), height = static_cast<int>(plane.height());
    return EncodedImage{"jpeg", render::encodeJpeg({width, height, 3, rgb}, kJpegQuality)};
  }
  return std::nullopt;
}

}  // namespace enfilade::server
