// Queries about the last tick, names of entities, and metrics.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

// The query service replies to these.

void handleRays(const RequestContext& context, const v1::RayQuery& query);
void handleNavigation(const RequestContext& context, const v1::NavigationQuery& query);
void handleDistances(const RequestContext& context, const v1::DistanceQuery& query);
void handleTouching(const RequestContext& context, const v1::TouchingQuery& query);
void handleCannotTouch(const RequestContext& context, const v1::CannotTouchQuery& query);

void handleDescribe(const RequestContext& context, const v1::DescribeEntities& request);
void handleMetrics(const RequestContext& context);

}  // namespace enfilade::server
