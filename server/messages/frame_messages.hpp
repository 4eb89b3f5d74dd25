// Conversion of frame requests to cameras, and of rendered frames to messages with attachments.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "render/renderer_kind.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// Where a flow channel begins.
struct EarlierView {
  std::shared_ptr<const scene::Snapshot> snapshot;
  render::Camera camera;
};

/// Returns the requested view, or an error that names the field.
std::variant<render::ViewRequest, v1::Error> viewFromProto(const v1::FrameRequest& request,
                                                           const scene::Snapshot& snapshot);
/// Returns the same view at an earlier tick, for the flow channel.
std::variant<EarlierView, v1::Error> earlierViewFromProto(
    const v1::FrameRequest& request, const std::shared_ptr<const scene::Snapshot>& snapshot);
bool hasFlow(const v1::FrameRequest& request);

/// What a message is made of in addition to its frame.
struct FrameSource {
  const v1::FrameRequest& request;
  const scene::Scene& scene;
  const scene::Snapshot& snapshot;
  const EarlierView* earlier = nullptr;  ///< for the flow channel
};

/// Appends the pixels to `attachment`.
v1::Frame toProto(const render::Frame& frame, const FrameSource& source,
                  std::vector<std::uint8_t>& attachment);

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
