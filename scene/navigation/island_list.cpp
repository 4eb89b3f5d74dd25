#include "scene/navigation/island_list.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include "scene/base/disjoint_sets.hpp"
#include "scene/navigation/mesh/polygon_sampler.hpp"
#include "scene/navigation/walk/grid_search.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kMaxCentres = 8;        // polygons of an island whose centre is tried
constexpr int kMaxTrials = 64;                // further places of an island that are tried
constexpr double kMinDrawnArea = 1;           // square metres
constexpr double kBelowRoof = 1;              // metres: a floor below is lower by more
constexpr double kBesideFloor = 1;            // metres: walls and furniture interrupt floors below
constexpr std::size_t kMaxSearchFrom = 2000;  // polygons of an island whose neighbours are sought

using Polygons = std::vector<std::uint32_t>;

/// The polygons of each island, the largest polygon first.
std::vector<Polygons> listPolygons(const NavigationMesh& mesh,
                                   const std::vector<std::uint32_t>& numberOf) {
  std::vector<Polygons> lists;
  for (std::uint32_t polygon = 0; polygon < numberOf.size(); ++polygon) {
    if (numberOf[polygon] >= lists.size()) lists.resize(numberOf[polygon] + 1);
    lists[numberOf[polygon]].push_back(polygon);
  }
  for (Polygons& list : lists)
    std::ranges::stable_sort(list, std::greater(),
                             [&](std::uint32_t polygon) { return mesh.polygonArea(polygon); });
  return lists;
}

/// A place on an island where an agent stands: at the centre of a large polygon, or else anywhere,
/// uniform in area.
std::optional<Vec3> findStand(const NavigationMesh& mesh, Walker& walker,
                              const Polygons& polygons) {
  const auto stand = [&](const Vec3& point) {
    return standAt(walker, point + Vec3(0, kHeightError, 0), 2 * kHeightError);
  };
  for (std::size_t i = 0; i < std::min(kMaxCentres, polygons.size()); ++i)
    if (const auto place = stand(mesh.centre(polygons[i]))) return place;
  PolygonSampler sampler;
  for (const std::uint32_t polygon : polygons) sampler.add(mesh, polygon);
  std::mt19937_64 random(1);
  for (int i = 0; i < kMaxTrials; ++i)
    if (const auto place = stand(sampler.draw(mesh, random))) return place;
  return std::nullopt;
}

/// Whether a floor of another island lies below a polygon, or below a place close to it. Floors
/// under the sky do not count.
bool isAboveFloor(const NavigationMesh& mesh, const std::vector<std::uint32_t>& numberOf,
                  std::uint32_t polygon, double bottom) {
  const Vec3& centre = mesh.centre(polygon);
  const double half = 0.5 * (centre.y() - kBelowRoof - bottom);
  if (!(half > 0)) return false;
  return std::ranges::any_of(mesh.findPolygons({centre.x(), bottom + half, centre.z()},
                                               {kBesideFloor, half, kBesideFloor}),
                             [&](std::uint32_t below) {
                               return numberOf[below] != kNoIsland &&
                                      numberOf[below] != numberOf[polygon] &&
                                      !mesh.isUnderSky(below) &&
                                      mesh.centre(below).y() < centre.y() - kBelowRoof;
                             });
}

bool isRoof(const NavigationMesh& mesh, const std::vector<std::uint32_t>& numberOf,
            const Polygons& polygons, double area, double bottom) {
  double open = 0, aboveFloor = 0;
  for (const std::uint32_t polygon : polygons)
    if (mesh.isUnderSky(polygon)) open += mesh.polygonArea(polygon);
  if (!(open > 0.5 * area)) return false;
  for (const std::uint32_t polygon : polygons)
    if (mesh.isUnderSky(polygon) && isAboveFloor(mesh, numberOf, polygon, bottom))
      aboveFloor += mesh.polygonArea(polygon);
  return aboveFloor > 0.5 * area;
}

/// Prefers islands that are large and no roofs, but always takes some.
void chooseDrawn(std::vector<Island>& islands) {
  const auto choose = [&](const auto& isWanted) {
    bool any = false;
    for (Island& island : islands) any |= island.isDrawn = isWanted(island);
    return any;
  };
  if (choose([](const Island& one) { return !one.isRoof && one.area >= kMinDrawnArea; })) return;
  if (choose([](const Island& one) { return !one.isRoof; })) return;
  choose([](const Island&) { return true; });
}

}  // namespace

IslandList collectIslands(const NavigationMesh& mesh, Walker& walker, const Aabb& bounds) {
  IslandList list;
  list.numberOf = mesh.findIslands();
  std::vector<Polygons> kept;
  for (Polygons& polygons : listPolygons(mesh, list.numberOf)) {
    const auto place = findStand(mesh, walker, polygons);
    const auto number = place ? static_cast<std::uint32_t>(kept.size()) : kNoIsland;
    double area = 0;
    for (const std::uint32_t polygon : polygons) {
      list.numberOf[polygon] = number;
      area += mesh.polygonArea(polygon);
    }
    if (!place) continue;
    list.islands.push_back({.area = area, .place = *place});
    kept.push_back(std::move(polygons));
  }
  for (std::size_t i = 0; i < kept.size(); ++i)
    list.islands[i].isRoof =
        isRoof(mesh, list.numberOf, kept[i], list.islands[i].area, bounds.min.y());
  return list;
}

