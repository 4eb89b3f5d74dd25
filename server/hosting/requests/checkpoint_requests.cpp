#include "server/hosting/requests/checkpoint_requests.hpp"

#include "scene/world/active_contacts.hpp"
#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/hosting/requests/clock_requests.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

/// The active contacts as begin and enter events of the last tick: a checkpoint does not hold when
/// they began.
v1::TickEvents makeActiveContacts(const scene::World& world) {
  v1::TickEvents events;
  events.set_tick(world.snapshot()->tick);
  events.set_time(world.snapshot()->time);
  for (const scene::ContactEvent& contact : scene::collectActiveContacts(world))
    *events.add_contacts() = toProto(world, contact);
  return events;
}

std::optional<v1::Error> validateRestorable(const HostedWorld& hosted) {
  if (hosted.replay)
    return makeError(v1::ERROR_NOT_ALLOWED, "the world replays a recording: use Seek instead");
  if (hosted.world.recorder())
    return makeError(v1::ERROR_NOT_ALLOWED,
                     "the world is recorded, and its recording cannot continue from elsewhere: "
                     "start the server without --record");
  return std::nullopt;
}

}  // namespace

void handleSaveWorld(const RequestContext& context) {
  const scene::World& world = context.hosted.world;
  v1::ServerMessage message;
  message.set_reply_to(context.message.request_id());
  message.mutable_save()->set_tick(world.snapshot()->tick);
  message.mutable_save()->set_state_hash(world.snapshot()->stateHash);
  context.client.out->push(encodeShared(message, scene::makeCheckpoint(world)));
}

void handleRestoreWorld(const RequestContext& context, const v1::RestoreWorld& request) {
  HostedWorld& hosted = context.hosted;
  auto error = validateRestorable(hosted);
  if (!error) error = validateOwnsAvatars(context);
  if (!error) error = acquireClock(context);
  if (error) return replyError(context, std::move(*error));
  const std::string& bytes = request.checkpoint();
  try {
    scene::World world = scene::restoreWorld(
        hosted.scene, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    const v1::TickEvents contacts = makeActiveContacts(world);
    replaceWorld(hosted, std::move(world), contacts, "the world was restored");
  } catch (const scene::CheckpointError& problem) {
    return replyError(context, v1::ERROR_BAD_MESSAGE, problem.what(), "restore.checkpoint");
  }
  const auto snapshot = hosted.world.snapshot();
  for (const scene::AvatarSnapshot& avatar : snapshot->avatars)
    hosted.owners[avatar.name] = context.clientId;
  hosted.clock.nextTick = std::chrono::steady_clock::now();
  v1::ServerMessage message;
  message.mutable_restore()->set_tick(snapshot->tick);
  message.mutable_restore()->set_time(snapshot->time);
  message.mutable_restore()->set_state_hash(snapshot->stateHash);
  sendReply(context, std::move(message));
}

}  // namespace enfilade::server
