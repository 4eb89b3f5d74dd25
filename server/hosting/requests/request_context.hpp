// A request that is being handled, and the ways to reply to it. Tick thread only.
#pragma once

#include <functional>

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// A request with its client and world.
struct RequestContext {
  HostedWorld& hosted;
  ClientId clientId;
  Client& client;
  const v1::ClientMessage& message;
  /// Handles the client's later requests after a deferred reply.
  void (*resumeQueue)(HostedWorld&, ClientId);
};

std::uint64_t getLastTick(const HostedWorld& hosted);

/// An error unless `tick` is the last tick. `field` is the request's field.
std::optional<v1::Error> validateTick(const HostedWorld& hosted, std::uint64_t tick,
                                      const char* field);

void sendReply(const RequestContext& context, v1::ServerMessage message);
void replyError(const RequestContext& context, v1::Error error);
void replyError(const RequestContext& context, v1::ErrorCode code, std::string reason,
                std::string field = {});

/// Defers the reply to a service; the client's later requests wait. The service calls the returned
/// function with the reply, on its own thread; `deliver` puts it into the client's queue.
std::function<void(EncodedMessage)> deferReply(
    const RequestContext& context,
    void (OutgoingQueue::*deliver)(EncodedMessage) = &OutgoingQueue::push);

/// Sends the share of navigation meshes to the client whenever its per cent changes; empty unless
/// the request wants it. May be called by one thread at a time.
std::function<void(double)> makeProgress(const RequestContext& context, bool isWanted);

}  // namespace enfilade::server
