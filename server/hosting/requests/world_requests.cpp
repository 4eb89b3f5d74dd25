#include "server/hosting/requests/world_requests.hpp"

#include "server/hosting/requests/world_group.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

void replyWorldsUnsupported(const RequestContext& context) {
  replyError(context, v1::ERROR_UNSUPPORTED, "this server has one world and no others");
}

}  // namespace

void handleCreateWorld(const RequestContext& context, const v1::CreateWorld& request) {
  const WorldIdentity& identity = context.hosted.identity;
  if (!identity.directory) return replyWorldsUnsupported(context);
  const auto onDone = [id = context.message.request_id(),
                       done = deferReply(context)](std::variant<v1::World, v1::Error> created) {
    v1::ServerMessage message;
    message.set_reply_to(id);
    if (auto* error = std::get_if<v1::Error>(&created))
      return done(makeErrorReply(id, std::move(*error)));
    *message.mutable_create_world()->mutable_world() = std::get<v1::World>(std::move(created));
    done(encodeShared(message));
  };
  const std::string scene = request.scene().empty() ? identity.scene : request.scene();
  identity.directory->create({request.name(), scene, request.drop_when_empty()}, onDone);
}

void handleDropWorld(const RequestContext& context, const v1::DropWorld& request) {
  const WorldIdentity& identity = context.hosted.identity;
  if (!identity.directory) return replyWorldsUnsupported(context);
  const auto onDone = [id = context.message.request_id(),
                       done = deferReply(context)](std::optional<v1::Error> error) {
    if (error) return done(makeErrorReply(id, std::move(*error)));
    v1::ServerMessage message;
    message.set_reply_to(id);
    message.mutable_drop_world();
    done(encodeShared(message));
  };
  identity.directory->drop(request.name(), identity.name, onDone);
}

void handleStepMany(const RequestContext& context, const v1::StepMany& request) {
  const WorldIdentity& identity = context.hosted.identity;
  if (!identity.directory) return replyWorldsUnsupported(context);
  if (auto error = WorldGroup::validate(request, context.hosted.limits.worlds))
    return replyError(context, std::move(*error));
  Client& client = context.client;
  if (!client.group)
    client.group = std::make_shared<WorldGroup>(*identity.directory, client.name, client.role,
                                                context.hosted.limits);
  client.group->submit(request, context.message.request_id(), deferReply(context));
}

void handleListWorlds(const RequestContext& context) {
  if (!context.hosted.identity.directory) return replyWorldsUnsupported(context);
  v1::ServerMessage message;
  *message.mutable_worlds() = context.hosted.identity.directory->makeWorldList();
  sendReply(context, std::move(message));
}

}  // namespace enfilade::server
