#include "server/messages/frame_messages.hpp"

#include <cstring>

#include "protocol/framing.hpp"
#include "render/image/encode.hpp"
#include "render/image/image.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

constexpr int kJpegQuality = 85;

using CameraOrError = std::variant<View, v1::Error>;

CameraOrError eyesOf(const v1::AvatarEyes& eyes, const scene::Snapshot& snapshot, int width,
                     int height) {
  const scene::AvatarView* avatar = avatarNamed(snapshot, eyes.avatar());
  if (!avatar) return unknownAvatar(eyes.avatar(), "eyes.avatar");
  scene::AvatarView seer = *avatar;
  if (eyes.has_forward()) seer.gaze = vectorFrom(eyes.forward()).stableNormalized();
  View view{render::firstPerson(seer, width, height), {.hidden = avatar->id}};
  if (eyes.has_fov_y()) view.camera.fovY = eyes.fov_y();
  if (eyes.has_near()) view.camera.near = eyes.near();
  if (eyes.has_far()) view.camera.far = eyes.far();
  return view;
}

CameraOrError freeView(const v1::FreeCamera& free, const scene::Snapshot& snapshot, int width,
                       int height) {
  View view;
  render::Camera& camera = view.camera;
  camera.width = width;
  camera.height = height;
  camera.eye = vectorFrom(free.eye());
  if (free.has_forward()) camera.forward = vectorFrom(free.forward());
  if (free.has_target()) camera.forward = vectorFrom(free.target()) - camera.eye;
  if (free.has_up()) camera.up = vectorFrom(free.up());
  if (free.has_fov_y()) camera.fovY = free.fov_y();
  if (free.has_height_y()) {
    camera.projection = render::Camera::Projection::orthographic;
    camera.heightY = free.height_y();
  }
  if (free.has_near()) camera.near = free.near();
  if (free.has_far()) camera.far = free.far();
  if (free.hide_avatar().empty()) return view;
  const scene::AvatarView* avatar = avatarNamed(snapshot, free.hide_avatar());
  if (!avatar) return unknownAvatar(free.hide_avatar(), "free.hide_avatar");
  view.options.hidden = avatar->id;
  return view;
}

