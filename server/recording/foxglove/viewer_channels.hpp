// What viewers of recordings (Foxglove, Lichtblick) show without being taught: where everyone is
// (/tf), what all look like and who touches what (/scene), pictures (/frames/NAME/...).
#pragma once

#include <map>

#include "protocol/recording/recording.hpp"
#include "scene/world/world.hpp"
#include "server/messages/frame_messages.hpp"

namespace enfilade::server {

/// Frames: `map` (Z up, as viewers have it) is the root; `scene` is the scene's own frame, Y up,
/// metres; `avatar/NAME` stands at the feet, `eyes/NAME` looks (x right, y down, z ahead),
/// `body/NAME` goes with a body. All functions throw protocol::mcap::RecordingError.
class ViewerChannels {
 public:
  explicit ViewerChannels(protocol::RecordingWriter& file) : file_(file) {}

  /// At the world's beginning: the root and what stands still, of which triangles are written if
  /// there are few, else boxes.
  void begin(const scene::World& world);
  /// After a tick: contacts as they come and go, everything else ten times a second.
  void ticked(const scene::World& world, const v1::TickEvents& events);
  /// Without a tick.
  void told(const v1::TickEvents& events);
  /// A picture through the eyes of `avatar`.
  void picture(const std::string& avatar, const v1::Frame& description,
               const EncodedPicture& picture);

 private:
  void placeEveryone(const scene::World& world, bool all);
  void showAvatars(const scene::World& world);
  void showContacts(const v1::TickEvents& events);

  protocol::RecordingWriter& file_;
  double nextTime_ = 0;  ///< seconds: when everyone is placed again
  /// The shapes of the avatars that are shown, by name.
  std::map<std::string, std::shared_ptr<const scene::AvatarShape>> shown_;
};

}  // namespace enfilade::server
