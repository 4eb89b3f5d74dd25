// Queries about the last tick, names of entities, and metrics.
#pragma once

#include <functional>
#include <utility>

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

/// Forwards a query about the last tick to the query service.
template <class Query>
void forwardQuery(const RequestContext& context, const Query& query, const char* tickField,
                  std::function<void(double)> progress = {}) {
  HostedWorld& hosted = context.hosted;
  if (query.has_tick()) {
    if (auto error = validateTick(hosted, query.tick(), tickField))
      return replyError(context, std::move(*error));
  }
  hosted.queries.submit({hosted.world.snapshot(), context.message, hosted.world.settings(),
                         hosted.limits, std::move(progress)},
                        deferReply(context));
}

/// Forwards the query, or loads a mesh.
void handleNavigation(const RequestContext& context, const v1::NavigationQuery& query);

void handleDescribe(const RequestContext& context, const v1::DescribeEntities& request);
void handleMetrics(const RequestContext& context);

}  // namespace enfilade::server
