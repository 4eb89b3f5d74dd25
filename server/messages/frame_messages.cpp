#include "server/messages/frame_messages.hpp"

#include <algorithm>
#include <cstring>

#include "collision/assert.hpp"
#include "protocol/framing.hpp"
#include "render/camera/samples.hpp"
#include "render/image/depth_noise.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using ViewOrError = std::variant<render::ViewRequest, v1::Error>;

ViewOrError makeAvatarView(const v1::AvatarEyes& eyes, const scene::Snapshot& snapshot, int width,
                           int height) {
  const scene::AvatarSnapshot* avatar = findAvatar(snapshot, eyes.avatar());
  if (!avatar) return makeUnknownAvatarError(eyes.avatar(), "eyes.avatar");
  scene::AvatarSnapshot viewer = *avatar;
  if (eyes.has_forward()) viewer.viewDirection = vectorFromProto(eyes.forward()).stableNormalized();
  render::ViewRequest view{render::makeFirstPersonCamera(viewer, width, height),
                           {.hiddenEntity = avatar->id}};
  if (eyes.has_fov_y()) view.camera.fovY = eyes.fov_y();
  if (eyes.has_near()) view.camera.near = eyes.near();
  if (eyes.has_far()) view.camera.far = eyes.far();
  if (eyes.has_height()) view.camera.eye.y() = viewer.footPosition.y() + eyes.height();
  if (eyes.has_offset()) view.camera.eye += vectorFromProto(eyes.offset());
  return view;
}

ViewOrError makeFreeView(const v1::FreeCamera& free, const scene::Snapshot& snapshot, int width,
                         int height) {
  render::ViewRequest view;
  render::Camera& camera = view.camera;
  camera.width = width;
  camera.height = height;
  camera.eye = vectorFromProto(free.eye());
  if (free.has_forward()) camera.forward = vectorFromProto(free.forward());
  if (free.has_target()) camera.forward = vectorFromProto(free.target()) - camera.eye;
  if (free.has_up()) camera.up = vectorFromProto(free.up());
  if (free.has_fov_y()) camera.fovY = free.fov_y();
  if (free.has_height_y()) {
    camera.projection = render::Camera::Projection::orthographic;
    camera.heightY = free.height_y();
  }
  if (free.has_near()) camera.near = free.near();
  if (free.has_far()) camera.far = free.far();
  if (free.hide_avatar().empty()) return view;
  const scene::AvatarSnapshot* avatar = findAvatar(snapshot, free.hide_avatar());
  if (!avatar) return makeUnknownAvatarError(free.hide_avatar(), "free.hide_avatar");
  view.options.hiddenEntity = avatar->id;
  return view;
}

/// Extracts the field that a refusal of render:: names: "camera: far is 0; ...".
std::string fieldFromRefusal(const std::string& refusal) {
  ENFILADE_ASSERT(refusal.starts_with("camera: "));
  const std::size_t start = refusal.find(": ") + 2;
  const std::string field = refusal.substr(start, refusal.find(' ', start) - start);
  const std::string pinhole = "pinhole";
  if (field == "fovY") return "fov_y";
  if (field == "heightY") return "height_y";
  if (field == "lens.k" || field == "lens.width") return "lens.fisheye";
  return field.starts_with(pinhole) ? "intrinsics" + field.substr(pinhole.size()) : field;
}

std::optional<v1::Error> validateChannels(const v1::FrameRequest& request) {
  bool requested[v1::Channel_MAX + 1] = {};
  for (const int channel : request.channels()) {
    const bool known = v1::Channel_IsValid(channel) && channel != v1::CHANNEL_UNSPECIFIED;
    if (!known || requested[channel]) {
      return makeError(
          v1::ERROR_BAD_MESSAGE,
          "channels: give rgb, ids, depth, normals, range, class, thing and flow each at "
          "most once, not " +
              std::to_string(channel),
          "channels");
    }
    requested[channel] = true;
  }
  return std::nullopt;
}

render::Channels channelsFromProto(const v1::FrameRequest& request) {
  if (request.channels().empty()) return {true, false, false, false};
  render::Channels channels{false, false, false, false};
  for (const int channel : request.channels()) {
    if (channel == v1::CHANNEL_RGB) channels.rgb = true;
    if (channel == v1::CHANNEL_IDS || channel == v1::CHANNEL_CLASS || channel == v1::CHANNEL_THING)
      channels.ids = true;
    if (channel == v1::CHANNEL_DEPTH || channel == v1::CHANNEL_RANGE) channels.depth = true;
    if (channel == v1::CHANNEL_NORMALS) channels.normals = true;
    if (channel == v1::CHANNEL_FLOW) channels.ids = channels.depth = true;
  }
  return channels;
}

