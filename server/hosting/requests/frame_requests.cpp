#include "server/hosting/requests/frame_requests.hpp"

#include "server/hosting/frame_subscriptions.hpp"

namespace enfilade::server {

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
  FrameJob job{snapshot,
               std::get<FrameView>(view),
               request,
               context.client.out,
               context.message.request_id(),
               0,
               0,
               hosted.renderedFrames};
  job.onRendered = makeRecordingObserver(hosted, request);
  hosted.frames.renderFrame(std::move(job), deferReply(context, &OutgoingQueue::pushFrame));
}

}  // namespace enfilade::server
