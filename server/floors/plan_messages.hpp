// Floor plans as messages, and the answer to a request for one.
#pragma once

#include <variant>

#include "protocol/enfilade.pb.h"
#include "server/base/server_limits.hpp"
#include "server/floors/floor_plan.hpp"

namespace enfilade::server {

v1::FloorPlan toProto(const FloorPlan& plan);
FloorPlan floorPlanFromProto(const v1::FloorPlan& message);

/// Returns the plan, or an error: the height cannot be used, or the plan is too large for a reply.
std::variant<v1::FloorPlan, v1::Error> answerFloorPlan(const v1::FloorPlanRequest& request,
                                                       const FloorPlanSource& source,
                                                       const ServerLimits& limits);

}  // namespace enfilade::server
