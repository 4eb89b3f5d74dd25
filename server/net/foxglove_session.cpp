#include "server/net/foxglove_session.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <cmath>
#include <set>

#include "collision/assert.hpp"
#include "protocol/foxglove.pb.h"
#include "protocol/recording/recording.hpp"
#include "server/base/version.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/log/log.hpp"
#include "server/messages/decode_message.hpp"
#include "server/messages/frame_encoding.hpp"
#include "server/net/tcp_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
namespace wire = foxglove_protocol;
using boost::system::error_code;

namespace {

constexpr std::size_t kMaxClientBytes = 64u << 10;  // of one message
constexpr std::size_t kMaxSubscriptions = 256;
constexpr std::size_t kMaxWaitingMessages = 256;  // answers that the viewer has not read
constexpr double kViewRate = 10;                  // pictures per second of simulated time

/// Ids of the channels that each world has; views follow.
std::uint32_t toId(ViewerChannel channel) {
  return static_cast<std::uint32_t>(channel);
}
constexpr std::uint32_t kFirstViewChannel = 16;

template <class Message>
wire::Channel describeChannel(std::uint32_t id, const std::string& topic) {
  const auto& descriptor = *Message::descriptor();
  return {id, topic, descriptor.full_name(), protocol::serializeSchema(descriptor)};
}

std::vector<wire::Channel> makeWorldChannels() {
  return {
      describeChannel<foxglove::FrameTransforms>(toId(ViewerChannel::transforms), kTransformTopic),
      describeChannel<foxglove::SceneUpdate>(toId(ViewerChannel::scene), kSceneTopic),
      describeChannel<v1::State>(toId(ViewerChannel::state), protocol::kStateTopic),
      describeChannel<v1::TickEvents>(toId(ViewerChannel::events), protocol::kEventsTopic)};
}

wire::TimeRange makeTimeRange(const v1::Replay& replay, double tickSeconds) {
  return {protocol::toNanoseconds(static_cast<double>(replay.first_tick()) * tickSeconds),
          protocol::toNanoseconds(static_cast<double>(replay.last_tick()) * tickSeconds)};
}

std::uint64_t findTick(const v1::Replay& replay, std::uint64_t nanoseconds, double tickSeconds) {
  const double tick = std::round(static_cast<double>(nanoseconds) * 1e-9 / tickSeconds);
  return static_cast<std::uint64_t>(std::clamp(tick, static_cast<double>(replay.first_tick()),
                                               static_cast<double>(replay.last_tick())));
}

v1::ClientMessage makeClockRequest(bool play, float speed) {
  v1::ClientMessage message;
  if (play)
    message.mutable_set_clock()->mutable_free_run()->set_speed(static_cast<double>(speed));
  else
    message.mutable_set_clock()->mutable_pause();
  return message;
}

/// Names of the avatars, as ViewerFeed joins them.
std::set<std::string> splitNames(const std::string& names) {
  std::set<std::string> split;
  for (std::size_t start = 0; start < names.size();) {
    const std::size_t end = std::min(names.find('\n', start), names.size());
    split.insert(names.substr(start, end - start));
    start = end + 1;
  }
  return split;
}

}  // namespace

FoxgloveSession::FoxgloveSession(asio::ip::tcp::socket socket, Request request,
                                 std::string subprotocol, ServerContext& context,
                                 std::shared_ptr<TickLoop> world, Role role)
    : stream_(std::move(socket)),
      request_(std::move(request)),
      subprotocol_(std::move(subprotocol)),
      context_(context),
      peer_(formatPeerAddress(stream_.next_layer()) + " by " + subprotocol_),
      world_(std::move(world)),
      role_(role),
      nextViewChannel_(kFirstViewChannel) {
  stream_.read_message_max(kMaxClientBytes);
  stream_.auto_fragment(false);
  // Pings; a viewer that vanished is noticed within the idle timeout.
  stream_.set_option(websocket::stream_base::timeout::suggested(boost::beast::role_type::server));
  stream_.set_option(websocket::stream_base::decorator(
      [chosen = subprotocol_](websocket::response_type& response) {
        response.set(boost::beast::http::field::server, std::string("enfilade ") + kServerVersion);
        response.set(boost::beast::http::field::sec_websocket_protocol, chosen);
      }));
}

