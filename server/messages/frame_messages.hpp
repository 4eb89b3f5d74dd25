// Conversion of frame requests to cameras, and of rendered frames to messages with attachments.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "render/renderer_kind.hpp"

namespace enfilade::server {

/// A validated camera with the options of the frame.
struct FrameView {
  render::Camera camera;
  render::FrameOptions options;
  render::RendererKind renderer = render::RendererKind::automatic;
};

/// Returns the requested view, or an error that names the field.
std::variant<FrameView, v1::Error> viewFromProto(const v1::FrameRequest& request,
                                                 const scene::Snapshot& snapshot);

/// Appends the pixels to `attachment`. `time` is the simulated time in seconds, `scene` that of the
/// frame.
v1::Frame toProto(const render::Frame& frame, double time, const v1::FrameRequest& request,
                  const scene::Scene& scene, std::vector<std::uint8_t>& attachment);

/// The frame request for an avatar's view in a recording.
v1::FrameRequest makeRecordedViewRequest(const std::string& avatar);

/// A compressed image, as in an image file.
struct EncodedImage {
  std::string format;  ///< "jpeg", "png"
  std::vector<std::uint8_t> bytes;
};
/// The colour plane of a frame: JPEG or PNG as encoded, raw pixels as JPEG. nullopt: no colours.
std::optional<EncodedImage> extractImage(const v1::Frame& frame,
                                         std::span<const std::uint8_t> attachment);

/// The free camera that reproduces the frame.
v1::FreeCamera toProto(const render::Camera& camera);

}  // namespace enfilade::server
