// Channels for viewers (Foxglove, Lichtblick) in standard schemas: transforms (/tf), geometry and
// contacts (/scene), images (/frames/NAME/...). They go to a recording, or live to a client.
#pragma once

#include <functional>
#include <map>

#include "scene/world/world.hpp"
#include "server/messages/frame_encoding.hpp"

namespace enfilade::server {

inline constexpr const char* kTransformTopic = "/tf";
inline constexpr const char* kSceneTopic = "/scene";

std::string makeImageTopic(const std::string& avatar);
std::string makeCalibrationTopic(const std::string& avatar);

/// Receives the messages.
struct ViewerSink {
  /// `time`: simulated time, seconds.
  std::function<void(const std::string& topic, double time, const google::protobuf::Message&)>
      write;
  /// Converts simulated time to the time stamps of messages, seconds.
  std::function<double(double)> stampTime;
};

/// The form in which viewers show the static objects.
enum class StaticObjects : std::uint8_t {
  asPrimitives,  ///< triangles if there are few, otherwise AABBs
  none           ///< the client has the scene as a model
};

/// Frames: `map` is the root (Z up, the viewers' convention). `scene` is the scene's frame (Y up,
/// metres). `avatar/NAME` is at the foot position; `eyes/NAME` is the camera (x right, y down, z
/// forward). `body/NAME` moves with a body. All functions throw what the sink throws.
class ViewerChannels {
 public:
  ViewerChannels(ViewerSink sink, StaticObjects staticObjects)
      : sink_(std::move(sink)), staticObjects_(staticObjects) {}

  /// Writes the root transform, the static objects and the bodies; call it at the start of a run.
  void writeScene(const scene::World& world);
  /// Writes all transforms and avatars again after the world was replaced.
  void writePresent(const scene::World& world);
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

  const ViewerSink sink_;
  const StaticObjects staticObjects_;
  double nextTransformTime_ = 0;  ///< seconds: time of the next transforms
  /// Shapes of the displayed avatars, by name.
  std::map<std::string, std::shared_ptr<const scene::AvatarShape>> shownShapes_;
};

}  // namespace enfilade::server