void FoxgloveSession::start() {
  stream_.async_accept(request_, [self = shared_from_this()](error_code problem) {
    if (problem || self->closed_) return self->close(problem.message());
    self->accepted_ = true;
    self->join();
    self->read();
  });
}

void FoxgloveSession::join() {
  const auto wake = [weak = weak_from_this(), executor = stream_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) self->sendNext();
    });
  };
  const OutgoingLimits queueLimits = makeOutgoingLimits(context_);
  const Buffer tooSlow =
      encodeBye(makeBye(v1::ERROR_TOO_SLOW, "the viewer does not read its messages in time"));
  replies_ = std::make_shared<OutgoingQueue>(queueLimits, tooSlow, wake);
  feed_ = std::make_shared<OutgoingQueue>(queueLimits, tooSlow, wake);
  client_ = world_->join("foxglove", role_, replies_, ++lastRequest_);
  if (client_ == 0) return end(v1::ERROR_WORLD_DROPPED, "the world has ended");
  world_->post([id = client_, feed = feed_](HostedWorld& hosted) {
    if (hosted.clients.contains(id))
      hosted.viewers.try_emplace(id, feed).first->second.select({}, hosted.world,
                                                                hosted.activeContacts);
  });
  logInfo("{} entered world '{}'", peer_, world_->identity().name);
}

// ---- receive -----------------------------------------------------------------------------------

void FoxgloveSession::read() {
  if (closed_) return;
  in_.clear();
  stream_.async_read(in_, [self = shared_from_this()](error_code problem, std::size_t) {
    if (problem) return self->close(problem.message());
    const auto data = self->in_.cdata();
    const auto* bytes = static_cast<const std::uint8_t*>(data.data());
    self->handle(self->stream_.got_text()
                     ? wire::parseText({static_cast<const char*>(data.data()), data.size()})
                     : wire::parseBinary({bytes, data.size()}));
    if (self->outgoing_.size() > kMaxWaitingMessages)
      return self->close("it does not read the answers to its requests");
    self->sendNext();
    self->read();
  });
}

void FoxgloveSession::handle(wire::ClientRequest request) {
  if (ending_) return;
  if (const auto* one = std::get_if<wire::Subscribe>(&request)) return subscribe(*one);
  if (const auto* one = std::get_if<wire::Unsubscribe>(&request)) return unsubscribe(*one);
  if (const auto* one = std::get_if<wire::PlaybackControl>(&request)) return controlPlayback(*one);
  sendStatus(wire::StatusLevel::warning, std::get<wire::Refused>(request).reason);
}

void FoxgloveSession::subscribe(const wire::Subscribe& request) {
  const bool hadScene = isSubscribed(toId(ViewerChannel::scene));
  std::string problem;
  for (const auto& wanted : request.subscriptions) {
    const std::uint32_t channel = wanted.channel;
    const bool exists =
        (channel >= toId(ViewerChannel::transforms) && channel <= toId(ViewerChannel::events)) ||
        std::any_of(views_.begin(), views_.end(),
                    [&](const auto& view) { return channel - view.second.imageChannel <= 1; });
    const std::string name = std::to_string(channel);
    if (!exists)
      problem = "there is no channel " + name;
    else if (isSubscribed(channel))
      problem = "channel " + name + " has a subscription already";
    else if (subscriptions_.size() == kMaxSubscriptions)
      problem = "at most " + std::to_string(kMaxSubscriptions) + " subscriptions";
    else
      subscriptions_[channel] = wanted.subscription;
  }
  if (!problem.empty()) sendStatus(wire::StatusLevel::warning, "subscribe: " + problem);
  applySubscriptions(!hadScene && isSubscribed(toId(ViewerChannel::scene)));
}

