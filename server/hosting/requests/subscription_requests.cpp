#include "server/hosting/requests/subscription_requests.hpp"

#include "server/hosting/frame_subscriptions.hpp"
#include "server/hosting/horizon_subscriptions.hpp"
#include "server/hosting/tick_broadcast.hpp"

namespace enfilade::server {

void handleSubscribe(const RequestContext& context, const v1::Subscribe& subscription) {
  if (!(subscription.state_rate() >= 0 && subscription.state_rate() <= 1e6)) {
    return replyError(context, v1::ERROR_BAD_MESSAGE,
                      "subscribe.state_rate: give 0 to 1000000 per second", "subscribe.state_rate");
  }
  if (auto error = validateHorizons(context.hosted, context.client, subscription))
    return replyError(context, std::move(*error));
  changeHorizons(context.hosted, context.client, subscription);
  context.client.subscription = subscription;
  context.client.nextStateTime = 0;
  v1::ServerMessage message;
  message.mutable_subscribe()->set_tick(getLastTick(context.hosted));
  if (subscription.contacts()) {
    for (const auto& [pair, event] : context.hosted.activeContacts) {
      *message.mutable_subscribe()->add_live() = event;
    }
  }
  sendReply(context, std::move(message));
  // A client that joins a paused world learns at once where everything is.
  const v1::TickEvents noEvents;
  TickBroadcast present{noEvents};
  sendState(context.hosted, context.client, *context.hosted.world.snapshot(), present);
}

void handleWatchFrames(const RequestContext& context, const v1::WatchFrames& request) {
  if (auto error =
          updateFrameSubscription(context.hosted, context.clientId, context.client, request))
    return replyError(context, std::move(*error));
  v1::ServerMessage message;
  message.mutable_watch_frames()->set_tick(getLastTick(context.hosted));
  sendReply(context, std::move(message));
}

}  // namespace enfilade::server
