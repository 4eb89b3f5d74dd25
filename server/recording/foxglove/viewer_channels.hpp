// Channels for recording viewers (Foxglove, Lichtblick) in standard schemas: transforms (/tf),
// geometry and contacts (/scene), images (/frames/NAME/...).
#pragma once

#include <map>

#include "protocol/recording/recording.hpp"
#include "scene/world/world.hpp"
#include "server/messages/frame_messages.hpp"

namespace enfilade::server {

/// Frames: `map` is the root (Z up, the viewers' convention). `scene` is the scene's frame (Y up,
/// metres). `avatar/NAME` is at the foot position; `eyes/NAME` is the camera (x right, y down, z
/// forward). `body/NAME` moves with a body. All functions throw protocol::mcap::RecordingError.
class ViewerChannels {
 public:
  explicit ViewerChannels(protocol::RecordingWriter& file) : file_(file) {}

  /// Writes the root transform, the static objects and the bodies; call it at the start of a run.
  /// Static objects are triangles if there are few, otherwise AABBs.
  void writeScene(const scene::World& world);
  /// Call it after a tick. Writes contact changes every tick, everything else ten times a second.
  void writeTick(const scene::World& world, const v1::TickEvents& events);
  /// Writes contact changes that happen without a tick.
  void writeEvents(const v1::TickEvents& events);
  /// Writes an image of `avatar`'s view with its calibration.
  void writeImage(const std::string& avatar, const v1::Frame& description,
                  const EncodedImage& encodedImage);

 private:
  void writeTransforms(const scene::World& world, bool includeStatic);
  void writeAvatars(const scene::World& world);
  void writeContacts(const v1::TickEvents& events);

  protocol::RecordingWriter& file_;
  double nextTransformTime_ = 0;  ///< seconds: time of the next transforms
  /// Shapes of the displayed avatars, by name.
  std::map<std::string, std::shared_ptr<const scene::AvatarShape>> shownShapes_;
};

}  // namespace enfilade::server
