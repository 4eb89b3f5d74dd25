// Benchmark of navigation: avatars go between random places as clients' avatars do, through closed
// doors, by lifts and over edges. The time of a path with its proof, and its islands and lengths
// against a flood fill and Detour's lines.
//
//   navigation_bench [--quick] [--pairs N] [--places N] [--only PART] [--out FILE] SCENE..
//
// SCENE may end in @METRES_PER_UNIT. PART: times, fill, lengths or walks.
// A path counts as wrong if its walk is blocked, leaves the scene or penetrates anything. FILE gets
// a JSON line per scene and part.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "scene/import/import_worker.hpp"
#include "scene/navigation/doors.hpp"
#include "scene/navigation/mesh/off_mesh_connections.hpp"
#include "scene/navigation/walk/stand.hpp"
#include "scene/navigation/walk/walker.hpp"
#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/world.hpp"
#include "server/base/load_scene.hpp"
#include "server/messages/order_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/go_order.hpp"
#include "server/navigation/navigation_service.hpp"
#include "tests/benchmarks/flood_fill.hpp"
#include "tests/benchmarks/measurement.hpp"

namespace {

using namespace enfilade;
using namespace enfilade::benchmarks;
using scene::Vec3;

constexpr int kMaxTicks = 60 * 3600;  // an hour
constexpr int kRestTicks = 10;        // of an avatar that was placed some millimetres above a floor
constexpr double kNearWidth = 0.005;  // metres of radius
constexpr int kWalksOfWorld = 25;     // then doors and lifts are again as in the file
constexpr double kMinCompared = 1;    // metres: of a shorter way, millimetres would count
constexpr double kLongShare = 1.02;   // of the length of another way

bool isLong(double share) {
  return share > kLongShare;
}

struct Effort {
  int pairs = 10'000;
  int compared = 1000;             ///< pairs per kind that are compared with a flood fill
  int lengths = 1000;              ///< pairs of which lengths are compared with a flood fill
  std::size_t places = 4'000'000;  ///< limit of a flood fill: 1,600 square metres
  std::string only;                ///< part; "": all
};

struct Bench {
  std::shared_ptr<const scene::Scene> scene;
  server::NavigationService service;
  scene::World atRest;  ///< never ticks

  v1::NavigationReply ask(const v1::NavigationQuery& query, const scene::World& world) {
    std::vector<std::uint8_t> attachment;
    const auto answer = service.answer(query, {world.snapshot(), world.settings()}, attachment);
    if (const auto* error = std::get_if<v1::Error>(&answer))
      throw std::runtime_error(error->message());
    return std::get<v1::NavigationReply>(answer);
  }

  /// Places to stand, at most 10,000; of an island, or of those that are drawn from.
  std::vector<Vec3> drawPlaces(int count, std::uint64_t seed, v1::NavigationQuery::Doors doors,
                               std::optional<std::uint32_t> island = std::nullopt) {
    v1::NavigationQuery query;
    query.set_doors(doors);
    query.mutable_random()->set_count(static_cast<std::uint32_t>(count));
    query.mutable_random()->set_seed(seed);
    if (island) query.mutable_random()->set_island(*island);
    std::vector<Vec3> places;
    const v1::NavigationReply reply = ask(query, atRest);
    for (const v1::NavigationSpot& spot : reply.spots())
      if (spot.found()) places.push_back(server::vectorFromProto(spot.at()));
    return places;
  }

  /// nullopt: on none.
  std::array<std::optional<std::uint32_t>, 2> findIslands(const std::array<Vec3, 2>& places) {
    v1::NavigationQuery query;
    query.set_doors(v1::NavigationQuery::DOORS_AS_THEY_ARE);
    for (const Vec3& place : places) *query.mutable_snap()->add_points() = server::toProto(place);
    const v1::NavigationReply reply = ask(query, atRest);
    std::array<std::optional<std::uint32_t>, 2> islands;
    for (int i = 0; i < 2; ++i)
      if (reply.spots(i).has_island())
        islands[static_cast<std::size_t>(i)] = reply.spots(i).island();
    return islands;
  }

