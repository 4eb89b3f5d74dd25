#include "server/messages/ray_messages.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <set>

#include "collision/assert.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using RayQueryOrError = std::variant<ResolvedRayQuery, v1::Error>;

v1::Error makeBadRaysError(const std::string& field, const std::string& reason) {
  return makeError(v1::ERROR_BAD_RAYS, field + reason, field);
}

/// Metres; larger than any world.
constexpr double kMaxRayDistance = 1e8;

/// Checks the reach of a message: 0 means unlimited; infinity and NaN are invalid.
std::optional<v1::Error> validateReach(const std::string& field, double metres) {
  if (metres == 0 || (metres > 0 && metres <= kMaxRayDistance)) return std::nullopt;
  return makeBadRaysError(field + ".reach", ": give metres above 0 and up to 1e8, or 0 for no end");
}

double maxDistanceFromProto(double metres) {
  return metres == 0 ? std::numeric_limits<double>::infinity() : metres;
}

/// Converts a refusal of scene::, which starts with its field: "up: must not ...".
v1::Error makeRayError(const std::string& message, const std::string& reason) {
  const std::string field = message + "." + reason.substr(0, reason.find(':'));
  return makeError(v1::ERROR_BAD_RAYS, message + "." + reason, field);
}

v1::Error makeTooManyRaysError(const std::string& field, std::size_t count, std::size_t maxRays) {
  return makeError(v1::ERROR_TOO_LARGE,
                   field + " requests " + std::to_string(count) + " rays; request at most " +
                       std::to_string(maxRays) + " at a time",
                   field);
}

RayQueryOrError resolveRayList(const v1::RayQuery& query, const ServerLimits& limits) {
  ResolvedRayQuery resolved;
  const auto count = static_cast<std::size_t>(query.rays_size());
  if (count > limits.rays) return makeTooManyRaysError("rays.rays", count, limits.rays);
  for (int i = 0; i < query.rays_size(); ++i) {
    const v1::Ray& message = query.rays(i);
    const std::string field = "rays.rays[" + std::to_string(i) + "]";
    if (!message.has_origin()) return makeBadRaysError(field + ".origin", " is missing");
    if (!message.has_direction()) return makeBadRaysError(field + ".direction", " is missing");
    if (auto error = validateReach(field, message.reach())) return std::move(*error);
    const scene::Ray ray{vectorFromProto(message.origin()), vectorFromProto(message.direction()),
                         maxDistanceFromProto(message.reach())};
    if (const auto reason = scene::validateRay(ray)) return makeRayError(field, *reason);
    resolved.rays.push_back(ray);
  }
  return resolved;
}

/// Sets the origin and orientation of the scan. The scanning avatar itself is ignored.
std::optional<v1::Error> resolveScanPose(const v1::RangeScan& message,
                                         const scene::Snapshot& snapshot, scene::RangeScan& scan,
                                         scene::RayFilter& filter) {
  if (message.from_case() == v1::RangeScan::FROM_NOT_SET) {
    return makeBadRaysError("rays.scan", " has no origin: give `at` or `avatar`");
  }
  scan.origin = vectorFromProto(message.at());
  if (message.has_avatar()) {
    const scene::AvatarSnapshot* avatar = findAvatar(snapshot, message.avatar());
    if (!avatar) return makeUnknownAvatarError(message.avatar(), "rays.scan.avatar");
    scan.origin = avatar->footPosition + scene::Vec3(0, avatar->eyeHeight, 0);
    scan.forward = avatar->viewDirection;
    filter.ignoredEntity = avatar->id;
  }
  if (message.has_forward()) scan.forward = vectorFromProto(message.forward());
  if (message.has_up()) scan.up = vectorFromProto(message.up());
  return std::nullopt;
}

RayQueryOrError resolveScan(const v1::RangeScan& message, const scene::Snapshot& snapshot,
                            const ServerLimits& limits) {
  ResolvedRayQuery resolved;
  scene::RangeScan scan;
  if (auto error = resolveScanPose(message, snapshot, scan, resolved.filter))
    return std::move(*error);
  scan.width = message.width();
  scan.height = message.height();
  scan.columns = message.columns();
  scan.rows = std::max(1u, message.rows());
  if (auto error = validateReach("rays.scan", message.reach())) return std::move(*error);
  scan.maxDistance = maxDistanceFromProto(message.reach());
  if (const auto reason = scene::validateScan(scan)) return makeRayError("rays.scan", *reason);
  const std::size_t count = std::size_t{scan.columns} * scan.rows;
  if (count > limits.scanRays) return makeTooManyRaysError("rays.scan", count, limits.scanRays);
  resolved.rays = scene::makeScanRays(scan);
  resolved.columns = scan.columns;
  resolved.rows = scan.rows;
  return resolved;
}

std::string findEntityName(const scene::Scene& scene, const scene::Snapshot& snapshot,
                           std::uint32_t id) {
  const auto& objects = scene.model().objects;
  if (id >= 1 && id <= objects.size()) return objects[id - 1].path;
  for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
    if (avatar.id == id) return avatar.name;
  }
  return "";
}

void fillHit(v1::RayHit& message, const scene::RayHit& hit) {
  message.set_met(true);
  message.set_entity(hit.entity);
  message.set_distance(hit.distance);
  *message.mutable_point() = toProto(hit.point);
  *message.mutable_normal() = toProto(hit.normal);
}