void FoxgloveSession::unsubscribe(const wire::Unsubscribe& request) {
  for (const std::uint32_t subscription : request.subscriptions)
    std::erase_if(subscriptions_, [&](const auto& one) { return one.second == subscription; });
  applySubscriptions(false);
}

void FoxgloveSession::applySubscriptions(bool sceneIsNew) {
  std::set<ViewerChannel> channels;
  for (const ViewerChannel channel : {ViewerChannel::transforms, ViewerChannel::scene,
                                      ViewerChannel::state, ViewerChannel::events})
    if (isSubscribed(toId(channel))) channels.insert(channel);
  world_->post([id = client_, channels](HostedWorld& hosted) {
    const auto viewer = hosted.viewers.find(id);
    if (viewer != hosted.viewers.end())
      viewer->second.select(channels, hosted.world, hosted.activeContacts);
  });
  if (sceneIsNew) requestSceneModel();
  for (auto& [avatar, view] : views_) applyViewSubscription(avatar, view);
}

/// Starts or ends the pictures of an avatar's view.
void FoxgloveSession::applyViewSubscription(const std::string& avatar, ViewChannels& view) {
  const bool wanted = isSubscribed(view.imageChannel) || isSubscribed(view.imageChannel + 1);
  if (wanted == (view.watch != 0)) return;
  v1::ClientMessage message;
  v1::WatchFrames& watch = *message.mutable_watch_frames();
  if (wanted) {
    std::uint32_t number = 1;  // the first that is free
    while (std::any_of(views_.begin(), views_.end(),
                       [&](const auto& other) { return other.second.watch == number; }))
      ++number;
    view.watch = number;
    *watch.mutable_frame() = makeRecordedViewRequest(avatar);
    watch.set_rate(kViewRate);
  }
  watch.set_watch(view.watch);
  if (!wanted) view.watch = 0;
  request(std::move(message));
}

void FoxgloveSession::requestSceneModel() {
  context_.worlds.getSceneFile(*world_).request(
      SceneFileKind::viewerScene,
      [weak = weak_from_this(), executor = stream_.get_executor()](const SceneFile& file) {
        asio::post(executor, [weak, file] {
          const auto self = weak.lock();
          if (!self) return;
          if (file.bytes)
            self->sendOnChannel(toId(ViewerChannel::scene), self->now_, file.bytes);
          else
            self->sendStatus(wire::StatusLevel::error, "no model of the scene: " + file.error);
          self->sendNext();
        });
      });
}

/// A seek needs the clock: it is paused before, and continues as requested.
void FoxgloveSession::controlPlayback(const wire::PlaybackControl& control) {
  if (!replay_) return sendStatus(wire::StatusLevel::error, "this world does not play a recording");
  if (control.seekTo) {
    request(makeClockRequest(false, control.speed));
    v1::ClientMessage seek;
    seek.mutable_seek()->set_tick(findTick(*replay_, *control.seekTo, tickSeconds_));
    request(std::move(seek));
  }
  awaitedRequest_ = request(makeClockRequest(control.play, control.speed));
  awaitedPlaybackId_ = control.requestId;
}

std::uint64_t FoxgloveSession::request(v1::ClientMessage message) {
  message.set_request_id(++lastRequest_);
  world_->receive(client_, std::move(message), {});
  return lastRequest_;
}

// ---- replies of the world ----------------------------------------------------------------------

void FoxgloveSession::handleReply(const v1::ServerMessage& message,
                                  std::span<const std::uint8_t> attachment) {
  if (message.has_welcome()) greet(message.welcome());
  if (message.has_frame()) sendImages(message.frame(), attachment);
  if (message.has_error()) sendStatus(wire::StatusLevel::error, message.error().message());
  if (message.has_replay()) replay_ = message.replay();
  if (message.has_set_clock() && replay_) *replay_->mutable_clock() = message.set_clock().clock();
  if (message.has_seek()) now_ = protocol::toNanoseconds(message.seek().time());
  const bool awaited = message.reply_to() != 0 && message.reply_to() == awaitedRequest_;
  if (awaited) sendPlaybackState(awaitedPlaybackId_);
  if (message.has_replay() && message.reply_to() == 0) sendPlaybackState("");
  if (message.has_bye()) end(message.bye().code(), message.bye().reason());
}

