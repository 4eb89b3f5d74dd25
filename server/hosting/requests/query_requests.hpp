// Handles queries about the last tick, names of entities, and metrics.
#pragma once

#include <functional>
#include <utility>

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

/// Hands the request to the query service, with the state after the last tick.
void submitQuery(const RequestContext& context, std::function<void(double)> progress = {});

/// Forwards a query about the last tick to the query service.
template <class Query>
void forwardQuery(const RequestContext& context, const Query& query, const char* tickField,
                  std::function<void(double)> progress = {}) {
  if (query.has_tick()) {
    if (auto error = validateTick(context.hosted, query.tick(), tickField))
      return replyError(context, std::move(*error));
  }
  submitQuery(context, std::move(progress));
}

/// Forwards the query, or loads a mesh.
void handleNavigation(const RequestContext& context, const v1::NavigationQuery& query);

void handleDescribe(const RequestContext& context, const v1::DescribeEntities& request);
void handleMetrics(const RequestContext& context);

}  // namespace enfilade::server
