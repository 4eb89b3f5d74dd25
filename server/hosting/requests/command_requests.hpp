// Handles the requests Command (orders of avatars) and BodyCommand.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

/// Replies that the command is not accepted.
void refuseCommand(const RequestContext& context, v1::Error error);
void handleCommand(const RequestContext& context, const v1::Command& command);
void handleBodyCommand(const RequestContext& context, const v1::BodyCommand& command);

}  // namespace enfilade::server
