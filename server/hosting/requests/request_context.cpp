#include "server/hosting/requests/request_context.hpp"

#include "collision/assert.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

std::uint64_t getLastTick(const HostedWorld& hosted) {
  return hosted.world.snapshot()->tick;
}

std::optional<v1::Error> validateTick(const HostedWorld& hosted, std::uint64_t tick,
                                      const char* field) {
  const std::uint64_t last = getLastTick(hosted);
  if (tick == last) return std::nullopt;
  return makeError(v1::ERROR_TICK_GONE,
                   "the last tick is " + std::to_string(last) + ", not " + std::to_string(tick),
                   field);
}

void sendReply(const RequestContext& context, v1::ServerMessage message) {
  message.set_reply_to(context.message.request_id());
  sendMessage(context.client, message);
}

void replyError(const RequestContext& context, v1::Error error) {
  sendError(context.client, context.message.request_id(), std::move(error));
}

void replyError(const RequestContext& context, v1::ErrorCode code, std::string reason,
                std::string field) {
  replyError(context, makeError(code, std::move(reason), std::move(field)));
}

std::function<void(EncodedMessage)> deferReply(const RequestContext& context,
                                               void (OutgoingQueue::*deliver)(EncodedMessage)) {
  const PendingReply pendingReply{context.message.request_id()};
  ENFILADE_ASSERT(!context.client.pendingReply);
  context.client.pendingReply = pendingReply;
  return [out = context.client.out, id = context.clientId, post = context.hosted.post,
          resumeQueue = context.resumeQueue, deliver, pendingReply](EncodedMessage encoded) {
    if (!pendingReply.claim()) return;  // the world ended and has answered
    ((*out).*deliver)(std::move(encoded));
    post([id, resumeQueue](HostedWorld& current) {
      const auto client = current.clients.find(id);
      if (client == current.clients.end()) return;
      client->second.pendingReply.reset();
      resumeQueue(current, id);
    });
  };
}

std::function<void(double)> makeProgress(const RequestContext& context, bool isWanted) {
  if (!isWanted) return {};
  return [out = context.client.out, id = context.message.request_id(),
          last = 0](double share) mutable {
    const int percent = static_cast<int>(100 * share);
    if (percent == last) return;
    last = percent;
    v1::ServerMessage message;
    message.mutable_navigation_progress()->set_request_id(id);
    message.mutable_navigation_progress()->set_share(share);
    out->push(encodeShared(message));
  };
}

}  // namespace enfilade::server
