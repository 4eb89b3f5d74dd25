// Handles FrameRequest: a client's request for a single frame.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

/// The frame service replies.
void handleFrame(const RequestContext& context, const v1::FrameRequest& request);

}  // namespace enfilade::server