/// Applies the requested intrinsics to the camera. An error if the request also gives fov_y or
/// height_y.
std::optional<v1::Error> applyIntrinsics(render::Camera& camera, const v1::FrameRequest& request) {
  if (!request.has_intrinsics()) return std::nullopt;
  const bool hasFieldOfView =
      request.has_eyes() ? request.eyes().has_fov_y()
                         : request.free().projection_case() != v1::FreeCamera::PROJECTION_NOT_SET;
  if (hasFieldOfView) {
    return makeError(v1::ERROR_BAD_CAMERA,
                     "intrinsics: give only one of intrinsics, fov_y and height_y", "intrinsics");
  }
  const v1::Intrinsics& given = request.intrinsics();
  camera.pinhole = render::Pinhole{given.fx(), given.fy(), given.cx(), given.cy()};
  return std::nullopt;
}

/// Applies the requested lens to the camera, after its intrinsics.
std::optional<v1::Error> applyLens(render::Camera& camera, const v1::FrameRequest& request) {
  if (!request.has_lens()) return std::nullopt;
  using Kind = render::Camera::Lens::Kind;
  const v1::Lens& given = request.lens();
  if (given.kind_case() == v1::Lens::KIND_NOT_SET)
    return makeError(v1::ERROR_BAD_CAMERA, "lens: give fisheye or equirectangular", "lens.kind");
  if (request.renderer() == v1::RENDERER_GL)
    return makeError(v1::ERROR_BAD_CAMERA,
                     "lens: OpenGL draws none: leave renderer out, or give rays", "lens");
  const bool hasFieldOfView =
      request.has_eyes() ? request.eyes().has_fov_y()
                         : request.free().projection_case() != v1::FreeCamera::PROJECTION_NOT_SET;
  if (hasFieldOfView)
    return makeError(v1::ERROR_BAD_CAMERA,
                     "lens: leave fov_y and height_y out; a fisheye has intrinsics or a width",
                     "lens");
  const v1::Lens::Fisheye& fisheye = given.fisheye();
  camera.lens = render::Camera::Lens{given.has_fisheye() ? Kind::fisheye : Kind::equirectangular,
                                     {fisheye.k1(), fisheye.k2(), fisheye.k3(), fisheye.k4()}};
  if (fisheye.width() != 0) camera.lens->width = fisheye.width();
  return std::nullopt;
}

std::optional<v1::Error> validateNoise(const v1::FrameRequest& request) {
  const double scale = request.depth_noise().scale();
  if (!(scale >= 0 && scale <= 10))
    return makeError(v1::ERROR_BAD_MESSAGE, "scale: give 0 to 10", "depth_noise.scale");
  const std::string& table = request.depth_noise().distortion();
  const std::size_t rows = request.depth_noise().distortion_rows();
  const std::size_t rowBytes = sizeof(float) * render::kDistortionDepths * rows;
  const auto refuse = [](const std::string& remedy) {
    return makeError(v1::ERROR_BAD_MESSAGE, remedy, "depth_noise.distortion");
  };
  if (table.empty() != (rows == 0) || (rows > 0 && table.size() % rowBytes != 0))
    return refuse("distortion: give 5 numbers for each cell of a grid, and its distortion_rows");
  for (std::size_t at = 0; at < table.size(); at += sizeof(float)) {
    float factor = 0;
    std::memcpy(&factor, table.data() + at, sizeof factor);
    if (!(factor >= 0 && factor <= 100)) return refuse("distortion: give factors of 0 to 100");
  }
  return std::nullopt;
}

std::optional<v1::Error> validateEnums(const v1::FrameRequest& request) {
  const auto makeEnumError = [](const std::string& field, const char* values, int given) {
    return makeError(v1::ERROR_BAD_MESSAGE,
                     field + ": give " + values + ", not " + std::to_string(given), field);
  };
  if (!v1::Glass_IsValid(request.glass()))
    return makeEnumError("glass", "clear or solid", request.glass());
  if (!v1::Renderer_IsValid(request.renderer()))
    return makeEnumError("renderer", "gl or rays", request.renderer());
  if (!v1::Encoding_IsValid(request.rgb_encoding()))
    return makeEnumError("rgb_encoding", "raw, png or jpeg", request.rgb_encoding());
  return std::nullopt;
}

/// Rejects frames that exceed the message size of the supplied clients before they are rendered.
std::optional<v1::Error> validateSize(const v1::FrameRequest& request) {
  constexpr std::uint64_t kMessageOverhead = 65536;
  const std::uint64_t maxBytes = protocol::kClientLimits.total - kMessageOverhead;
  const std::uint64_t bytes = computeBytesPerPixel(request) * request.width() * request.height();
  if (bytes <= maxBytes) return std::nullopt;
  return makeError(v1::ERROR_TOO_LARGE,
                   "channels: these need " + std::to_string(bytes) + " bytes of pixels, at most " +
                       std::to_string(maxBytes) + " fit a message; request fewer at a time",
                   "channels");
}