template <typename T>
void append(std::vector<std::uint8_t>& bytes, const std::vector<T>& values) {
  const std::size_t start = bytes.size();
  bytes.resize(start + values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(bytes.data() + start, values.data(), values.size() * sizeof(T));
}

void appendChannel(std::vector<std::uint8_t>& bytes, const render::Frame& frame,
                   v1::Channel channel, v1::Encoding encoding) {
  if (channel == v1::CHANNEL_IDS) {
    append(bytes, frame.ids);
  } else if (channel == v1::CHANNEL_NORMALS) {
    append(bytes, frame.normals);
  } else if (channel == v1::CHANNEL_RANGE) {
    append(bytes, render::rangeOf(frame));
  } else if (channel == v1::CHANNEL_DEPTH) {
    append(bytes, frame.depth);
  } else if (encoding == v1::ENCODING_JPEG) {
    const render::Camera& camera = frame.camera;
    append(bytes, render::encodeJpeg({camera.width, camera.height, 3, frame.rgb}, kJpegQuality));
  } else if (encoding == v1::ENCODING_PNG) {
    append(bytes, render::encodePng(render::colourOf(frame)));
  } else {
    append(bytes, frame.rgb);
  }
}

void addPlane(v1::Frame& message, std::vector<std::uint8_t>& attachment, const render::Frame& frame,
              v1::Channel channel, v1::Encoding rgbEncoding) {
  const bool coded = channel == v1::CHANNEL_RGB &&
                     (rgbEncoding == v1::ENCODING_PNG || rgbEncoding == v1::ENCODING_JPEG);
  v1::Plane& plane = *message.add_planes();
  plane.set_channel(channel);
  plane.set_encoding(coded ? rgbEncoding : v1::ENCODING_RAW);
  plane.set_width(message.width());
  plane.set_height(message.height());
  plane.set_offset(attachment.size());
  appendChannel(attachment, frame, channel, plane.encoding());
  plane.set_length(attachment.size() - plane.offset());
}

/// The field that a refusal of render:: names: "camera: far is 0; ...".
std::string fieldOf(const std::string& refusal) {
  const std::size_t start = refusal.find(": ") + 2;
  const std::string field = refusal.substr(start, refusal.find(' ', start) - start);
  const std::string pinhole = "pinhole";
  if (field == "fovY") return "fov_y";
  if (field == "heightY") return "height_y";
  return field.starts_with(pinhole) ? "intrinsics" + field.substr(pinhole.size()) : field;
}

std::optional<v1::Error> channelProblem(const v1::FrameRequest& request) {
  bool asked[v1::Channel_MAX + 1] = {};
  for (const int channel : request.channels()) {
    const bool known = v1::Channel_IsValid(channel) && channel != v1::CHANNEL_UNSPECIFIED;
    if (!known || asked[channel]) {
      return errorOf(v1::ERROR_BAD_MESSAGE,
                     "channels: give rgb, ids, depth, normals and range each at most once, not " +
                         std::to_string(channel),
                     "channels");
    }
    asked[channel] = true;
  }
  return std::nullopt;
}

render::Channels channelsOf(const v1::FrameRequest& request) {
  if (request.channels().empty()) return {true, false, false, false};
  render::Channels channels{false, false, false, false};
  for (const int channel : request.channels()) {
    if (channel == v1::CHANNEL_RGB) channels.rgb = true;
    if (channel == v1::CHANNEL_IDS) channels.ids = true;
    if (channel == v1::CHANNEL_DEPTH || channel == v1::CHANNEL_RANGE) channels.depth = true;
    if (channel == v1::CHANNEL_NORMALS) channels.normals = true;
  }
  return channels;
}

/// Gives the camera the intrinsics asked for; an error when they contradict what else is asked.
std::optional<v1::Error> addIntrinsics(render::Camera& camera, const v1::FrameRequest& request) {
  if (!request.has_intrinsics()) return std::nullopt;
  const bool opening = request.has_eyes()
                           ? request.eyes().has_fov_y()
                           : request.free().projection_case() != v1::FreeCamera::PROJECTION_NOT_SET;
  if (opening) {
    return errorOf(v1::ERROR_BAD_CAMERA,
                   "intrinsics: give them or fov_y or height_y, one of the three", "intrinsics");
  }
  const v1::Intrinsics& given = request.intrinsics();
  camera.pinhole = render::Pinhole{given.fx(), given.fy(), given.cx(), given.cy()};
  return std::nullopt;
}

std::optional<v1::Error> glassProblem(const v1::FrameRequest& request) {
  if (v1::Glass_IsValid(request.glass())) return std::nullopt;
  return errorOf(v1::ERROR_BAD_MESSAGE,
                 "glass: give clear or solid, not " + std::to_string(request.glass()), "glass");
}

std::optional<v1::Error> rendererProblem(const v1::FrameRequest& request) {
  if (v1::Renderer_IsValid(request.renderer())) return std::nullopt;
  return errorOf(v1::ERROR_BAD_MESSAGE,
                 "renderer: give gl or rays, not " + std::to_string(request.renderer()),
                 "renderer");
}

std::optional<v1::Error> encodingProblem(const v1::FrameRequest& request) {
  if (v1::Encoding_IsValid(request.rgb_encoding())) return std::nullopt;
  return errorOf(
      v1::ERROR_BAD_MESSAGE,
      "rgb_encoding: give raw, png or jpeg, not " + std::to_string(request.rgb_encoding()),
      "rgb_encoding");
}

/// Of raw pixels.
std::uint64_t bytesPerPixel(const v1::FrameRequest& request) {
  std::uint64_t bytes = request.channels().empty() ? 3 : 0;
  for (const int channel : request.channels()) {
    if (channel == v1::CHANNEL_NORMALS)
      bytes += 12;
    else
      bytes += channel == v1::CHANNEL_RGB ? 3 : 4;
  }
  return bytes;
}

/// Pixels that no client of ours takes in one message are refused before they are drawn.
std::optional<v1::Error> sizeProblem(const v1::FrameRequest& request) {
  constexpr std::uint64_t kRoomForTheMessage = 65536;
  const std::uint64_t most = protocol::kClientTakes.total - kRoomForTheMessage;
  const std::uint64_t bytes = bytesPerPixel(request) * request.width() * request.height();
  if (bytes <= most) return std::nullopt;
  return errorOf(v1::ERROR_TOO_LARGE,
                 "channels: these take " + std::to_string(bytes) + " bytes of pixels, at most " +
                     std::to_string(most) + " fit a message; ask for fewer at a time",
                 "channels");
}

render::RendererKind rendererOf(const v1::FrameRequest& request) {
  if (request.renderer() == v1::RENDERER_GL) return render::RendererKind::gl;
  if (request.renderer() == v1::RENDERER_RAYS) return render::RendererKind::rays;
  return render::RendererKind::automatic;
}

}  // namespace

