#include "server/messages/ray_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using AskedOrError = std::variant<AskedRays, v1::Error>;

v1::Error bad(const std::string& field, const std::string& why) {
  return errorOf(v1::ERROR_BAD_RAYS, field + why, field);
}

/// More than there is from one end of the world to the other.
constexpr double kFarthestReach = 1e8;

/// Of a message: 0 has no end, and what is not finite is no number of this protocol.
std::optional<v1::Error> badReach(const std::string& field, double metres) {
  if (metres == 0 || (metres > 0 && metres <= kFarthestReach)) return std::nullopt;
  return bad(field + ".reach", ": give metres above 0 and up to 1e8, or 0 for no end");
}

double reachFrom(double metres) {
  return metres == 0 ? std::numeric_limits<double>::infinity() : metres;
}

/// A refusal of scene:: begins with its field: "up: must not ...".
v1::Error refused(const std::string& message, const std::string& why) {
  const std::string field = message + "." + why.substr(0, why.find(':'));
  return errorOf(v1::ERROR_BAD_RAYS, message + "." + why, field);
}

v1::Error tooMany(const std::string& field, std::size_t count, std::size_t most) {
  return errorOf(v1::ERROR_TOO_LARGE,
                 field + " asks for " + std::to_string(count) + " rays; ask for at most " +
                     std::to_string(most) + " at a time",
                 field);
}

AskedOrError listed(const v1::RayQuery& query, const ServerLimits& limits) {
  AskedRays asked;
  const auto count = static_cast<std::size_t>(query.rays_size());
  if (count > limits.rays) return tooMany("rays.rays", count, limits.rays);
  for (int i = 0; i < query.rays_size(); ++i) {
    const v1::Ray& message = query.rays(i);
    const std::string field = "rays.rays[" + std::to_string(i) + "]";
    if (!message.has_origin()) return bad(field + ".origin", " is missing");
    if (!message.has_direction()) return bad(field + ".direction", " is missing");
    if (auto error = badReach(field, message.reach())) return std::move(*error);
    const scene::Ray ray{vectorFrom(message.origin()), vectorFrom(message.direction()),
                         reachFrom(message.reach())};
    if (const auto why = scene::refusal(ray)) return refused(field, *why);
    asked.rays.push_back(ray);
  }
  return asked;
}

/// Fills in where the scan is cast from; the avatar does not see itself.
std::optional<v1::Error> placeScan(const v1::RangeScan& message, const scene::Snapshot& snapshot,
                                   scene::RangeScan& scan, scene::RayFilter& filter) {
  if (message.from_case() == v1::RangeScan::FROM_NOT_SET) {
    return bad("rays.scan", " has no place: give `at` or `avatar`");
  }
  scan.at = vectorFrom(message.at());
  if (message.has_avatar()) {
    const scene::AvatarView* avatar = avatarNamed(snapshot, message.avatar());
    if (!avatar) return unknownAvatar(message.avatar(), "rays.scan.avatar");
    scan.at = avatar->feet + scene::Vec3(0, avatar->eyeHeight, 0);
    scan.forward = avatar->gaze;
    filter.through = avatar->id;
  }
  if (message.has_forward()) scan.forward = vectorFrom(message.forward());
  if (message.has_up()) scan.up = vectorFrom(message.up());
  return std::nullopt;
}

AskedOrError scanned(const v1::RangeScan& message, const scene::Snapshot& snapshot,
                     const ServerLimits& limits) {
  AskedRays asked;
  scene::RangeScan scan;
  if (auto error = placeScan(message, snapshot, scan, asked.filter)) return std::move(*error);
  scan.width = message.width();
  scan.height = message.height();
  scan.columns = message.columns();
  scan.rows = std::max(1u, message.rows());
  if (auto error = badReach("rays.scan", message.reach())) return std::move(*error);
  scan.reach = reachFrom(message.reach());
  if (const auto why = scene::refusal(scan)) return refused("rays.scan", *why);
  const std::size_t count = std::size_t{scan.columns} * scan.rows;
  if (count > limits.scanRays) return tooMany("rays.scan", count, limits.scanRays);
  asked.rays = scene::raysOf(scan);
  asked.columns = scan.columns;
  asked.rows = scan.rows;
  return asked;
}

std::string nameOf(const scene::Scene& scene, const scene::Snapshot& snapshot, std::uint32_t id) {
  const auto& objects = scene.model().objects;
  if (id >= 1 && id <= objects.size()) return objects[id - 1].path;
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    if (avatar.id == id) return avatar.name;
  }
  return "";
}

void fill(v1::RayHit& message, const scene::RayHit& hit) {
  message.set_met(true);
  message.set_entity(hit.entity);
  message.set_distance(hit.distance);
  *message.mutable_point() = messageOf(hit.point);
  *message.mutable_normal() = messageOf(hit.normal);
}

