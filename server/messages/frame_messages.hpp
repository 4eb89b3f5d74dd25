// Requests for pictures as cameras, and pictures as messages with an attachment.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "render/service/renderer.hpp"

namespace enfilade::server {

/// What a picture is taken with: a camera that can be used, and what is wanted of the picture.
struct View {
  render::Camera camera;
  render::FrameOptions options;
  render::RendererKind renderer = render::RendererKind::automatic;
};

/// The view asked for, or why it cannot be had.
std::variant<View, v1::Error> viewFrom(const v1::FrameRequest& request,
                                       const scene::Snapshot& snapshot);

/// The message's attachment is appended to `attachment`. `time` is in seconds.
v1::Frame messageOf(const render::Frame& frame, double time, const v1::FrameRequest& request,
                    std::vector<std::uint8_t>& attachment);

/// What a recording shows of an avatar's view.
v1::FrameRequest recordedView(const std::string& avatar);

/// A picture as a file of its own would hold it.
struct EncodedPicture {
  std::string format;  ///< "jpeg", "png"
  std::vector<std::uint8_t> bytes;
};
/// The colours of a frame, as they are encoded or as JPEG; nullopt when it has none.
std::optional<EncodedPicture> encodedPicture(const v1::Frame& frame,
                                             std::span<const std::uint8_t> attachment);

/// The free camera that asks for the same picture.
v1::FreeCamera messageOf(const render::Camera& camera);

}  // namespace enfilade::server
