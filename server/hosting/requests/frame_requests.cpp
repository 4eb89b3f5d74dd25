#include "server/hosting/requests/frame_requests.hpp"

#include <algorithm>

#include "server/hosting/frame_subscriptions.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

std::variant<EarlierView, v1::Error> findEarlierView(const HostedWorld& hosted,
                                                     const v1::FrameRequest& request) {
  if (!request.has_flow_from())
    return makeError(v1::ERROR_BAD_MESSAGE, "flow_from is missing: give an earlier tick",
                     "frame.flow_from");
  const auto& kept = hosted.recentSnapshots;
  const auto found = std::ranges::find_if(
      kept, [&](const auto& snapshot) { return snapshot->tick == request.flow_from(); });
  if (found == kept.end())
    return makeError(v1::ERROR_TICK_GONE,
                     "tick " + std::to_string(request.flow_from()) + " is not among the last " +
                         std::to_string(kKeptSnapshots),
                     "frame.flow_from");
  auto view = earlierViewFromProto(request, *found);
  if (auto* error = std::get_if<v1::Error>(&view)) error->set_field("frame." + error->field());
  return view;
}

}  // namespace

void handleFrame(const RequestContext& context, const v1::FrameRequest& request) {
  HostedWorld& hosted = context.hosted;
  if (request.has_tick()) {
    if (auto error = validateTick(hosted, request.tick(), "frame.tick")) {
      return replyError(context, std::move(*error));
    }
  }
  if (hosted.frames.deviceName().empty()) {
    return replyError(context, v1::ERROR_NO_RENDERER, hosted.frames.unavailableReason());
  }
  const auto snapshot = hosted.world.snapshot();
  auto view = viewFromProto(request, *snapshot);
  if (auto* error = std::get_if<v1::Error>(&view)) {
    if (!error->field().empty()) error->set_field("frame." + error->field());
    return replyError(context, std::move(*error));
  }
  std::optional<EarlierView> earlier;
  if (hasFlow(request)) {
    auto found = findEarlierView(hosted, request);
    if (auto* error = std::get_if<v1::Error>(&found)) return replyError(context, std::move(*error));
    earlier = std::get<EarlierView>(std::move(found));
  }
  FrameJob job{snapshot,
               std::get<render::ViewRequest>(view),
               request,
               context.client.out,
               context.message.request_id(),
               0,
               0,
               hosted.renderedFrames};
  job.earlier = std::move(earlier);
  job.onRendered = makeRecordingObserver(hosted, request);
  hosted.frames.renderFrame(std::move(job), deferReply(context, &OutgoingQueue::pushFrame));
}

}  // namespace enfilade::server
