// Conversion of frame requests to views. frame_encoding encodes the rendered frames.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "protocol/enfilade.pb.h"
#include "render/renderer_kind.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// The earlier view from which a flow channel starts.
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
/// Size of the requested channels as raw pixels.
std::uint64_t computeBytesPerPixel(const v1::FrameRequest& request);

/// The frame request for an avatar's view in a recording.
v1::FrameRequest makeRecordedViewRequest(const std::string& avatar);

/// The free camera that reproduces the frame.
v1::FreeCamera toProto(const render::Camera& camera);

}  // namespace enfilade::server
