#include "server/hosting/frame_subscriptions.hpp"

#include <utility>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

void drawNext(ServedWorld& served, ClientId id, Client& client, std::uint32_t number,
              FrameWatch& watch);

/// Lets the next picture begin before this one is handed over: who saw it and then steps gets the
/// next. So two may be unsent for a moment. An error, as of a device that was lost, is handed over
/// too.
void deliver(ServedWorld& served, ClientId id, std::uint32_t number, std::uint64_t generation,
             const std::shared_ptr<OutgoingQueue>& out, FrameJob job) {
  const auto drawn = [id, number, generation](ServedWorld& then) {
    const auto client = then.clients.find(id);
    if (client == then.clients.end()) return;
    const auto watch = client->second.watches.find(number);
    if (watch == client->second.watches.end() || watch->second.generation != generation) return;
    watch->second.underWay = false;
    if (std::exchange(watch->second.elsewhere, false))
      drawNext(then, id, client->second, number, watch->second);
  };
  served.frames.draw(std::move(job), [out, number, drawn, post = served.post](Encoded picture) {
    post(drawn);
    out->pushLatest(std::move(picture), number);
  });
}

/// The error of a view, as one of the whole request.
v1::Error ofWatch(v1::Error error) {
  if (!error.field().empty()) error.set_field("watch_frames.frame." + error.field());
  return error;
}

void draw(ServedWorld& served, ClientId id, Client& client, std::uint32_t number,
          FrameWatch& watch) {
  const auto snapshot = served.world.snapshot();
  auto view = viewFrom(watch.request, *snapshot);
  if (std::holds_alternative<v1::Error>(view)) return;
  if (client.out->dropLatest(number)) ++watch.dropped;
  served.droppedFrames += watch.dropped;
  watch.underWay = true;
  FrameJob job{
      snapshot,    std::get<View>(std::move(view)), watch.request, 0, number, watch.dropped,
      served.drawn};
  watch.dropped = 0;
  job.seen = toRecording(served, watch.request);
  deliver(served, id, number, watch.generation, client.out, std::move(job));
}

void drawNext(ServedWorld& served, ClientId id, Client& client, std::uint32_t number,
              FrameWatch& watch) {
  const double now = served.world.snapshot()->time;
  watch.nextTime = now + (watch.rate > 0 ? 1 / watch.rate : 0);
  draw(served, id, client, number, watch);
}

}  // namespace

std::optional<v1::Error> watchFrames(ServedWorld& served, ClientId id, Client& client,
                                     const v1::WatchFrames& wanted) {
  const std::uint32_t most = served.limits.watches;
  if (wanted.watch() < 1 || wanted.watch() > most) {
    return errorOf(v1::ERROR_BAD_MESSAGE, "watch: give a number from 1 to " + std::to_string(most),
                   "watch_frames.watch");
  }
  if (!wanted.has_frame()) {
    client.watches.erase(wanted.watch());
    return std::nullopt;
  }
  if (!(wanted.rate() >= 0 && wanted.rate() <= 1e6)) {
    return errorOf(v1::ERROR_BAD_MESSAGE, "rate: give 0 to 1000000 a second", "watch_frames.rate");
  }
  if (wanted.frame().has_tick()) {
    return errorOf(v1::ERROR_BAD_MESSAGE, "frame.tick: a watch is of all ticks; leave it out",
                   "watch_frames.frame.tick");
  }
  if (served.frames.deviceName().empty())
    return errorOf(v1::ERROR_NO_RENDERER, served.frames.whyNone());
  const auto view = viewFrom(wanted.frame(), *served.world.snapshot());
  const auto* problem = std::get_if<v1::Error>(&view);
  // An avatar may come later; all else that is wrong with a view stays wrong.
  if (problem && problem->code() != v1::ERROR_UNKNOWN_AVATAR) return ofWatch(*problem);
  FrameWatch watch;
  watch.request = wanted.frame();
  watch.rate = wanted.rate();
  watch.generation = ++served.lastWatch;
  FrameWatch& kept =
      client.watches.insert_or_assign(wanted.watch(), std::move(watch)).first->second;
  if (!problem) draw(served, id, client, wanted.watch(), kept);
  return std::nullopt;
}

decltype(FrameJob::seen) toRecording(const ServedWorld& served, const v1::FrameRequest& request) {
  const WorldRecorder* recorder = served.world.recorder();
  if (!recorder || !recorder->takesPictures() || !request.has_eyes()) return {};
  return [avatar = request.eyes().avatar(), branch = served.branches, post = served.post](
             const v1::Frame& frame, std::span<const std::uint8_t> attachment) {
    auto picture = encodedPicture(frame, attachment);
    if (!picture) return;
    post([avatar, branch, frame, picture = std::move(*picture)](ServedWorld& then) {
      WorldRecorder* taker = then.world.recorder();
      if (taker && then.branches == branch) taker->picture(avatar, frame, picture);
    });
  };
}

void drawRecorded(ServedWorld& served) {
  WorldRecorder* recorder = served.world.recorder();
  // Only who records pictures waits for what draws them.
  if (!recorder || !recorder->picturesDue(served.world) || served.frames.deviceName().empty())
    return;
  const auto snapshot = served.world.snapshot();
  for (const scene::AvatarView& avatar : snapshot->avatars) {
    // One that is not drawn yet is left out: the tick waits for no picture.
    if (!served.recordedViews.insert(avatar.name).second) continue;
    const v1::FrameRequest request = recordedView(avatar.name);
    FrameJob job;
    job.snapshot = snapshot;
    job.view = std::get<View>(viewFrom(request, *snapshot));
    job.request = request;
    job.drawn = served.drawn;
    job.seen = toRecording(served, request);
    served.frames.draw(std::move(job), [name = avatar.name, post = served.post](const Encoded&) {
      post([name](ServedWorld& then) { then.recordedViews.erase(name); });
    });
  }
}

void drawWatched(ServedWorld& served, ClientId id, Client& client) {
  const double now = served.world.snapshot()->time;
  for (auto& [number, watch] : client.watches) {
    if (now + served.world.lengths().tick / 2 < watch.nextTime) continue;
    if (watch.underWay) {
      ++watch.dropped;
      continue;
    }
    drawNext(served, id, client, number, watch);
  }
}

}  // namespace enfilade::server