CameraOrError viewFrom(const v1::FrameRequest& request, const scene::Snapshot& snapshot) {
  if (auto problem = channelProblem(request)) return *problem;
  if (auto problem = glassProblem(request)) return *problem;
  if (auto problem = rendererProblem(request)) return *problem;
  if (auto problem = encodingProblem(request)) return *problem;
  constexpr std::uint32_t kMost = 4096;
  if (request.width() < 1 || request.width() > kMost || request.height() < 1 ||
      request.height() > kMost) {
    return errorOf(v1::ERROR_BAD_CAMERA, "width and height: give 1 to 4096 pixels", "width");
  }
  if (auto problem = sizeProblem(request)) return *problem;
  const int width = static_cast<int>(request.width());
  const int height = static_cast<int>(request.height());
  CameraOrError view = errorOf(v1::ERROR_BAD_CAMERA, "view is missing: give eyes or free", "view");
  if (request.has_eyes()) view = eyesOf(request.eyes(), snapshot, width, height);
  if (request.has_free()) view = freeView(request.free(), snapshot, width, height);
  if (View* usable = std::get_if<View>(&view)) {
    usable->options.channels = channelsOf(request);
    if (request.glass() == v1::GLASS_SOLID) usable->options.glass = render::Glass::solid;
    usable->options.shadows = request.shadows();
    usable->renderer = rendererOf(request);
    if (auto problem = addIntrinsics(usable->camera, request)) return *problem;
    if (const auto why = render::refusal(usable->camera)) {
      return errorOf(v1::ERROR_BAD_CAMERA, *why, fieldOf(*why));
    }
  }
  return view;
}

v1::Frame messageOf(const render::Frame& frame, double time, const v1::FrameRequest& request,
                    std::vector<std::uint8_t>& attachment) {
  v1::Frame message;
  message.set_tick(frame.tick);
  message.set_time(time);
  message.set_renderer(frame.renderer);
  message.set_software(frame.software);
  message.set_drawing_seconds(frame.statistics.seconds);
  *message.mutable_camera() = messageOf(frame.camera);
  message.set_width(static_cast<std::uint32_t>(frame.camera.width));
  message.set_height(static_cast<std::uint32_t>(frame.camera.height));
  if (frame.camera.projection == render::Camera::Projection::perspective) {
    const render::Pinhole pinhole = render::intrinsicsOf(frame.camera);
    v1::Intrinsics& intrinsics = *message.mutable_intrinsics();
    intrinsics.set_fx(pinhole.fx);
    intrinsics.set_fy(pinhole.fy);
    intrinsics.set_cx(pinhole.cx);
    intrinsics.set_cy(pinhole.cy);
  }
  message.set_glass(request.glass() == v1::GLASS_SOLID ? v1::GLASS_SOLID : v1::GLASS_CLEAR);
  message.set_shadows(request.shadows());
  attachment.reserve(attachment.size() +
                     bytesPerPixel(request) * message.width() * message.height());
  for (const int channel : request.channels()) {
    addPlane(message, attachment, frame, static_cast<v1::Channel>(channel), request.rgb_encoding());
  }
  if (request.channels().empty()) {
    addPlane(message, attachment, frame, v1::CHANNEL_RGB, request.rgb_encoding());
  }
  return message;
}

v1::FrameRequest recordedView(const std::string& avatar) {
  constexpr std::uint32_t kWidth = 640, kHeight = 360;
  v1::FrameRequest request;
  request.mutable_eyes()->set_avatar(avatar);
  request.set_width(kWidth);
  request.set_height(kHeight);
  request.add_channels(v1::CHANNEL_RGB);
  request.set_rgb_encoding(v1::ENCODING_JPEG);
  return request;
}

std::optional<EncodedPicture> encodedPicture(const v1::Frame& frame,
                                             std::span<const std::uint8_t> attachment) {
  for (const v1::Plane& plane : frame.planes()) {
    if (plane.channel() != v1::CHANNEL_RGB) continue;
    const auto bytes = attachment.subspan(plane.offset(), plane.length());
    if (plane.encoding() == v1::ENCODING_JPEG)
      return EncodedPicture{"jpeg", {bytes.begin(), bytes.end()}};
    if (plane.encoding() == v1::ENCODING_PNG)
      return EncodedPicture{"png", {bytes.begin(), bytes.end()}};
    const std::vector<std::uint8_t> rgb(bytes.begin(), bytes.end());
    const int width = static_cast<int>(plane.width()), height = static_cast<int>(plane.height());
    return EncodedPicture{"jpeg", render::encodeJpeg({width, height, 3, rgb}, kJpegQuality)};
  }
  return std::nullopt;
}

v1::FreeCamera messageOf(const render::Camera& camera) {
  v1::FreeCamera message;
  *message.mutable_eye() = messageOf(camera.eye);
  *message.mutable_forward() = messageOf(camera.forward);
  *message.mutable_up() = messageOf(camera.up);
  if (camera.projection == render::Camera::Projection::orthographic) {
    message.set_height_y(camera.heightY);
  } else if (!camera.pinhole) {
    message.set_fov_y(camera.fovY);
  }
  message.set_near(camera.near);
  message.set_far(camera.far);
  return message;
}

}  // namespace enfilade::server