void joinIslands(IslandList& list, const ConnectionList& connections) {
  DisjointSets joined(list.islands.size());
  std::set<std::pair<std::uint32_t, std::uint32_t>> joins;  // of islands, in one direction
  for (const OffMeshConnection& connection : connections.connections)
    joins.emplace(list.numberOf[connection.fromPolygon], list.numberOf[connection.toPolygon]);
  for (const auto& [from, to] : joins) {
    if (from >= to || !joins.contains({to, from})) continue;
    joined.unite(from, to);
  }
  std::vector<std::uint32_t> order;  // of the islands that remain, the largest first
  for (std::uint32_t number = 0; number < list.islands.size(); ++number) {
    const std::uint32_t first = joined.find(number);
    if (first == number) {
      order.push_back(number);
      continue;
    }
    Island& whole = list.islands[first];
    whole.area += list.islands[number].area;
    whole.isRoof = whole.isRoof && list.islands[number].isRoof;
  }
  std::ranges::stable_sort(order, std::greater(),
                           [&](std::uint32_t number) { return list.islands[number].area; });
  std::vector<Island> islands;
  std::vector<std::uint32_t> rank(list.islands.size());
  for (const std::uint32_t number : order) {
    rank[number] = static_cast<std::uint32_t>(islands.size());
    islands.push_back(list.islands[number]);
  }
  for (std::uint32_t& number : list.numberOf)
    if (number != kNoIsland) number = rank[joined.find(number)];
  list.islands = std::move(islands);
  chooseDrawn(list.islands);
}

std::vector<IslandNeighbour> findNeighbours(const NavigationMesh& mesh, const IslandList& list,
                                            std::uint32_t number, double reach,
                                            double heightReach) {
  Polygons own;
  for (std::uint32_t polygon = 0; polygon < list.numberOf.size(); ++polygon)
    if (list.numberOf[polygon] == number) own.push_back(polygon);
  std::map<std::uint32_t, IslandNeighbour> found;
  const std::size_t stride = 1 + own.size() / kMaxSearchFrom;
  for (std::size_t i = 0; i < own.size(); i += stride) {
    const Vec3& centre = mesh.centre(own[i]);
    double radius = 0;
    for (const Portal& portal : mesh.portals(own[i]))
      radius = std::max(radius, computeGroundDistance(centre, portal.middle()));
    radius = std::max(radius, std::sqrt(mesh.polygonArea(own[i])));
    const Vec3 extent(radius + reach, heightReach, radius + reach);
    for (const std::uint32_t other : mesh.findPolygons(centre, extent)) {
      const std::uint32_t to = list.numberOf[other];
      if (to == number || to == kNoIsland) continue;
      IslandNeighbour near{to, 0, mesh.closestPoint(own[i], mesh.closestPoint(other, centre)), {}};
      near.to = mesh.closestPoint(other, near.from);
      near.distance = computeGroundDistance(near.from, near.to);
      if (near.distance > reach || std::abs(near.from.y() - near.to.y()) > heightReach) continue;
      const auto [known, isNew] = found.try_emplace(to, near);
      if (!isNew && near.distance < known->second.distance) known->second = near;
    }
  }
  std::vector<IslandNeighbour> neighbours;
  for (const auto& [to, near] : found) neighbours.push_back(near);
  std::ranges::stable_sort(neighbours, {}, &IslandNeighbour::distance);
  return neighbours;
}

std::optional<std::uint32_t> findIslandAt(const NavigationMesh& mesh, const IslandList& list,
                                          Walker& walker, const Vec3& place) {
  const double reach = 2 * walker.agent().radius;
  constexpr double kOnMesh = 0.02;        // metres
  constexpr double kReturnHeight = 0.05;  // metres: the walk back comes to the same floor
  struct Near {
    double distance;
    Vec3 point;
    std::uint32_t number;
  };
  std::vector<Near> nearby;
  for (const std::uint32_t polygon : mesh.findPolygons(place, {reach, kHeightError, reach})) {
    const Vec3 point = mesh.closestPoint(polygon, place);
    if (std::abs(point.y() - place.y()) <= kHeightError)
      nearby.push_back({(point - place).norm(), point, list.numberOf[polygon]});
  }
  std::ranges::stable_sort(nearby, {}, &Near::distance);
  const auto getNumber = [](const Near& near) {
    return near.number == kNoIsland ? std::nullopt : std::optional(near.number);
  };
  if (nearby.empty()) return std::nullopt;
  if (computeGroundDistance(nearby.front().point, place) <= kOnMesh)
    return getNumber(nearby.front());
  const auto standing = standAt(walker, place);
  if (!standing) return std::nullopt;
  for (const Near& near : nearby)
    if (walks(walker, *standing, near.point, kHeightError) &&
        walks(walker, walker.footPosition(), *standing, kReturnHeight))
      return getNumber(near);
  return std::nullopt;
}

}  // namespace enfilade::scene
