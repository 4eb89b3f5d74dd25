// The live channels of one viewer (Foxglove): what a recording for viewers has, as the world ticks.
// Tick thread only; the messages leave through a queue.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "scene/world/world.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/recording/foxglove/viewer_channels.hpp"

namespace enfilade::server {

enum class ViewerChannel : std::uint32_t {
  clock,       ///< no payload: the time of the last tick
  avatars,     ///< payload: the names of all avatars, separated by '\n'
  transforms,  ///< /tf: foxglove.FrameTransforms
  scene,       ///< /scene: foxglove.SceneUpdate, without the static objects
  state,       ///< /enfilade/state: enfilade.v1.State
  events       ///< /enfilade/events: enfilade.v1.TickEvents
};

/// A message of the queue. Clock, transforms and state are latest-only.
struct ViewerMessage {
  ViewerChannel channel = ViewerChannel::clock;
  std::uint64_t nanoseconds = 0;  ///< simulated time
  Buffer payload;                 ///< may be null
};
EncodedMessage encodeViewerMessage(const ViewerMessage& message);
/// Null: the queue's final message.
std::optional<ViewerMessage> decodeViewerMessage(const EncodedMessage& message);

/// Contacts that are active now, as begin events.
using ActiveContacts = std::map<std::pair<scene::EntityId, scene::EntityId>, v1::ContactEvent>;

class ViewerFeed {
 public:
  explicit ViewerFeed(std::shared_ptr<OutgoingQueue> out);
  ViewerFeed(const ViewerFeed&) = delete;
  ViewerFeed& operator=(const ViewerFeed&) = delete;

  /// Sends these channels from now on, beginning with their present content. Clock and avatars are
  /// always sent.
  void select(std::set<ViewerChannel> channels, const scene::World& world,
              const ActiveContacts& contacts);
  void onTick(const scene::World& world, const v1::TickEvents& events);
  /// Events without a tick, as contacts that end because the world is reset.
  void onEvents(const v1::TickEvents& events);
  /// Call it after the world was replaced.
  void onReplaced(const scene::World& world, const ActiveContacts& contacts);

 private:
  void sendAvatars(const scene::World& world);
  void sendState(const scene::World& world);
  void sendEvents(const v1::TickEvents& events);
  void send(ViewerChannel channel, double time, const google::protobuf::Message& message);
  void push(const ViewerMessage& message);

  const std::shared_ptr<OutgoingQueue> out_;
  std::set<ViewerChannel> selected_;
  ViewerChannels channels_;
  std::string sentAvatars_ = "\n";  ///< no list of names equals this
};

}  // namespace enfilade::server
