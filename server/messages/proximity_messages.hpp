// Questions about pairs of entities as messages ask them, answered out of a snapshot.
#pragma once

#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/queries/time_to_contact_query.hpp"
#include "server/base/server_limits.hpp"

namespace enfilade::server {

// The answer, or what is wrong with the question, naming the field.

std::variant<v1::DistanceReply, v1::Error> answerOf(const v1::DistanceQuery& query,
                                                    const scene::SceneThen& then,
                                                    const ServerLimits& limits);
std::variant<v1::TouchingReply, v1::Error> answerOf(const v1::TouchingQuery& query,
                                                    const scene::SceneThen& then,
                                                    const scene::Lengths& lengths,
                                                    const ServerLimits& limits);
std::variant<v1::CannotTouchReply, v1::Error> answerOf(const v1::CannotTouchQuery& query,
                                                       const scene::SceneThen& then,
                                                       const scene::Lengths& lengths);

}  // namespace enfilade::server
