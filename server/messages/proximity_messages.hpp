// Answers proximity queries of clients (distances, touching, cannot_touch) from a snapshot.
#pragma once

#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/queries/time_to_contact_query.hpp"
#include "server/base/server_limits.hpp"

namespace enfilade::server {

// Each function returns the reply, or an error that names the field of the query.

std::variant<v1::DistanceReply, v1::Error> answerDistances(const v1::DistanceQuery& query,
                                                           const scene::SceneAt& sceneAt,
                                                           const ServerLimits& limits);
std::variant<v1::TouchingReply, v1::Error> answerTouching(const v1::TouchingQuery& query,
                                                          const scene::SceneAt& sceneAt,
                                                          const scene::WorldSettings& settings,
                                                          const ServerLimits& limits);
std::variant<v1::CannotTouchReply, v1::Error> answerCannotTouch(
    const v1::CannotTouchQuery& query, const scene::SceneAt& sceneAt,
    const scene::WorldSettings& settings);

}  // namespace enfilade::server
