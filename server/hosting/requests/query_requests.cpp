#include "server/hosting/requests/query_requests.hpp"

#include <algorithm>

#include "server/hosting/requests/checkpoint_requests.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

/// Passes the bytes of meshes on, also those of an upload.
void loadMesh(const RequestContext& context, const v1::NavigationQuery& query) {
  auto mesh = takeBytes(context.client, query.load_mesh().mesh(), query.load_mesh().uploaded(),
                        "navigation.load_mesh.mesh");
  if (auto* error = std::get_if<v1::Error>(&mesh)) return replyError(context, std::move(*error));
  HostedWorld& hosted = context.hosted;
  SceneQuery job{hosted.world.snapshot(), context.message, hosted.world.settings(), hosted.limits};
  job.message.mutable_navigation()->mutable_load_mesh()->set_mesh(
      std::get<std::string>(std::move(mesh)));
  hosted.queries.submit(std::move(job), deferReply(context));
}

v1::Entity makeEntity(const scene::World& world, std::uint32_t id, bool details) {
  const auto& objects = world.scene().model().objects;
  v1::Entity entity;
  entity.set_id(id);
  entity.set_name(scene::findEntityName(world, id));
  if (id >= 1 && id <= objects.size()) {
    describeObject(world.scene().model(), id, entity);
  } else if (!entity.name().empty()) {
    entity.set_kind(v1::Entity::KIND_AVATAR);
  }
  if (details && entity.kind() != v1::Entity::KIND_UNSPECIFIED)
    describeDetails(world.scene(), id, entity);
  return entity;
}

/// Adds entities to a reply up to ServerLimits::replyBytes.
class BoundedNames {
 public:
  BoundedNames(const HostedWorld& hosted, bool details, v1::EntityNames& names)
      : hosted_(hosted), details_(details), names_(names) {}

  /// Returns false and adds nothing if the reply would become too large.
  bool addEntity(std::uint32_t id) {
    constexpr std::size_t kFieldBytes = 8;  // maximum size of an entity's tag and length
    v1::Entity entity = makeEntity(hosted_.world, id, details_);
    bytes_ += entity.ByteSizeLong() + kFieldBytes;
    if (bytes_ > hosted_.limits.replyBytes) return false;
    *names_.add_entities() = std::move(entity);
    return true;
  }
  bool addAllEntities() {
    const auto& objects = hosted_.world.scene().model().objects;
    for (std::uint32_t id = 1; id <= objects.size(); ++id) {
      if (!addEntity(id)) return false;
    }
    const auto& avatars = hosted_.world.snapshot()->avatars;
    return std::all_of(avatars.begin(), avatars.end(),
                       [this](const auto& a) { return addEntity(a.id); });
  }

 private:
  const HostedWorld& hosted_;
  const bool details_;
  v1::EntityNames& names_;
  std::size_t bytes_ = 0;
};

}  // namespace

void submitQuery(const RequestContext& context, std::function<void(double)> progress) {
  HostedWorld& hosted = context.hosted;
  hosted.queries.submit({hosted.world.snapshot(), context.message, hosted.world.settings(),
                         hosted.limits, std::move(progress), hosted.keptPaths},
                        deferReply(context));
}

void handleNavigation(const RequestContext& context, const v1::NavigationQuery& query) {
  if (query.has_load_mesh()) return loadMesh(context, query);
  forwardQuery(context, query, "navigation.tick", makeProgress(context, query.progress()));
}

void handleDescribe(const RequestContext& context, const v1::DescribeEntities& request) {
  const ServerLimits& limits = context.hosted.limits;
  const auto count = static_cast<std::size_t>(request.ids_size());
  const std::string remedy =
      "request in pages of at most " + std::to_string(limits.describedIds) + " ids";
  if (count > limits.describedIds) {
    return replyError(context, v1::ERROR_TOO_LARGE,
                      "ids has " + std::to_string(count) + " ids: " + remedy, "describe.ids");
  }
  v1::ServerMessage message;
  BoundedNames names(context.hosted, request.details(), *message.mutable_names());
  const bool allNamed = count == 0
                            ? names.addAllEntities()
                            : std::all_of(request.ids().begin(), request.ids().end(),
                                          [&](std::uint32_t id) { return names.addEntity(id); });
  if (!allNamed) {
    return replyError(context, v1::ERROR_TOO_LARGE,
                      "the names need more than the " + std::to_string(limits.replyBytes) +
                          " bytes of a reply: give ids and " + remedy +
                          ", fewer where names are long",
                      "describe.ids");
  }
  sendReply(context, std::move(message));
}

void handleMetrics(const RequestContext& context) {
  HostedWorld& hosted = context.hosted;
  v1::ServerMessage message;
  v1::Metrics& metrics = *message.mutable_metrics();
  metrics = hosted.statistics.makeMetrics();
  metrics.set_clients(
      static_cast<std::uint32_t>(std::count_if(hosted.clients.begin(), hosted.clients.end(),
                                               [](const auto& one) { return !one.second.guest; })));
  metrics.set_avatars(static_cast<std::uint32_t>(hosted.world.snapshot()->avatars.size()));
  metrics.set_frames(*hosted.renderedFrames);
  metrics.set_dropped(hosted.droppedStates + hosted.droppedFrames);
  if (const WorldRecorder* recorder = hosted.world.recorder()) {
    metrics.mutable_recording()->set_ticks(recorder->ticks());
    metrics.mutable_recording()->set_bytes(recorder->bytes());
    metrics.mutable_recording()->set_broken(recorder->isBroken());
  }
  sendReply(context, std::move(message));
}

}  // namespace enfilade::server