/// Distances, then entities: both of four bytes a ray.
void castScan(const AskedRays& asked, const scene::RayCaster& caster,
              std::vector<std::uint8_t>& attachment) {
  const std::size_t count = asked.rays.size();
  std::vector<float> distances(count, std::numeric_limits<float>::quiet_NaN());
  std::vector<std::uint32_t> entities(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const auto hit = caster.firstHit(asked.rays[i], asked.filter);
    if (!hit) continue;
    distances[i] = static_cast<float>(hit->distance);
    entities[i] = hit->entity;
  }
  attachment.resize(8 * count);
  std::memcpy(attachment.data(), distances.data(), 4 * count);
  std::memcpy(attachment.data() + 4 * count, entities.data(), 4 * count);
}

/// What is met, with its name.
v1::Entity entityMet(const scene::Scene& scene, const scene::Snapshot& snapshot, std::uint32_t id) {
  v1::Entity entity;
  entity.set_id(id);
  entity.set_kind(id <= scene.model().objects.size() ? v1::Entity::KIND_OBJECT
                                                     : v1::Entity::KIND_AVATAR);
  entity.set_name(nameOf(scene, snapshot, id));
  if (entity.kind() == v1::Entity::KIND_OBJECT) {
    entity.set_global_id(scene.model().objects[id - 1].globalId);
    entity.set_operation(scene.model().objects[id - 1].operation);
  }
  return entity;
}

/// Seven numbers a ray, then entities.
void castPacked(const AskedRays& asked, const scene::RayCaster& caster, const scene::Scene& scene,
                const scene::Snapshot& snapshot, v1::RayReply& reply,
                std::vector<std::uint8_t>& attachment) {
  constexpr std::size_t kNumbers = 7;  // a ray
  const std::size_t count = asked.rays.size();
  std::vector<double> numbers(kNumbers * count, std::numeric_limits<double>::quiet_NaN());
  std::vector<std::uint32_t> entities(count, 0);
  std::set<std::uint32_t> met;
  for (std::size_t i = 0; i < count; ++i) {
    const auto hit = caster.firstHit(asked.rays[i], asked.filter);
    if (!hit) continue;
    double* const of = numbers.data() + kNumbers * i;
    of[0] = hit->distance;
    std::copy_n(hit->point.data(), 3, of + 1);
    std::copy_n(hit->normal.data(), 3, of + 4);
    entities[i] = hit->entity;
    met.insert(hit->entity);
  }
  const std::size_t ofNumbers = sizeof(double) * numbers.size();
  const std::size_t ofEntities = sizeof(std::uint32_t) * count;
  attachment.resize(ofNumbers + ofEntities);
  std::memcpy(attachment.data(), numbers.data(), ofNumbers);
  std::memcpy(attachment.data() + ofNumbers, entities.data(), ofEntities);
  for (const std::uint32_t id : met) *reply.add_met() = entityMet(scene, snapshot, id);
}

}  // namespace

AskedOrError raysFrom(const v1::RayQuery& query, const scene::Snapshot& snapshot,
                      const ServerLimits& limits) {
  if (query.has_scan() == (query.rays_size() > 0)) {
    return bad("rays", ": give either rays or a scan");
  }
  if (query.has_scan() && query.only_blocked()) {
    return bad("rays.only_blocked", ": a scan tells distances; ask for rays instead");
  }
  AskedOrError asked =
      query.has_scan() ? scanned(query.scan(), snapshot, limits) : listed(query, limits);
  auto* rays = std::get_if<AskedRays>(&asked);
  if (!rays) return asked;
  rays->filter.throughGlass = query.through_glass();
  rays->onlyBlocked = query.only_blocked();
  rays->packed = query.packed() && !query.only_blocked();
  if (!query.through_avatar().empty()) {
    const scene::AvatarView* avatar = avatarNamed(snapshot, query.through_avatar());
    if (!avatar) return unknownAvatar(query.through_avatar(), "rays.through_avatar");
    rays->filter.through = avatar->id;
  }
  return asked;
}

v1::RayReply answerOf(const AskedRays& asked, const scene::RayCaster& caster,
                      const scene::Scene& scene, const scene::Snapshot& snapshot,
                      std::vector<std::uint8_t>& attachment) {
  v1::RayReply reply;
  reply.set_tick(snapshot.tick);
  reply.set_time(snapshot.time);
  reply.set_columns(asked.columns);
  reply.set_rows(asked.rows);
  if (asked.columns > 0) {
    castScan(asked, caster, attachment);
    return reply;
  }
  if (asked.packed) {
    castPacked(asked, caster, scene, snapshot, reply, attachment);
    return reply;
  }
  for (const scene::Ray& ray : asked.rays) {
    v1::RayHit& message = *reply.add_hits();
    if (asked.onlyBlocked) {
      message.set_met(caster.isBlocked(ray, asked.filter));
    } else if (const auto hit = caster.firstHit(ray, asked.filter)) {
      fill(message, *hit);
      message.set_name(nameOf(scene, snapshot, hit->entity));
    }
  }
  return reply;
}

}  // namespace enfilade::server