void FoxgloveSession::greet(const v1::Welcome& welcome) {
  tickSeconds_ = welcome.policies().tick();
  now_ = protocol::toNanoseconds(static_cast<double>(welcome.tick()) * tickSeconds_);
  wire::ServerInfo info;
  info.name = "enfilade " + std::string(kServerVersion) + ": " + welcome.scene().source();
  info.world = welcome.world();
  info.scene = welcome.scene().source();
  info.sessionId = std::to_string(std::chrono::system_clock::now().time_since_epoch().count());
  if (welcome.has_replay()) {
    replay_ = welcome.replay();
    info.playback = makeTimeRange(*replay_, tickSeconds_);
  }
  sendText(wire::makeServerInfo(info));
  sendText(wire::makeAdvertisement(makeWorldChannels()));
  if (replay_) sendPlaybackState("");
}

/// Advertises the views of new avatars, and withdraws those of avatars that left.
void FoxgloveSession::updateAvatars(const std::string& names) {
  const std::set<std::string> present = splitNames(names);
  std::vector<wire::Channel> added;
  std::vector<std::uint32_t> removed;
  for (auto view = views_.begin(); view != views_.end();) {
    if (present.contains(view->first)) {
      ++view;
      continue;
    }
    for (const std::uint32_t channel : {view->second.imageChannel, view->second.imageChannel + 1}) {
      subscriptions_.erase(channel);
      removed.push_back(channel);
    }
    applyViewSubscription(view->first, view->second);
    view = views_.erase(view);
  }
  for (const std::string& avatar : present) {
    if (views_.contains(avatar)) continue;
    views_[avatar].imageChannel = nextViewChannel_;
    added.push_back(
        describeChannel<foxglove::CompressedImage>(nextViewChannel_, makeImageTopic(avatar)));
    added.push_back(describeChannel<foxglove::CameraCalibration>(nextViewChannel_ + 1,
                                                                 makeCalibrationTopic(avatar)));
    nextViewChannel_ += 2;
  }
  if (!removed.empty()) sendText(wire::makeUnadvertisement(removed));
  if (!added.empty()) sendText(wire::makeAdvertisement(added));
}

void FoxgloveSession::sendImages(const v1::Frame& frame, std::span<const std::uint8_t> attachment) {
  const auto found = std::find_if(views_.begin(), views_.end(), [&](const auto& view) {
    return view.second.watch != 0 && view.second.watch == frame.watch();
  });
  if (found == views_.end()) return;
  const std::string& avatar = found->first;
  const ViewChannels& view = found->second;
  const auto image = extractImage(frame, attachment);
  if (!image) return;
  ViewerSink sink;
  sink.stampTime = [](double time) { return time; };
  sink.write = [&, imageTopic = makeImageTopic(avatar)](const std::string& topic, double time,
                                                        const google::protobuf::Message& message) {
    std::vector<std::uint8_t> bytes(message.ByteSizeLong());
    message.SerializeWithCachedSizesToArray(bytes.data());
    sendOnChannel(view.imageChannel + (topic == imageTopic ? 0 : 1), protocol::toNanoseconds(time),
                  std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes)));
  };
  ViewerChannels(sink, StaticObjects::none).writeImage(avatar, frame, *image);
}

/// Forwards a message of the ViewerFeed.
void FoxgloveSession::forward(const ViewerMessage& message) {
  now_ = message.nanoseconds;
  if (message.channel == ViewerChannel::clock) return sendBytes(wire::makeTime(now_));
  if (message.channel == ViewerChannel::avatars)
    return updateAvatars({message.payload->begin(), message.payload->end()});
  sendOnChannel(toId(message.channel), message.nanoseconds, message.payload);
}

