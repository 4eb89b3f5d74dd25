// Encoding of rendered frames as messages with attachments: PNG, JPEG, raw channels.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/messages/frame_messages.hpp"

namespace enfilade::server {

/// Inputs of a message in addition to its frame.
struct FrameSource {
  const v1::FrameRequest& request;
  const scene::Scene& scene;
  const scene::Snapshot& snapshot;
  const EarlierView* earlier = nullptr;  ///< for the flow channel
};

/// Encodes the requested channels as raw pixels, PNG or JPEG, and appends them to `attachment`.
v1::Frame encodeFrame(const render::Frame& frame, const FrameSource& source,
                      std::vector<std::uint8_t>& attachment);

/// A compressed image, as in an image file.
struct EncodedImage {
  std::string format;  ///< "jpeg", "png"
  std::vector<std::uint8_t> bytes;
};
/// The colour plane of a frame: JPEG or PNG as encoded, raw pixels as JPEG. nullopt: no colours.
std::optional<EncodedImage> extractImage(const v1::Frame& frame,
                                         std::span<const std::uint8_t> attachment);

}  // namespace enfilade::server
