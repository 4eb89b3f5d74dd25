// What the server does with a client's request.
#pragma once

#include <functional>

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Posts a job to the tick thread; callable from any thread.
using PostToTickThread = std::function<void(std::function<void(ServedWorld&)>)>;

v1::Welcome welcomeOf(const ServedWorld& served);

/// Answers what the client waits for, in order, until one of its requests has to wait for ticks or
/// for a picture.
void answerWaiting(ServedWorld& served, ClientId id, const PostToTickThread& post);

}  // namespace enfilade::server