  v1::NavigationPath findPath(const Vec3& from, const Vec3& to, v1::NavigationQuery::Doors doors) {
    v1::NavigationQuery query;
    query.set_doors(doors);
    *query.mutable_path()->mutable_from()->mutable_point() = server::toProto(from);
    *query.mutable_path()->add_to()->mutable_point() = server::toProto(to);
    return ask(query, atRest).paths(0);
  }
};

struct Walked {
  bool isFound = false, isArrived = false;
  bool isRefused = false;  ///< the start, in a scene with doors: one may stand there
  double penetration = 0;
  std::string text;
  bool hasDoors = false, hasLifts = false, hasDrops = false;  ///< on the path
};

/// The ways of an order Go: all that there are, or walks alone, through doors as they are. In a
/// sixth of the first, the avatar may fall by up to 2 m.
enum class GoKind : std::uint8_t { all, walks };

Walked go(Bench& bench, scene::World& world, int number, const Vec3& from, const Vec3& to,
          GoKind kind) {
  const std::string name = "walker" + std::to_string(number);
  scene::Spawn spawn;
  spawn.position = from;
  submitAvatarCommand(world, {name, spawn, 0});
  if (kind == GoKind::walks)  // from places on furniture
    for (int tick = 0; tick < kRestTicks; ++tick) tickWorld(world);
  v1::Command command;
  command.set_avatar(name);
  *command.mutable_go()->mutable_to()->mutable_point() = server::toProto(to);
  command.mutable_go()->set_doors(kind == GoKind::all ? v1::NavigationQuery::DOORS_OPEN
                                                      : v1::NavigationQuery::DOORS_AS_THEY_ARE);
  command.mutable_go()->set_lifts(kind == GoKind::all);
  if (kind == GoKind::all && number % 6 == 0) command.mutable_go()->set_max_drop(2);
  Walked walked;
  const auto query = server::makePathQuery(world, command);
  const v1::NavigationReply reply = bench.ask(std::get<v1::NavigationQuery>(query), world);
  for (const v1::NavigationLeg& leg : reply.paths(0).legs()) {
    walked.hasDoors |= leg.kind() == v1::NavigationLeg::KIND_DOOR;
    walked.hasLifts |= leg.kind() == v1::NavigationLeg::KIND_LIFT;
    walked.hasDrops |= leg.kind() == v1::NavigationLeg::KIND_DROP;
  }
  const auto made = server::makeGoOrder(command, reply);
  if (const auto* error = std::get_if<v1::Error>(&made)) {
    walked.text = error->message();
  } else {
    walked.isFound = true;
    auto order = server::commandFromProto(std::get<v1::Command>(made));
    walked.text =
        submitAvatarCommand(world, std::get<scene::Command>(std::move(order))).value_or("");
  }
  for (int tick = 0; tick < kMaxTicks && walked.text.empty() && !walked.isArrived; ++tick) {
    const scene::TickReport report = tickWorld(world);
    walked.penetration = std::max(walked.penetration, report.maxPenetration);
    for (const scene::Notice& notice : report.notices) {
      if (notice.avatar != name) continue;
      using Kind = scene::Notice::Kind;
      walked.isArrived |= notice.kind == Kind::arrived;
      walked.isRefused |=
          notice.kind == Kind::refused && tick == 0 && scene::hasDoors(*bench.scene);
      if (notice.kind == Kind::blocked || notice.kind == Kind::refused || notice.kind == Kind::left)
        walked.text = notice.text + " " + findEntityName(world, notice.obstacle);
    }
  }
  submitAvatarCommand(world, {name, scene::Drive{}, 0});
  submitAvatarCommand(world, {name, scene::Leave{}, 0});
  tickWorld(world);
  return walked;
}

/// Whether a text says what is in the way, and not only that a search ended.
bool hasReason(const std::string& text) {
  return text.size() >= 10 && text.find("within the limits of the search") == std::string::npos;
}

void measureWalks(Bench& bench, const Effort& effort, nlohmann::json& row) {
  const auto starts = bench.drawPlaces(effort.pairs, 1, v1::NavigationQuery::DOORS_OPEN);
  const auto goals = bench.drawPlaces(effort.pairs, 2, v1::NavigationQuery::DOORS_OPEN);
  std::optional<scene::World> world;
  std::map<std::string, int> counts;
  double penetration = 0;
  const std::size_t pairs = std::min(starts.size(), goals.size());
  for (std::size_t i = 0; i < pairs; ++i) {
    if (i % kWalksOfWorld == 0 && (i == 0 || !bench.scene->model().bodies.empty()))
      world.emplace(bench.scene);
    const Walked walked = go(bench, *world, static_cast<int>(i), starts[i], goals[i], GoKind::all);
    penetration = std::max(penetration, walked.penetration);
    counts["without_reason"] += !walked.isFound && !hasReason(walked.text) ? 1 : 0;
    if (walked.isRefused || !walked.isFound) {
      counts["starts_refused"] += walked.isRefused ? 1 : 0;
      continue;
    }
    ++counts["found"];
    counts["walked_doors"] += walked.hasDoors ? 1 : 0;
    counts["walked_lifts"] += walked.hasLifts ? 1 : 0;
    counts["walked_drops"] += walked.hasDrops ? 1 : 0;
    if (walked.isArrived && walked.penetration == 0) continue;
    if (++counts[walked.hasDoors ? "wrong_with_doors" : "wrong"] <= 5)
      std::printf("  wrong: pair %zu, (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g): %s\n", i,
                  starts[i].x(), starts[i].y(), starts[i].z(), goals[i].x(), goals[i].y(),
                  goals[i].z(), walked.text.c_str());
  }
  row["pairs"] = pairs;
  row["max_penetration"] = penetration;
  for (const char* name : {"found", "wrong", "wrong_with_doors", "without_reason", "starts_refused",
                           "walked_doors", "walked_lifts", "walked_drops"})
    row[name] = counts[name];
}

/// The mesh that proposes paths.
scene::NavigationMesh buildMesh(const scene::World& world) {
  const scene::NavigationAgent agent;
  const scene::TileGrid grid = scene::makeTileGrid(world.scene().bounds(), agent);
  std::vector<scene::TileMesh> tiles;
  for (int z = 0; z < grid.tilesZ; ++z)
    for (int x = 0; x < grid.tilesX; ++x)
      tiles.push_back(
          scene::buildTileMesh(world.data(), agent, grid, x, z, scene::Clearance::ample));
  return {grid, std::move(tiles)};
}

/// Detour's line between two places: the corners of the shortest line in a corridor, without a
/// proof. nullopt: the mesh has none.
std::optional<std::vector<Vec3>> findLine(const scene::NavigationMesh& mesh, const Vec3& start,
                                          const Vec3& goal) {
  const Vec3 extent(0.3, 0.5, 0.3);
  const auto from = mesh.findNearest(start, extent), to = mesh.findNearest(goal, extent);
  if (!from || !to) return std::nullopt;
  const auto corridor = mesh.findCorridor(*from, *to);
  if (!corridor) return std::nullopt;
  std::vector<Vec3> line = mesh.straighten(*corridor, from->point, to->point);
  if (line.size() < 2) return std::nullopt;
  line.front() = start;
  line.back() = goal;
  return line;
}

/// Microseconds of each query of the mesh that finds a line.
std::vector<double> timeMeshQueries(const scene::NavigationMesh& mesh,
                                    const std::vector<Vec3>& starts,
                                    const std::vector<Vec3>& goals) {
  std::vector<double> times;
  for (std::size_t i = 0; i < std::min(starts.size(), goals.size()); ++i) {
    const auto start = Clock::now();
    const bool isLine = findLine(mesh, starts[i], goals[i]).has_value();
    const double seconds = measureSecondsSince(start);
    if (isLine) times.push_back(1e6 * seconds);
  }
  return times;
}

void measureTimes(Bench& bench, const Effort& effort, nlohmann::json& row) {
  const auto doors = v1::NavigationQuery::DOORS_AS_THEY_ARE;
  const int count = std::min(effort.pairs, 2000);
  const auto starts = bench.drawPlaces(count, 3, doors), goals = bench.drawPlaces(count, 4, doors);
  std::vector<double> found, notFound;
  for (std::size_t i = 0; i < std::min(starts.size(), goals.size()); ++i) {
    const auto start = Clock::now();
    const bool isFound = bench.findPath(starts[i], goals[i], doors).found();
    (isFound ? found : notFound).push_back(1e6 * measureSecondsSince(start));
  }
  row["mesh_us"] =
      toJsonNumber(computeQuantile(timeMeshQueries(buildMesh(bench.atRest), starts, goals), 0.5));
  row["median_us"] = toJsonNumber(computeQuantile(found, 0.5));
  row["p99_us"] = toJsonNumber(computeQuantile(found, 0.99));
  row["not_found_p99_us"] = toJsonNumber(computeQuantile(notFound, 0.99));
}

/// Places on islands that are drawn from, and some on each of the 20 largest islands.
std::vector<Vec3> drawAnywhere(Bench& bench, int count) {
  const auto doors = v1::NavigationQuery::DOORS_AS_THEY_ARE;
  std::vector<Vec3> places = bench.drawPlaces(count, 5, doors);
  v1::NavigationQuery query;
  query.mutable_islands()->set_count(20);
  const int islands = bench.ask(query, bench.atRest).islands_size();
  for (int island = 0; island < islands; ++island)
    for (const Vec3& place : bench.drawPlaces(count / 20, 6, doors, island))
      places.push_back(place);
  return places;
}

struct Comparison {
  int compared = 0, skipped = 0;
  int wrong = 0;
  int nearWidth = 0;     ///< half a centimetre of the radius decides
  int walked = 0;        ///< an avatar walks the path; the fill does not have it
  int islandsWrong = 0;  ///< paths are found between two islands both ways, or none on one
};

/// Whether a fill connects two places; nullopt: not known.
std::optional<bool> isConnected(const FloodFill& fill, const Vec3& from, const Vec3& to) {
  const auto a = fill.findComponent(from), b = fill.findComponent(to);
  if (!a || !b) return std::nullopt;
  if (a->number == b->number) return true;
  if (!a->isWhole || !b->isWhole) return std::nullopt;
  return false;
}

/// A pair of places for which a path is found and the fill does not connect them, or the other way
/// round.
struct Disagreement {
  Vec3 from, to;
  bool isFound;
  std::string reason;
};

void comparePair(Bench& bench, const FloodFill& fill, const Vec3& from, const Vec3& to,
                 Comparison& result, std::vector<Disagreement>& disagreements) {
  const auto expected = isConnected(fill, from, to);
  if (!expected) {
    ++result.skipped;
    return;
  }
  ++result.compared;
  const v1::NavigationPath path = bench.findPath(from, to, v1::NavigationQuery::DOORS_AS_THEY_ARE);
  const auto islands = bench.findIslands({from, to});
  const bool isOneIsland = islands[0] == islands[1];
  const auto isFoundBack = [&] {  // where none is, the way only leads down
    return bench.findPath(to, from, v1::NavigationQuery::DOORS_AS_THEY_ARE).found();
  };
  if (islands[0] && islands[1] && path.found() != isOneIsland && (isOneIsland || isFoundBack()) &&
      ++result.islandsWrong <= 5)
    std::printf("  islands: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g): path %d\n", from.x(),
                from.y(), from.z(), to.x(), to.y(), to.z(), path.found());
  if (path.found() != *expected) disagreements.push_back({from, to, path.found(), path.reason()});
}

/// Counts disagreements. Components have no direction, but an avatar may get down where it does not
/// get up. An avatar that walks the path decides, or the fill of the start alone, by walks. A pair
/// is near if a thinner avatar passes where a path was found, or a wider one does not where none
/// was. It is also near if two shifted grids differ.
void judge(Bench& bench, const std::vector<Vec3>& places, std::size_t maxPlaces,
           const std::vector<Disagreement>& disagreements, Comparison& result) {
  std::array<std::optional<FloodFill>, 2> others;  // for thinner avatars, and for wider ones
  for (const auto& [from, to, isFound, reason] : disagreements) {
    if (isFound) {
      scene::World world(bench.scene);
      const Walked walked = go(bench, world, 0, from, to, GoKind::walks);
      if (walked.isArrived && walked.penetration == 0) {
        ++result.walked;
        continue;
      }
      std::printf("  not walked: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g): %s\n", from.x(),
                  from.y(), from.z(), to.x(), to.y(), to.z(), walked.text.c_str());
      result.wrong += walked.isFound ? 1 : 0;
    }
    scene::NavigationAgent agent;
    agent.radius += isFound ? -kNearWidth : kNearWidth;
    auto& other = others[isFound ? 0 : 1];
    if (!other) other.emplace(bench.atRest.data(), agent, places, maxPlaces);
    scene::Walker walker(bench.atRest.data(), agent);
    const auto stands = [&](const Vec3& place) {
      return scene::standAt(walker, place, scene::kMaxStandDrop).has_value();
    };
    if (isConnected(*other, from, to) != !isFound || (!isFound && !(stands(from) && stands(to)))) {
      ++result.nearWidth;
      continue;
    }
    // On a grid that is shifted by half its spacing a passage of a centimetre may be missing.
    int reached = 0;
    bool isCutOff = false;
    for (const double shift : {0.0, 0.5 * FloodFill::kSpacing}) {
      const auto onward =
          FloodFill::fillByWalks(bench.atRest.data(), {}, from, maxPlaces, to, shift);
      const bool isReached = onward.findComponent(to).has_value();
      reached += isReached ? 1 : 0;
      isCutOff |= !isReached && onward.size() >= maxPlaces;
    }
    if (isCutOff) {
      --result.compared, ++result.skipped;
      continue;
    }
    if (reached == 1) {
      ++result.nearWidth;
      continue;
    }
    const bool isReached = reached == 2;
    if (isReached == isFound) continue;
    if (++result.wrong <= 5)
      std::printf("  reach: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g): path %d: %s\n",
                  from.x(), from.y(), from.z(), to.x(), to.y(), to.z(), isFound, reason.c_str());
  }
}

/// Metres that the feet of an avatar move along a way, across and up and down. A step counts with
/// its height, whether it is taken in one tick or in a fall. nullopt: it cannot be walked.
std::optional<double> measureWalk(const Bench& bench, const std::vector<Vec3>& way) {
  scene::World world(bench.scene);
  scene::Spawn spawn;
  spawn.position = way.front();
  scene::Walk walk;
  walk.waypoints.assign(way.begin() + 1, way.end());
  submitAvatarCommand(world, {"walker", spawn, 0});
  for (int tick = 0; tick < kRestTicks; ++tick) tickWorld(world);
  submitAvatarCommand(world, {"walker", walk, 0});
  double length = 0;
  Vec3 footPosition = way.front();
  for (int tick = 0; tick < kMaxTicks; ++tick) {
    const scene::TickReport report = tickWorld(world);
    const auto snapshot = world.snapshot();
    if (snapshot->avatars.empty()) return std::nullopt;
    const Vec3 before = std::exchange(footPosition, snapshot->avatars.front().footPosition);
    length += scene::computeGroundDistance(before, footPosition) +
              std::abs(footPosition.y() - before.y());
    for (const scene::Notice& notice : report.notices) {
      if (notice.kind == scene::Notice::Kind::blocked) return std::nullopt;
      if (notice.kind != scene::Notice::Kind::arrived) continue;
      if (std::abs(footPosition.y() - way.back().y()) > scene::kHeightError) return std::nullopt;
      return length;
    }
  }
  return std::nullopt;
}

/// Lengths of paths as shares of those of other ways, where an avatar walks those.
struct LengthComparison {
  std::vector<double> shares, feetShares;
  int unwalkable = 0;  ///< no avatar walks the other way, or it is missing
  int wrong = 0;       ///< no avatar walks the path
};

std::vector<Vec3> getPoints(const v1::NavigationPath& path) {
  std::vector<Vec3> points;
  for (const v1::Vec3& point : path.points()) points.push_back(server::vectorFromProto(point));
  return points;
}

void printLong(const Vec3& from, const Vec3& to, double share) {
  if (!isLong(share)) return;
  std::printf("  long: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g): %.4f\n", from.x(), from.y(),
              from.z(), to.x(), to.y(), to.z(), share);
}

/// Compares the path between two places with the shortest way in the fill.
void compareLength(Bench& bench, const FloodFill& fill, const Vec3& from, const Vec3& to,
                   LengthComparison& lengths, int& wrong) {
  const v1::NavigationPath path = bench.findPath(from, to, v1::NavigationQuery::DOORS_AS_THEY_ARE);
  if (!path.found()) return;
  const std::vector<Vec3> way = fill.findShortest(from, to);
  const auto shortest = way.empty() ? std::nullopt : measureWalk(bench, way);
  if (!shortest) ++lengths.unwalkable;
  if (!shortest || *shortest < kMinCompared) return;
  const std::vector<Vec3> points = getPoints(path);
  const auto walked = measureWalk(bench, points);
  if (!walked) {
    ++wrong;
    std::printf("  not walked: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g)\n", from.x(),
                from.y(), from.z(), to.x(), to.y(), to.z());
    return;
  }
  lengths.shares.push_back(scene::computeLength(points) / scene::computeLength(way));
  lengths.feetShares.push_back(*walked / *shortest);
  printLong(from, to, lengths.feetShares.back());
}

void compareWithFill(Bench& bench, const Effort& effort, nlohmann::json& row) {
  const std::vector<Vec3> places = drawAnywhere(bench, effort.compared);
  const auto start = Clock::now();
  const FloodFill fill(bench.atRest.data(), {}, places, effort.places);
  std::printf("  %zu places filled in %.0f s\n", fill.size(), measureSecondsSince(start));
  std::fflush(stdout);
  std::mt19937_64 random(7);
  const auto drawIndex = [&](std::size_t count) {
    return static_cast<std::size_t>(random() % count);
  };
  Comparison result;
  std::vector<Disagreement> disagreements;
  LengthComparison lengths;
  for (int i = 0; i < 2 * effort.compared && !places.empty() && fill.size() > 0; ++i) {
    const bool isOfFill = i % 2 == 1;
    // Places of the fill are kept in single precision: a little above the floor.
    const auto draw = [&] {
      return isOfFill ? Vec3(fill.at(drawIndex(fill.size())) + Vec3(0, FloodFill::kLift, 0))
                      : places[drawIndex(places.size())];
    };
    const Vec3 from = draw(), to = draw();
    comparePair(bench, fill, from, to, result, disagreements);
    if (!isOfFill && static_cast<int>(lengths.shares.size()) < effort.lengths)
      compareLength(bench, fill, from, to, lengths, result.wrong);
  }
  judge(bench, places, effort.places, disagreements, result);
  row["fill_places"] = fill.size();
  row["reach_compared"] = result.compared;
  row["reach_skipped"] = result.skipped;
  row["reach_near_width"] = result.nearWidth;
  row["reach_walked"] = result.walked;
  row["reach_wrong"] = result.wrong;
  row["islands_wrong"] = result.islandsWrong;
  row["lengths"] = lengths.shares.size();
  row["lengths_unwalkable"] = lengths.unwalkable;
  row["length_median"] = toJsonNumber(computeQuantile(lengths.shares, 0.5));
  row["length_max"] = toJsonNumber(computeQuantile(lengths.shares, 1));
  row["length_above"] = std::ranges::count_if(lengths.shares, isLong);
  row["feet_max"] = toJsonNumber(computeQuantile(lengths.feetShares, 1));
  row["feet_above"] = std::ranges::count_if(lengths.feetShares, isLong);
}

/// Where an avatar comes to that walks along the corners of Detour's line; nullopt: it does not
/// walk that line to its end.
std::optional<std::vector<Vec3>> walkAlong(scene::Walker& walker, const std::vector<Vec3>& line) {
  if (walker.place(line.front(), scene::kMaxStandDrop)) return std::nullopt;
  std::vector<Vec3> points{walker.footPosition()};
  for (std::size_t i = 1; i < line.size(); ++i) {
    if (walker.walkTo(line[i]).kind != scene::WalkOutcome::Kind::arrived) return std::nullopt;
    points.push_back(walker.footPosition());
  }
  if (std::abs(points.back().y() - line.back().y()) > scene::kHeightError) return std::nullopt;
  return points;
}

/// Compares paths with Detour's string-pulled line on the mesh that proposes them.
void compareWithDetour(Bench& bench, const Effort& effort, nlohmann::json& row) {
  const auto doors = v1::NavigationQuery::DOORS_AS_THEY_ARE;
  const auto starts = bench.drawPlaces(effort.pairs, 8, doors);
  const auto goals = bench.drawPlaces(effort.pairs, 9, doors);
  const scene::NavigationMesh mesh = buildMesh(bench.atRest);
  scene::Walker walker(bench.atRest.data(), {});
  LengthComparison lengths;
  std::size_t found = 0, noLine = 0;
  const std::size_t pairs = std::min(starts.size(), goals.size());
  for (std::size_t i = 0; i < pairs; ++i) {
    const v1::NavigationPath path = bench.findPath(starts[i], goals[i], doors);
    if (!path.found()) continue;
    ++found;
    const auto line = findLine(mesh, starts[i], goals[i]);
    if (!line) {
      ++noLine;
      continue;
    }
    const auto walked = walkAlong(walker, *line);
    if (!walked) {
      ++lengths.unwalkable;
      continue;
    }
    const double length = scene::computeLength(*walked);
    if (length < kMinCompared) continue;
    const std::vector<Vec3> points = getPoints(path);
    lengths.shares.push_back(scene::computeLength(points) / length);
    const auto feetOnPath = measureWalk(bench, points), feetOnLine = measureWalk(bench, *walked);
    if (!feetOnPath) ++lengths.wrong;
    if (feetOnPath && feetOnLine) lengths.feetShares.push_back(*feetOnPath / *feetOnLine);
    printLong(starts[i], goals[i],
              feetOnPath && feetOnLine ? lengths.feetShares.back() : lengths.shares.back());
  }
  row["detour_pairs"] = pairs;
  row["detour_found"] = found;
  row["detour_no_line"] = noLine;
  row["detour_unwalkable"] = lengths.unwalkable;
  row["detour_compared"] = lengths.shares.size();
  row["detour_median"] = toJsonNumber(computeQuantile(lengths.shares, 0.5));
  row["detour_min"] = toJsonNumber(computeQuantile(lengths.shares, 0));
  row["detour_max"] = toJsonNumber(computeQuantile(lengths.shares, 1));
  row["detour_above"] = std::ranges::count_if(lengths.shares, isLong);
  row["detour_wrong"] = lengths.wrong;
  row["detour_feet_compared"] = lengths.feetShares.size();
  row["detour_feet_max"] = toJsonNumber(computeQuantile(lengths.feetShares, 1));
  row["detour_feet_above"] = std::ranges::count_if(lengths.feetShares, isLong);
}

void measureMeshes(Bench& bench, const Effort&, nlohmann::json& row) {
  v1::NavigationQuery query;
  query.mutable_islands()->set_count(1);
  const v1::NavigationReply islands = bench.ask(query, bench.atRest);
  row["build_seconds"] = islands.build_seconds();
  row["mesh_bytes"] = islands.mesh_bytes();
  row["area"] = islands.navigable_area();
  row["islands"] = islands.island_areas_size();
}

void measure(const std::string& file, const Effort& effort, std::ofstream& out) {
  server::ModelOptions options;
  options.file = file.substr(0, file.find('@'));
  if (const auto at = file.find('@'); at != std::string::npos)
    options.import.metresPerUnit = std::stod(file.substr(at + 1));
  const auto scene = server::loadSceneTimed(options).scene;
  Bench bench{scene, server::NavigationService(scene), scene::World(scene)};
  const auto run = [&](const std::string& part, const auto& measurePart) {
    if (!effort.only.empty() && effort.only != part) return;
    const auto start = Clock::now();
    nlohmann::json row = {{"scene", options.file.filename().string()}, {"part", part}};
    measurePart(bench, effort, row);
    std::printf("%s, %.1f s\n", row.dump().c_str(), measureSecondsSince(start));
    std::fflush(stdout);
    out << row.dump() << "\n" << std::flush;
  };
  run("times", [](auto&... arguments) {
    measureMeshes(arguments...);
    measureTimes(arguments...);
  });
  run("fill", compareWithFill);
  run("lengths", compareWithDetour);
  run("walks", measureWalks);
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto status = scene::runImportWorker(argc, argv)) return *status;
  std::string out;
  Effort effort;
  std::vector<std::string> scenes;
  bool isUsed = true;  // as the usage says
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--quick") {
      effort = {200, 100, 20, effort.places, effort.only};
    } else if (argument == "--pairs" && i + 1 < argc) {
      effort.pairs = std::atoi(argv[++i]);
    } else if (argument == "--places" && i + 1 < argc) {
      effort.places = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--only" && i + 1 < argc) {
      effort.only = argv[++i];
      isUsed = isUsed && (effort.only == "times" || effort.only == "fill" ||
                          effort.only == "lengths" || effort.only == "walks");
    } else if (argument == "--out" && i + 1 < argc) {
      out = argv[++i];
    } else {
      scenes.push_back(argument);
    }
  }
  if (scenes.empty() || !isUsed) {
    std::fprintf(stderr,
                 "usage: %s [--quick] [--pairs N] [--places N] [--only times|fill|lengths|walks] "
                 "[--out FILE] SCENE[@METRES_PER_UNIT]..\n",
                 argv[0]);
    return 2;
  }
  std::ofstream file(out);
  for (const std::string& name : scenes) measure(name, effort, file);
}
