#include "server/hosting/frame_subscriptions.hpp"

#include <utility>

#include "collision/assert.hpp"
#include "server/messages/frame_encoding.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

void renderNext(HostedWorld& hosted, ClientId id, Client& client, std::uint32_t number,
                FrameSubscription& subscription);

/// Renders a frame and sends it, or its error (a lost device). The subscription becomes ready
/// before the frame is queued: a client that receives the frame and steps then gets the next one.
/// Two frames may therefore be unsent for a moment.
void renderAndPush(HostedWorld& hosted, ClientId id, std::uint32_t number, std::uint64_t generation,
                   const std::shared_ptr<OutgoingQueue>& out, FrameJob job) {
  const auto onRendered = [id, number, generation](HostedWorld& current) {
    const auto client = current.clients.find(id);
    if (client == current.clients.end()) return;
    const auto subscription = client->second.frameSubscriptions.find(number);
    if (subscription == client->second.frameSubscriptions.end() ||
        subscription->second.generation != generation)
      return;
    ENFILADE_ASSERT(subscription->second.rendering);
    FrameSubscription& done = subscription->second;
    done.rendering = false;
    const bool missed = std::exchange(done.missed, false);
    if (missed) --done.dropped;  // the next due frame must not count as dropped
    if (std::exchange(done.stale, false) || missed)
      renderNext(current, id, client->second, number, done);
  };
  hosted.frames.renderFrame(std::move(job),
                            [out, number, onRendered, post = hosted.post](EncodedMessage image) {
                              post(onRendered);
                              out->pushLatest(std::move(image), number);
                            });
}

/// Prefixes the field of a view's error with the path of the request.
v1::Error prefixErrorField(v1::Error error) {
  if (!error.field().empty()) error.set_field("watch_frames.frame." + error.field());
  return error;
}

/// Returns the start of the flow of the next picture: the last picture that the client gets. The
/// view follows the avatar: if the avatar did not exist then, all points are new.
std::variant<EarlierView, v1::Error> findFlowStart(
    FrameSubscription& subscription, bool isLastSent,
    const std::shared_ptr<const scene::Snapshot>& now) {
  if (isLastSent || !subscription.flowStart) subscription.flowStart = subscription.lastPicture;
  subscription.lastPicture = now;
  if (subscription.flowStart) {
    auto view = earlierViewFromProto(subscription.request, subscription.flowStart);
    if (std::holds_alternative<EarlierView>(view)) return view;
  }
  subscription.flowStart = now;
  return earlierViewFromProto(subscription.request, now);
}

void renderSubscription(HostedWorld& hosted, ClientId id, Client& client, std::uint32_t number,
                        FrameSubscription& subscription) {
  ENFILADE_ASSERT(!subscription.rendering && !subscription.stale);
  const auto snapshot = hosted.world.snapshot();
  auto view = viewFromProto(subscription.request, *snapshot);
  if (std::holds_alternative<v1::Error>(view)) return;
  const bool isLastSent = !client.out->dropLatest(number);
  if (!isLastSent) ++subscription.dropped;
  hosted.droppedFrames += subscription.dropped;
  subscription.rendering = true;
  FrameJob job{snapshot,
               std::get<render::ViewRequest>(std::move(view)),
               subscription.request,
               client.out,
               0,
               number,
               subscription.dropped,
               hosted.renderedFrames};
  subscription.dropped = 0;
  job.onRendered = makeRecordingObserver(hosted, subscription.request);
  if (hasFlow(subscription.request)) {
    auto earlier = findFlowStart(subscription, isLastSent, snapshot);
    if (std::holds_alternative<v1::Error>(earlier)) {
      subscription.rendering = false;  // no camera that has a flow: the request was refused
      return;
    }
    job.earlier = std::get<EarlierView>(std::move(earlier));
  }
  renderAndPush(hosted, id, number, subscription.generation, client.out, std::move(job));
}

void renderNext(HostedWorld& hosted, ClientId id, Client& client, std::uint32_t number,
                FrameSubscription& subscription) {
  const double now = hosted.world.snapshot()->time;
  subscription.nextTime = now + (subscription.rate > 0 ? 1 / subscription.rate : 0);
  renderSubscription(hosted, id, client, number, subscription);
}

}  // namespace

