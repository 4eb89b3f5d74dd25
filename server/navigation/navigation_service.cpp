#include "server/navigation/navigation_service.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>
#include <random>
#include <span>
#include <string>

#include "scene/navigation/doors.hpp"
#include "scene/navigation/mesh/saved_meshes.hpp"
#include "scene/navigation/walk/shape_separation.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/island_answer.hpp"
#include "server/navigation/map_format.hpp"
#include "server/navigation/path_answer.hpp"
#include "server/navigation/query_fields.hpp"
#include "server/navigation/shared_meshes.hpp"

namespace enfilade::server {
namespace {

using scene::Vec3;

constexpr std::size_t kMaxEntries = 8;         // sizes whose meshes are kept
constexpr std::size_t kMaxClosedDoors = 64;    // states of bodies whose closed doors are known
constexpr std::size_t kMaxIslandAreas = 1000;  // in a reply
// Of a world. Beyond, those of avatars that left are forgotten.
constexpr std::size_t kMaxKeptPaths = 10'000;

/// Writes the answers to one query into its reply.
struct Answer {
  const scene::Scene& scene;
  scene::Navigation& navigation;
  v1::NavigationReply& reply;
  const NavigationState& state;
  bool doorsOpen;
  const scene::Snapshot& meshSnapshot;  ///< the poses of bodies that the meshes have
  /// The same with open doors; builds meshes at the first call. Only if there are doors.
  std::function<scene::Navigation&()> withOpenDoors;
  std::function<scene::Navigation&()> asTheyAre;  ///< the same with doors as they are
  std::optional<scene::EntityIndex>& lazyIndex;
  const std::shared_ptr<const scene::Scene>& shared;
  const PathPlaces& places;  ///< of a path query
  ClosedDoors& closedDoors;

  scene::EntityIndex& index() const {
    if (!lazyIndex) lazyIndex.emplace(shared);
    return *lazyIndex;
  }

  std::variant<Vec3, v1::Error> resolve(const QueryPlace& place, const v1::NavigationPlace& given,
                                        const std::string& field,
                                        const std::optional<Vec3>& start = std::nullopt) const {
    if (const auto* point = std::get_if<Vec3>(&place)) return *point;
    if (const auto found = findPlaceIn(navigation, doorsOpen ? nullptr : withOpenDoors,
                                       std::get<std::vector<scene::NamedPlace>>(place), start))
      return *found;
    return makeNavigationError(field + ".name", "there is no free place at '" + given.name() + "'",
                               v1::ERROR_REFUSED_COMMAND);
  }

  void addSpot(const std::optional<Vec3>& place) const {
    v1::NavigationSpot& spot = *reply.add_spots();
    spot.set_found(place.has_value());
    if (!place) return;
    *spot.mutable_at() = toProto(*place);
    if (const auto island = navigation.findIsland(*place)) spot.set_island(*island);
  }

  PathAnswer paths() const {
    return {scene,           navigation,
            *state.snapshot, state.settings,
            doorsOpen,       withOpenDoors,
            asTheyAre,       [this]() -> scene::EntityIndex& { return index(); },
            closedDoors,     state.progress};
  }

  std::optional<v1::Error> operator()(const v1::NavigationQuery::Path& query) const {
    const scene::PathOptions options{query.max_drop(), query.lifts()};
    const auto from = resolve(places.from, query.from(), "path.from");
    if (const auto* error = std::get_if<v1::Error>(&from)) return *error;
    PathAnswer means = paths();
    if (query.keep() && state.keptPaths) {
      KeptPaths& kept = *state.keptPaths;
      if (kept.size() >= kMaxKeptPaths)
        std::erase_if(kept,
                      [&](const auto& one) { return !findAvatar(*state.snapshot, one.first); });
      means.kept = &kept[query.from().avatar()];
    }
    for (int i = 0; i < query.to_size(); ++i) {
      const auto to = resolve(places.to[static_cast<std::size_t>(i)], query.to(i),
                              "path.to[" + std::to_string(i) + "]", std::get<Vec3>(from));
      if (const auto* error = std::get_if<v1::Error>(&to)) return *error;
      writePath(means, std::get<Vec3>(from), std::get<Vec3>(to), options,
                {query.narrowest(), query.steps()}, *reply.add_paths());
    }
    return std::nullopt;
  }

