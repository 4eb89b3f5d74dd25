#include "server/hosting/viewer_feed.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "protocol/recording/recording.hpp"
#include "server/recording/world_recorder.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kHeaderBytes = sizeof(std::uint32_t) + sizeof(std::uint64_t);

bool isLatestOnly(ViewerChannel channel) {
  switch (channel) {
    case ViewerChannel::clock:
    case ViewerChannel::transforms:
    case ViewerChannel::state:
      return true;
    case ViewerChannel::avatars:
    case ViewerChannel::scene:
    case ViewerChannel::events:
      return false;
  }
  throw std::logic_error("unknown channel of viewers");
}

ViewerChannel findChannel(const std::string& topic) {
  if (topic == kTransformTopic) return ViewerChannel::transforms;
  if (topic == kSceneTopic) return ViewerChannel::scene;
  throw std::logic_error("live viewers have no channel " + topic);
}

v1::TickEvents makeBeginEvents(const scene::World& world, const ActiveContacts& contacts) {
  v1::TickEvents events;
  events.set_tick(world.snapshot()->tick);
  events.set_time(world.snapshot()->time);
  for (const auto& [pair, contact] : contacts) *events.add_contacts() = contact;
  return events;
}

}  // namespace

EncodedMessage encodeViewerMessage(const ViewerMessage& message) {
  std::vector<std::uint8_t> header(kHeaderBytes);
  const auto channel = static_cast<std::uint32_t>(message.channel);
  std::memcpy(header.data(), &channel, sizeof channel);
  std::memcpy(header.data() + sizeof channel, &message.nanoseconds, sizeof message.nanoseconds);
  return {std::make_shared<const std::vector<std::uint8_t>>(std::move(header)), message.payload};
}

std::optional<ViewerMessage> decodeViewerMessage(const EncodedMessage& message) {
  if (message.head->size() != kHeaderBytes) return std::nullopt;
  std::uint32_t channel = 0;
  ViewerMessage decoded;
  std::memcpy(&channel, message.head->data(), sizeof channel);
  std::memcpy(&decoded.nanoseconds, message.head->data() + sizeof channel,
              sizeof decoded.nanoseconds);
  decoded.channel = static_cast<ViewerChannel>(channel);
  decoded.payload = message.body;
  return decoded;
}

ViewerFeed::ViewerFeed(std::shared_ptr<OutgoingQueue> out)
    : out_(std::move(out)),
      channels_(
          {[this](const std::string& topic, double time, const google::protobuf::Message& message) {
             send(findChannel(topic), time, message);
           },
           [](double time) { return time; }},
          StaticObjects::none) {}

void ViewerFeed::select(std::set<ViewerChannel> channels, const scene::World& world,
                        const ActiveContacts& contacts) {
  const std::set<ViewerChannel> before = std::exchange(selected_, {});
  // Channels that continue are not repeated.
  std::set_difference(channels.begin(), channels.end(), before.begin(), before.end(),
                      std::inserter(selected_, selected_.end()));
  channels_.writeScene(world);
  channels_.writePresent(world);
  const v1::TickEvents begun = makeBeginEvents(world, contacts);
  channels_.writeEvents(begun);
  sendEvents(begun);
  sendState(world);
  selected_ = std::move(channels);
  sendAvatars(world);
}

void ViewerFeed::onTick(const scene::World& world, const v1::TickEvents& events) {
  push({ViewerChannel::clock, protocol::toNanoseconds(world.snapshot()->time), nullptr});
  sendAvatars(world);
  channels_.writeTick(world, events);
  sendEvents(events);
  sendState(world);
}

void ViewerFeed::onEvents(const v1::TickEvents& events) {
  channels_.writeEvents(events);
  sendEvents(events);
}

void ViewerFeed::onReplaced(const scene::World& world, const ActiveContacts& contacts) {
  push({ViewerChannel::clock, protocol::toNanoseconds(world.snapshot()->time), nullptr});
  sendAvatars(world);
  channels_.writePresent(world);
  onEvents(makeBeginEvents(world, contacts));
  sendState(world);
}

void ViewerFeed::sendAvatars(const scene::World& world) {
  std::string names;
  for (const scene::AvatarSnapshot& avatar : world.snapshot()->avatars)
    names += (names.empty() ? "" : "\n") + avatar.name;
  if (names == sentAvatars_) return;
  push({ViewerChannel::avatars, protocol::toNanoseconds(world.snapshot()->time),
        std::make_shared<const std::vector<std::uint8_t>>(names.begin(), names.end())});
  sentAvatars_ = std::move(names);
}

void ViewerFeed::sendState(const scene::World& world) {
  if (!selected_.contains(ViewerChannel::state)) return;
  v1::State state;
  fillState(state, world);
  send(ViewerChannel::state, state.time(), state);
}

void ViewerFeed::sendEvents(const v1::TickEvents& events) {
  if (!events.contacts().empty() || !events.notices().empty())
    send(ViewerChannel::events, events.time(), events);
}

void ViewerFeed::send(ViewerChannel channel, double time,
                      const google::protobuf::Message& message) {
  if (!selected_.contains(channel)) return;
  std::vector<std::uint8_t> bytes(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(bytes.data());
  push({channel, protocol::toNanoseconds(time),
        std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes))});
}

void ViewerFeed::push(const ViewerMessage& message) {
  if (!isLatestOnly(message.channel)) return out_->push(encodeViewerMessage(message));
  const auto slot = static_cast<std::uint32_t>(message.channel);
  out_->dropLatest(slot);
  out_->pushLatest(encodeViewerMessage(message), slot);
}

}  // namespace enfilade::server