/// Attachment: all distances (float), then all entity ids (uint32): 8 bytes per ray.
void castScan(const ResolvedRayQuery& resolved, const scene::RayCaster& caster,
              std::vector<std::uint8_t>& attachment) {
  const std::size_t count = resolved.rays.size();
  ENFILADE_ASSERT(count == std::size_t{resolved.columns} * resolved.rows);
  std::vector<float> distances(count, std::numeric_limits<float>::quiet_NaN());
  std::vector<std::uint32_t> entities(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const auto hit = caster.firstHit(resolved.rays[i], resolved.filter);
    if (!hit) continue;
    distances[i] = static_cast<float>(hit->distance);
    entities[i] = hit->entity;
  }
  attachment.resize(8 * count);
  std::memcpy(attachment.data(), distances.data(), 4 * count);
  std::memcpy(attachment.data() + 4 * count, entities.data(), 4 * count);
}

/// The hit entity with its name.
v1::Entity makeHitEntity(const scene::Scene& scene, const scene::Snapshot& snapshot,
                         std::uint32_t id) {
  ENFILADE_ASSERT(id != 0);
  v1::Entity entity;
  entity.set_id(id);
  entity.set_kind(v1::Entity::KIND_AVATAR);
  entity.set_name(findEntityName(scene, snapshot, id));
  if (id <= scene.model().objects.size()) describeObject(scene.model(), id, entity);
  return entity;
}

/// Attachment: 7 doubles per ray (distance, point, normal), then all entity ids (uint32).
void castPacked(const ResolvedRayQuery& resolved, const scene::RayCaster& caster,
                const scene::Scene& scene, const scene::Snapshot& snapshot, v1::RayReply& reply,
                std::vector<std::uint8_t>& attachment) {
  constexpr std::size_t kValuesPerRay = 7;
  const std::size_t count = resolved.rays.size();
  std::vector<double> values(kValuesPerRay * count, std::numeric_limits<double>::quiet_NaN());
  std::vector<std::uint32_t> entities(count, 0);
  std::set<std::uint32_t> hitIds;
  for (std::size_t i = 0; i < count; ++i) {
    const auto hit = caster.firstHit(resolved.rays[i], resolved.filter);
    if (!hit) continue;
    double* const rayValues = values.data() + kValuesPerRay * i;
    rayValues[0] = hit->distance;
    std::copy_n(hit->point.data(), 3, rayValues + 1);
    std::copy_n(hit->normal.data(), 3, rayValues + 4);
    entities[i] = hit->entity;
    hitIds.insert(hit->entity);
  }
  const std::size_t valueBytes = sizeof(double) * values.size();
  const std::size_t entityBytes = sizeof(std::uint32_t) * count;
  attachment.resize(valueBytes + entityBytes);
  std::memcpy(attachment.data(), values.data(), valueBytes);
  std::memcpy(attachment.data() + valueBytes, entities.data(), entityBytes);
  for (const std::uint32_t id : hitIds) *reply.add_met() = makeHitEntity(scene, snapshot, id);
}

}  // namespace

RayQueryOrError rayQueryFromProto(const v1::RayQuery& query, const scene::Snapshot& snapshot,
                                  const ServerLimits& limits) {
  if (query.has_scan() == (query.rays_size() > 0)) {
    return makeBadRaysError("rays", ": give either rays or a scan");
  }
  if (query.has_scan() && query.only_blocked()) {
    return makeBadRaysError("rays.only_blocked",
                            ": a scan returns distances; request rays instead");
  }
  RayQueryOrError resolved = query.has_scan() ? resolveScan(query.scan(), snapshot, limits)
                                              : resolveRayList(query, limits);
  auto* rays = std::get_if<ResolvedRayQuery>(&resolved);
  if (!rays) return resolved;
  rays->filter.ignoreTransparent = query.through_glass();
  rays->onlyBlocked = query.only_blocked();
  rays->packed = query.packed() && !query.only_blocked();
  if (!query.through_avatar().empty()) {
    const scene::AvatarSnapshot* avatar = findAvatar(snapshot, query.through_avatar());
    if (!avatar) return makeUnknownAvatarError(query.through_avatar(), "rays.through_avatar");
    rays->filter.ignoredEntity = avatar->id;
  }
  return resolved;
}

v1::RayReply castRays(const ResolvedRayQuery& resolved, const scene::RayCaster& caster,
                      const scene::Scene& scene, const scene::Snapshot& snapshot,
                      std::vector<std::uint8_t>& attachment) {
  v1::RayReply reply;
  reply.set_tick(snapshot.tick);
  reply.set_time(snapshot.time);
  reply.set_columns(resolved.columns);
  reply.set_rows(resolved.rows);
  if (resolved.columns > 0) {
    castScan(resolved, caster, attachment);
    return reply;
  }
  if (resolved.packed) {
    castPacked(resolved, caster, scene, snapshot, reply, attachment);
    return reply;
  }
  for (const scene::Ray& ray : resolved.rays) {
    v1::RayHit& message = *reply.add_hits();
    if (resolved.onlyBlocked) {
      message.set_met(caster.isBlocked(ray, resolved.filter));
    } else if (const auto hit = caster.firstHit(ray, resolved.filter)) {
      fillHit(message, *hit);
      message.set_name(findEntityName(scene, snapshot, hit->entity));
    }
  }
  return reply;
}

}  // namespace enfilade::server