render::RendererKind rendererFromProto(const v1::FrameRequest& request) {
  if (request.renderer() == v1::RENDERER_GL) return render::RendererKind::gl;
  if (request.renderer() == v1::RENDERER_RAYS) return render::RendererKind::rays;
  return render::RendererKind::automatic;
}

}  // namespace

ViewOrError viewFromProto(const v1::FrameRequest& request, const scene::Snapshot& snapshot) {
  if (auto error = validateChannels(request)) return *error;
  if (auto error = validateEnums(request)) return *error;
  constexpr std::uint32_t kMaxSide = 4096;
  if (request.width() < 1 || request.width() > kMaxSide || request.height() < 1 ||
      request.height() > kMaxSide) {
    return makeError(v1::ERROR_BAD_CAMERA, "width and height: give 1 to 4096 pixels", "width");
  }
  if (auto error = validateSize(request)) return *error;
  if (auto error = validateNoise(request)) return *error;
  if (request.samples() != 0 && !render::isSampleCount(request.samples()))
    return makeError(v1::ERROR_BAD_MESSAGE,
                     std::string("samples: give ") + render::kSampleCounts + ", not " +
                         std::to_string(request.samples()),
                     "samples");
  const int width = static_cast<int>(request.width());
  const int height = static_cast<int>(request.height());
  ViewOrError view = makeError(v1::ERROR_BAD_CAMERA, "view is missing: give eyes or free", "view");
  if (request.has_eyes()) view = makeAvatarView(request.eyes(), snapshot, width, height);
  if (request.has_free()) view = makeFreeView(request.free(), snapshot, width, height);
  if (render::ViewRequest* frameView = std::get_if<render::ViewRequest>(&view)) {
    frameView->options.channels = channelsFromProto(request);
    if (request.glass() == v1::GLASS_SOLID)
      frameView->options.transparency = render::TransparencyMode::opaque;
    frameView->options.shadows = request.shadows();
    frameView->options.automaticShadows = !request.has_shadows();
    if (request.samples() != 0) frameView->options.samples = request.samples();
    if (request.collision_shapes()) frameView->options.avatars = render::AvatarForm::collision;
    frameView->renderer = rendererFromProto(request);
    if (auto error = applyIntrinsics(frameView->camera, request)) return *error;
    if (auto error = applyLens(frameView->camera, request)) return *error;
    if (const auto problem = render::validateCamera(frameView->camera)) {
      return makeError(v1::ERROR_BAD_CAMERA, *problem, fieldFromRefusal(*problem));
    }
  }
  return view;
}

bool hasFlow(const v1::FrameRequest& request) {
  return std::ranges::find(request.channels(), v1::CHANNEL_FLOW) != request.channels().end();
}

std::uint64_t computeBytesPerPixel(const v1::FrameRequest& request) {
  std::uint64_t bytes = request.channels().empty() ? 3 : 0;
  for (const int channel : request.channels()) {
    if (channel == v1::CHANNEL_NORMALS)
      bytes += 12;
    else if (channel == v1::CHANNEL_FLOW)
      bytes += 8;
    else
      bytes += channel == v1::CHANNEL_RGB ? 3 : 4;
  }
  return bytes;
}

std::variant<EarlierView, v1::Error> earlierViewFromProto(
    const v1::FrameRequest& request, const std::shared_ptr<const scene::Snapshot>& snapshot) {
  v1::FrameRequest then = request;
  if (request.has_eyes() && request.has_flow_forward())
    *then.mutable_eyes()->mutable_forward() = request.flow_forward();
  auto view = viewFromProto(then, *snapshot);
  if (auto* error = std::get_if<v1::Error>(&view)) return std::move(*error);
  const render::Camera& camera = std::get<render::ViewRequest>(view).camera;
  if (camera.lens || camera.projection != render::Camera::Projection::perspective)
    return makeError(v1::ERROR_BAD_CAMERA,
                     "channels: flow is only for perspective pictures without a lens", "channels");
  return EarlierView{snapshot, camera};
}

v1::FrameRequest makeRecordedViewRequest(const std::string& avatar) {
  constexpr std::uint32_t kWidth = 640, kHeight = 360;
  v1::FrameRequest request;
  request.mutable_eyes()->set_avatar(avatar);
  request.set_width(kWidth);
  request.set_height(kHeight);
  request.add_channels(v1::CHANNEL_RGB);
  request.set_rgb_encoding(v1::ENCODING_JPEG);
  return request;
}

v1::FreeCamera toProto(const render::Camera& camera) {
  v1::FreeCamera message;
  *message.mutable_eye() = toProto(camera.eye);
  *message.mutable_forward() = toProto(camera.forward);
  *message.mutable_up() = toProto(camera.up);
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