  std::optional<v1::Error> operator()(const v1::NavigationQuery::Random& query) const {
    if (auto error = validateCount("random.count", query.count(), 10'000)) return error;
    scene::RandomPlace wanted;
    if (query.has_near()) {
      if (auto error = validatePoint("random.near", query.near())) return error;
      if (auto error = validateNumber("random.max_distance", query.max_distance(), 1e-3, 1e5))
        return error;
      wanted.near = vectorFromProto(query.near());
      wanted.maxDistance = query.max_distance();
    }
    if (query.has_away_from()) {
      if (auto error = validatePoint("random.away_from", query.away_from())) return error;
      if (auto error = validateNumber("random.min_distance", query.min_distance(), 0, 1e5))
        return error;
      wanted.awayFrom = vectorFromProto(query.away_from());
      wanted.minDistance = query.min_distance();
    }
    if (query.has_island()) wanted.island = query.island();
    std::mt19937_64 random(query.seed());
    for (std::uint32_t i = 0; i < query.count(); ++i)
      addSpot(navigation.findRandomPlace(random, wanted));
    return std::nullopt;
  }

  std::optional<v1::Error> operator()(const v1::NavigationQuery::Snap& query) const {
    if (auto error = validateCount("snap.points", query.points_size(), 10'000)) return error;
    if (auto error = validateNumber("snap.max_distance", query.max_distance(), 0, 100))
      return error;
    scene::SnapTarget wanted;
    wanted.isDrawn = query.drawn();
    wanted.extents = query.has_extents() ? vectorFromProto(query.extents())
                                         : Vec3(Vec3::Constant(query.max_distance()));
    if (query.has_extents() &&
        !((wanted.extents.array() >= 0).all() && (wanted.extents.array() <= 100).all()))
      return makeNavigationError("snap.extents", "give 0 to 100 m");
    if (query.has_island()) wanted.island = query.island();
    const bool isAny = !query.has_island() && !query.drawn() && !query.has_extents();
    for (int i = 0; i < query.points_size(); ++i) {
      const std::string field = "snap.points[" + std::to_string(i) + "]";
      if (auto error = validatePoint(field, query.points(i))) return error;
      const Vec3 point = vectorFromProto(query.points(i));
      addSpot(isAny ? navigation.snap(point, query.max_distance())
                    : navigation.snapTo(point, wanted));
    }
    return std::nullopt;
  }

  std::optional<v1::Error> operator()(const v1::NavigationQuery::Steps& query) const {
    if (auto error = validateCount("steps.steps", query.steps_size(), 1000)) return error;
    for (int i = 0; i < query.steps_size(); ++i) {
      const std::string field = "steps.steps[" + std::to_string(i) + "].";
      const auto& step = query.steps(i);
      if (auto error = validatePoint(field + "from", step.from())) return error;
      if (auto error = validatePoint(field + "to", step.to())) return error;
      addSpot(navigation.tryStep(vectorFromProto(step.from()), vectorFromProto(step.to()),
                                 !query.stop()));
    }
    return std::nullopt;
  }

  std::optional<v1::Error> operator()(const v1::NavigationQuery::Clearance& query) const {
    if (auto error = validateCount("clearance.points", query.points_size(), 1000)) return error;
    if (auto error = validateNumber("clearance.max_distance", query.max_distance(), 0.1, 20))
      return error;
    for (int i = 0; i < query.points_size(); ++i) {
      const std::string field = "clearance.points[" + std::to_string(i) + "]";
      if (auto error = validatePoint(field, query.points(i))) return error;
      const auto found =
          navigation.findObstacle(vectorFromProto(query.points(i)), query.max_distance());
      v1::NavigationReply::Obstacle& obstacle = *reply.add_obstacles();
      obstacle.set_found(found.has_value());
      if (!found) continue;
      obstacle.set_distance(found->distance);
      obstacle.set_entity(found->entity);
      obstacle.set_name(navigation.findEntityName(found->entity));
      if (found->entity != 0) addClosestPoint(vectorFromProto(query.points(i)), obstacle);
    }
    return std::nullopt;
  }

  void addClosestPoint(const Vec3& place, v1::NavigationReply::Obstacle& obstacle) const {
    const auto standing = navigation.snap(place, 0);
    const auto separation = scene::computeSeparationFromShape(
        index(), meshSnapshot, scene::makeThinShape(state.settings, navigation.agent()),
        scene::placeThinShape(state.settings, standing.value_or(place)), obstacle.entity());
    if (!separation) return;
    *obstacle.mutable_point() = toProto(separation->pointB);
    *obstacle.mutable_normal() = toProto(Vec3(-separation->normal));
  }

  std::optional<v1::Error> operator()(const v1::NavigationQuery::Islands& query) const {
    if (auto error = validateCount("islands.count", query.count(), 50)) return error;
    writeIslands(paths(), query.count(), reply);
    return std::nullopt;
  }

  std::optional<v1::Error> writeMap(const v1::NavigationQuery::Map& query,
                                    std::vector<std::uint8_t>& attachment) const {
    if (auto error = validateNumber("map.cell", query.cell(), 0.01, 10)) return error;
    if (auto error = validateNumber("map.height", query.height(), -1e7, 1e7)) return error;
    const double tolerance = query.has_tolerance() ? query.tolerance() : scene::kMapTolerance;
    if (auto error = validateNumber("map.tolerance", tolerance, 0, 100)) return error;
    if (!v1::NavigationQuery::Map::Format_IsValid(query.format()))
      return makeNavigationError("map.format", "give BYTES, BITS or PNG");
    try {
      scene::NavigationMap map = navigation.drawMap(query.cell(), query.height(), tolerance);
      *reply.mutable_map_corner() = toProto(map.corner);
      reply.set_map_width(map.width);
      reply.set_map_height(map.height);
      attachment = encodeMap(std::move(map), query.format());
    } catch (const std::invalid_argument& error) {
      return makeNavigationError("map.cell", error.what(), v1::ERROR_TOO_LARGE);
    }
    return std::nullopt;
  }
};

std::vector<std::uint8_t> encodeTriangles(const std::vector<Vec3>& corners) {
  static_assert(std::endian::native == std::endian::little);
  std::vector<std::uint8_t> bytes(corners.size() * 3 * sizeof(double));
  for (std::size_t i = 0; i < corners.size(); ++i)
    std::memcpy(&bytes[i * 3 * sizeof(double)], corners[i].data(), 3 * sizeof(double));
  return bytes;
}

void addReport(scene::Navigation& navigation, v1::NavigationReply& reply) {
  const scene::NavigationReport report = navigation.report();
  reply.set_navigable_area(report.area);
  reply.set_build_seconds(report.seconds);
  reply.set_mesh_bytes(report.bytes);
  reply.set_island_count(static_cast<std::uint32_t>(report.islandAreas.size()));
  const std::size_t count = std::min(report.islandAreas.size(), kMaxIslandAreas);
  reply.mutable_island_areas()->Add(
      report.islandAreas.begin(), report.islandAreas.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

NavigationService::Entry& NavigationService::prepare(const scene::NavigationAgent& agent,
                                                     bool doorsOpen, const NavigationState& state) {
  const auto known = std::ranges::find_if(entries_, [&](const Entry& entry) {
    return entry.agent == agent && entry.doorsOpen == doorsOpen && entry.settings == state.settings;
  });
  const auto snapshot = makeMeshSnapshot(doorsOpen, state);
  if (known != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, known);
    const std::size_t built = known->navigation->update(*snapshot, 2, state.progress);
    if (built > 0 && known->closedDoors.size() >= kMaxClosedDoors) known->closedDoors.clear();
    known->snapshot = snapshot;
    return *known;
  }
  auto navigation =
      makeNavigation({scene_, state.settings, agent, doorsOpen, snapshot}, state.progress);
  keep({agent, state.settings, doorsOpen, snapshot, std::move(navigation), {}});
  return entries_.front();
}

std::shared_ptr<const scene::Snapshot> NavigationService::makeMeshSnapshot(
    bool doorsOpen, const NavigationState& state) {
  if (!doorsOpen) return state.snapshot;
  if (!openDoors_ || openDoorsSettings_ != state.settings) {
    openDoors_ = scene::makeSnapshotWithOpenDoors(scene_, state.settings);
    openDoorsSettings_ = state.settings;
  }
  return std::make_shared<const scene::Snapshot>(
      scene::takeDoors(*scene_, *state.snapshot, *openDoors_));
}

void NavigationService::keep(Entry entry) {
  entries_.push_front(std::move(entry));
  if (entries_.size() > kMaxEntries) entries_.pop_back();
}

std::optional<v1::Error> NavigationService::load(const scene::NavigationAgent& agent,
                                                 bool doorsOpen, const NavigationState& state,
                                                 const std::string& mesh) {
  try {
    auto navigation = std::make_unique<scene::Navigation>(
        scene_, state.settings, agent,
        std::span(reinterpret_cast<const std::uint8_t*>(mesh.data()), mesh.size()), 2,
        state.progress);
    const auto snapshot = makeMeshSnapshot(doorsOpen, state);
    const std::size_t rebuilt = navigation->update(*snapshot, 2, state.progress);
    logInfo("navigation: loaded meshes for radius {} m, height {} m; {} tiles built again",
            agent.radius, agent.height, rebuilt);
    std::erase_if(entries_, [&](const Entry& entry) {
      return entry.agent == agent && entry.doorsOpen == doorsOpen &&
             entry.settings == state.settings;
    });
    keep({agent, state.settings, doorsOpen, snapshot, std::move(navigation), {}});
    return std::nullopt;
  } catch (const scene::MeshFileError& error) {
    return makeNavigationError("load_mesh.mesh", error.what());
  }
}

std::variant<v1::NavigationReply, v1::Error> NavigationService::answer(
    const v1::NavigationQuery& query, const NavigationState& state,
    std::vector<std::uint8_t>& attachment) {
  scene::NavigationAgent agent;
  if (query.has_radius()) agent.radius = query.radius();
  if (query.has_height()) agent.height = query.height();
  if (query.has_speed()) agent.speed = query.speed();
  if (auto error = validateNumber("radius", agent.radius, 0.05, 5)) return std::move(*error);
  if (auto error = validateNumber("height", agent.height, 0.2, 10)) return std::move(*error);
  if (auto error = validateNumber("speed", agent.speed, 0.01, 20)) return std::move(*error);
  if (query.query_case() == v1::NavigationQuery::QUERY_NOT_SET)
    return makeNavigationError(
        "query",
        "give path, random, snap, steps, clearance, map, islands, mesh, save_mesh or load_mesh");
  PathPlaces places;
  if (query.has_path()) {  // before the meshes, whose building takes long
    auto found = findPathPlaces(query.path(), *scene_, *state.snapshot, agent.radius);
    if (auto* error = std::get_if<v1::Error>(&found)) return std::move(*error);
    places = std::move(std::get<PathPlaces>(found));
  }
  const bool doorsOpen = query.doors() == v1::NavigationQuery::DOORS_OPEN;
  if (query.has_load_mesh())
    if (auto error = load(agent, doorsOpen, state, query.load_mesh().mesh()))
      return std::move(*error);
  Entry& entry = prepare(agent, doorsOpen, state);
  scene::Navigation& navigation = *entry.navigation;
  v1::NavigationReply reply;
  reply.set_tick(state.snapshot->tick);
  reply.set_time(state.snapshot->time);
  const auto withDoors = [&](bool open) {
    return [&, open]() -> scene::Navigation& { return *prepare(agent, open, state).navigation; };
  };
  std::function<scene::Navigation&()> withOpenDoors;
  if (scene::hasDoors(*scene_)) withOpenDoors = withDoors(true);
  const Answer answer{*scene_,       navigation,       reply,
                      state,         doorsOpen,        *entry.snapshot,
                      withOpenDoors, withDoors(false), index_,
                      scene_,        places,           entry.closedDoors[navigation.stateNumber()]};
  std::optional<v1::Error> error;
  switch (query.query_case()) {
    case v1::NavigationQuery::kPath:
      error = answer(query.path());
      break;
    case v1::NavigationQuery::kRandom:
      error = answer(query.random());
      break;
    case v1::NavigationQuery::kSnap:
      error = answer(query.snap());
      break;
    case v1::NavigationQuery::kSteps:
      error = answer(query.steps());
      break;
    case v1::NavigationQuery::kClearance:
      error = answer(query.clearance());
      break;
    case v1::NavigationQuery::kIslands:
      error = answer(query.islands());
      break;
    case v1::NavigationQuery::kMap:
      error = answer.writeMap(query.map(), attachment);
      break;
    case v1::NavigationQuery::kMesh:
      attachment = encodeTriangles(navigation.collectTriangles(
          query.mesh().has_island() ? std::optional(query.mesh().island()) : std::nullopt));
      break;
    case v1::NavigationQuery::kSaveMesh:
      attachment = navigation.save();
      break;
    case v1::NavigationQuery::kLoadMesh:
    case v1::NavigationQuery::QUERY_NOT_SET:
      break;
  }
  if (error) return std::move(*error);
  addReport(navigation, reply);
  return reply;
}

}  // namespace enfilade::server
