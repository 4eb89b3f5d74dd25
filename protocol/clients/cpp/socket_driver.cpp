#include "protocol/clients/cpp/socket_driver.hpp"

#include <iterator>
#include <utility>

namespace enfilade::protocol {

SocketDriver::SocketDriver(Client& client, CaptureFormat format)
    : client_(client), format_(std::move(format)) {
  v1::SetClock clock;
  clock.mutable_lockstep();
  client_.setClock(clock);
  v1::Subscribe subscription;
  subscription.set_contacts(true);
  subscription.set_near_misses(true);
  subscription.set_notices(true);
  client_.subscribe(subscription);
}

double SocketDriver::tickSeconds() const {
  return client_.welcome().policies().tick();
}

std::optional<v1::Error> SocketDriver::submit(const v1::Command& command) {
  auto error = client_.command(command);
  if (!error) avatars_.insert(command.avatar());
  return error;
}

std::optional<v1::Error> SocketDriver::submit(const v1::BodyCommand& command) {
  return client_.bodyCommand(command);
}

/// True for contacts of this script's avatars and for contacts between bodies. Other clients'
/// avatars may be in the same world.
bool SocketDriver::concerns(const v1::ContactEvent& contact) const {
  const auto isAvatar = [&](std::uint32_t id) { return id > client_.welcome().scene().objects(); };
  const bool a = isAvatar(contact.a()), b = isAvatar(contact.b());
  if (!a && !b) return true;
  return (a && avatars_.contains(contact.a_name())) || (b && avatars_.contains(contact.b_name()));
}

StepOutcome SocketDriver::step() {
  v1::StepReply reply = client_.step(1, true);
  StepOutcome outcome;
  outcome.tick = reply.tick();
  outcome.time = reply.time();
  outcome.stateHash = reply.state_hash();
  outcome.idle = reply.idle();
  outcome.avatars.assign(std::make_move_iterator(reply.mutable_avatars()->begin()),
                         std::make_move_iterator(reply.mutable_avatars()->end()));
  for (v1::ServerMessage& message : client_.takeEvents()) {
    if (!message.has_events()) continue;
    for (v1::ContactEvent& contact : *message.mutable_events()->mutable_contacts()) {
      if (concerns(contact)) outcome.contacts.push_back(std::move(contact));
    }
    for (v1::Notice& notice : *message.mutable_events()->mutable_notices()) {
      if (avatars_.contains(notice.avatar())) outcome.notices.push_back(std::move(notice));
    }
  }
  for (const v1::Notice& notice : outcome.notices) {
    if (notice.kind() == v1::Notice::KIND_CAPTURE) {
      outcome.frames.push_back(captureFrame(notice, format_, [&](const v1::FrameRequest& request) {
        return client_.frame(request);
      }));
    }
  }
  return outcome;
}

v1::FrameRequest makeCaptureRequest(const v1::Notice& notice, const CaptureFormat& format) {
  v1::FrameRequest request;
  request.mutable_eyes()->set_avatar(notice.avatar());
  request.set_width(format.width);
  request.set_height(format.height);
  request.mutable_channels()->Assign(format.channels.begin(), format.channels.end());
  request.set_rgb_encoding(format.rgbEncoding);
  request.set_samples(format.samples);
  request.set_tick(notice.tick());
  return request;
}

CapturedFrame captureFrame(const v1::Notice& notice, const CaptureFormat& format,
                           const std::function<ReceivedFrame(const v1::FrameRequest&)>& frame) {
  CapturedFrame captured;
  captured.name = notice.text();
  captured.avatar = notice.avatar();
  captured.tag = notice.tag();
  try {
    ReceivedFrame received = frame(makeCaptureRequest(notice, format));
    captured.description = std::move(received.description);
    captured.pixels = std::move(received.pixels);
  } catch (const ProtocolError& problem) {
    captured.error = problem.what();
  }
  return captured;
}

}  // namespace enfilade::protocol