std::optional<v1::Error> updateFrameSubscription(HostedWorld& hosted, ClientId id, Client& client,
                                                 const v1::WatchFrames& request) {
  const std::uint32_t maxSubscriptions = hosted.limits.frameSubscriptions;
  if (request.watch() < 1 || request.watch() > maxSubscriptions) {
    return makeError(v1::ERROR_BAD_MESSAGE,
                     "watch: give a number from 1 to " + std::to_string(maxSubscriptions),
                     "watch_frames.watch");
  }
  if (!request.has_frame()) {
    client.frameSubscriptions.erase(request.watch());
    return std::nullopt;
  }
  if (!(request.rate() >= 0 && request.rate() <= 1e6)) {
    return makeError(v1::ERROR_BAD_MESSAGE, "rate: give 0 to 1000000 per second",
                     "watch_frames.rate");
  }
  if (request.frame().has_tick()) {
    return makeError(v1::ERROR_BAD_MESSAGE, "frame.tick: a subscription covers all ticks; omit it",
                     "watch_frames.frame.tick");
  }
  if (hosted.frames.deviceName().empty())
    return makeError(v1::ERROR_NO_RENDERER, hosted.frames.unavailableReason());
  if (request.frame().has_flow_from() || request.frame().has_flow_forward())
    return makeError(v1::ERROR_BAD_MESSAGE,
                     "flow_from: the flow of a watch begins at its last picture; omit it",
                     "watch_frames.frame.flow_from");
  const auto view = viewFromProto(request.frame(), *hosted.world.snapshot());
  const auto* error = std::get_if<v1::Error>(&view);
  // An unknown avatar may be spawned later; all other errors are permanent.
  if (error && error->code() != v1::ERROR_UNKNOWN_AVATAR) return prefixErrorField(*error);
  if (!error && hasFlow(request.frame())) {
    const auto flow = earlierViewFromProto(request.frame(), hosted.world.snapshot());
    if (const auto* refused = std::get_if<v1::Error>(&flow)) return prefixErrorField(*refused);
  }
  FrameSubscription subscription;
  subscription.request = request.frame();
  subscription.rate = request.rate();
  subscription.generation = ++hosted.lastGeneration;
  FrameSubscription& stored =
      client.frameSubscriptions.insert_or_assign(request.watch(), std::move(subscription))
          .first->second;
  if (!error) renderNext(hosted, id, client, request.watch(), stored);
  return std::nullopt;
}

decltype(FrameJob::onRendered) makeRecordingObserver(const HostedWorld& hosted,
                                                     const v1::FrameRequest& request) {
  const WorldRecorder* recorder = hosted.world.recorder();
  if (!recorder || !recorder->recordsImages() || !request.has_eyes()) return {};
  return [avatar = request.eyes().avatar(), branch = hosted.branchCount, post = hosted.post](
             const v1::Frame& frame, std::span<const std::uint8_t> attachment) {
    auto image = extractImage(frame, attachment);
    if (!image) return;
    post([avatar, branch, frame, image = std::move(*image)](HostedWorld& current) {
      WorldRecorder* currentRecorder = current.world.recorder();
      if (currentRecorder && current.branchCount == branch)
        currentRecorder->writeImage(avatar, frame, image);
    });
  };
}

void renderRecorded(HostedWorld& hosted) {
  WorldRecorder* recorder = hosted.world.recorder();
  // deviceName() waits for the renderer; it is called only if frames are recorded.
  if (!recorder || !recorder->areImagesDue(hosted.world) || hosted.frames.deviceName().empty())
    return;
  const auto snapshot = hosted.world.snapshot();
  for (const scene::AvatarSnapshot& avatar : snapshot->avatars) {
    // Skip an avatar whose previous frame is not finished: the tick does not wait.
    if (!hosted.recordingRenders.insert(avatar.name).second) continue;
    const v1::FrameRequest request = makeRecordedViewRequest(avatar.name);
    FrameJob job;
    job.snapshot = snapshot;
    job.view = std::get<render::ViewRequest>(viewFromProto(request, *snapshot));
    job.request = request;
    job.renderedCount = hosted.renderedFrames;
    job.onRendered = makeRecordingObserver(hosted, request);
    hosted.frames.renderFrame(
        std::move(job), [name = avatar.name, post = hosted.post](const EncodedMessage&) {
          post([name](HostedWorld& current) { current.recordingRenders.erase(name); });
        });
  }
}

void renderSubscribed(HostedWorld& hosted, ClientId id, Client& client) {
  const double now = hosted.world.snapshot()->time;
  for (auto& [number, subscription] : client.frameSubscriptions) {
    if (now + hosted.world.settings().tickDuration / 2 < subscription.nextTime) continue;
    if (subscription.rendering) {
      ++subscription.dropped;
      subscription.missed = true;
      continue;
    }
    renderNext(hosted, id, client, number, subscription);
  }
}

}  // namespace enfilade::server
