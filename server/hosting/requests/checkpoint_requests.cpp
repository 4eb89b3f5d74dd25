#include "server/hosting/requests/checkpoint_requests.hpp"

#include <utility>

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
  return std::nullopt;
}

}  // namespace

void handleUpload(const RequestContext& context, const v1::Upload& request) {
  std::string& upload = context.client.upload;
  if (request.first()) upload = {};
  const std::size_t limit = context.hosted.limits.uploadBytes;
  if (upload.size() + request.part().size() > limit) {
    upload = {};
    return replyError(context, v1::ERROR_TOO_LARGE,
                      "the parts have more than " + std::to_string(limit) +
                          " bytes (limits.max_upload); they were dropped",
                      "upload.part");
  }
  upload += request.part();
  v1::ServerMessage message;
  message.mutable_upload()->set_bytes(upload.size());
  sendReply(context, std::move(message));
}

std::variant<std::string, v1::Error> takeBytes(Client& client, const std::string& bytes,
                                               bool uploaded, const std::string& field) {
  if (!uploaded) return bytes;
  if (!bytes.empty())
    return makeError(v1::ERROR_BAD_MESSAGE, "give either the bytes or uploaded", field);
  if (client.upload.empty())
    return makeError(v1::ERROR_BAD_MESSAGE, "nothing was uploaded: send Upload first", field);
  return std::exchange(client.upload, {});
}

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
  auto taken =
      takeBytes(context.client, request.checkpoint(), request.uploaded(), "restore.checkpoint");
  if (auto* refused = std::get_if<v1::Error>(&taken))
    return replyError(context, std::move(*refused));
  const std::string& bytes = std::get<std::string>(taken);
  try {
    scene::World world = scene::restoreWorld(
        hosted.scene, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    const v1::TickEvents contacts = makeActiveContacts(world);
    replaceWorld(hosted, std::move(world), contacts, "the world was restored",
                 RecordingAfter::continues);
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