// ---- send --------------------------------------------------------------------------------------

void FoxgloveSession::sendPlaybackState(const std::string& requestId) {
  ENFILADE_ASSERT(replay_);
  using Status = wire::PlaybackStatus;
  const bool playing = replay_->clock().mode() == v1::Clock::MODE_FREE_RUN;
  wire::PlaybackState state;
  state.status = replay_->at_end() ? Status::ended : playing ? Status::playing : Status::paused;
  state.nanoseconds = now_;
  state.speed = playing ? static_cast<float>(replay_->clock().speed()) : 1;
  state.requestId = requestId;
  sendBytes(wire::makePlaybackState(state));
}

void FoxgloveSession::sendStatus(wire::StatusLevel level, const std::string& message) {
  sendText(wire::makeStatus(level, message));
}

void FoxgloveSession::sendText(const std::string& text) {
  outgoing_.push_back(
      {true, {std::make_shared<const std::vector<std::uint8_t>>(text.begin(), text.end())}});
}

void FoxgloveSession::sendBytes(std::vector<std::uint8_t> head, Buffer payload) {
  outgoing_.push_back(
      {false,
       {std::make_shared<const std::vector<std::uint8_t>>(std::move(head)), std::move(payload)}});
}

void FoxgloveSession::sendOnChannel(std::uint32_t channel, std::uint64_t nanoseconds,
                                    Buffer payload) {
  const auto found = subscriptions_.find(channel);
  if (found != subscriptions_.end())
    sendBytes(wire::makeMessageHeader(found->second, nanoseconds), std::move(payload));
}

/// Handles one waiting reply of the world, or one message of the feed. Returns whether there was
/// one.
bool FoxgloveSession::takeReplies() {
  if (client_ == 0) return false;
  const OutgoingQueue::Next reply = replies_->pop();
  if (reply.message) {
    if (const auto decoded = decodeMessage(reply.message))
      handleReply(decoded->message, decoded->attachment);
    return true;
  }
  if (tickSeconds_ == 0) return false;  // the server's greeting comes first
  const OutgoingQueue::Next next = feed_->pop();
  if (!next.message) return false;
  if (next.last)
    end(v1::ERROR_TOO_SLOW, "the viewer does not read its messages in time");
  else if (const auto message = decodeViewerMessage(next.message))
    forward(*message);
  return true;
}

void FoxgloveSession::sendNext() {
  if (closed_ || writing_) return;
  while (outgoing_.empty() && !ending_ && takeReplies()) {
  }
  if (outgoing_.empty()) {
    if (ending_) close("the connection ends");
    return;
  }
  Outgoing next = std::move(outgoing_.front());
  outgoing_.pop_front();
  write(std::move(next));
}

void FoxgloveSession::write(Outgoing message) {
  writing_ = true;
  stream_.text(message.isText);
  const auto pieces = makeBuffers(message.bytes);
  stream_.async_write(pieces, [self = shared_from_this(), message = std::move(message)](
                                  error_code problem, std::size_t) {
    self->writing_ = false;
    if (problem) return self->close(problem.message());
    self->sendNext();
  });
}

/// Sends the reason after what waits, then closes.
void FoxgloveSession::end(v1::ErrorCode code, const std::string& reason) {
  if (ending_ || closed_) return;
  ending_ = true;
  if (!accepted_ || code == v1::ERROR_TOO_SLOW) return close(reason);
  sendStatus(wire::StatusLevel::error, reason);
  sendNext();
}

void FoxgloveSession::close(const std::string& reason) {
  if (closed_) return;
  closed_ = true;
  logInfo("{} left: {}", peer_, reason);
  if (client_ != 0) world_->leave(client_);
  if (accepted_ && ending_ && stream_.is_open() && !writing_) {
    stream_.async_close(websocket::close_code::going_away,
                        [self = shared_from_this()](error_code) {});
    return;
  }
  error_code ignored;
  stream_.next_layer().close(ignored);
}

}  // namespace enfilade::server
