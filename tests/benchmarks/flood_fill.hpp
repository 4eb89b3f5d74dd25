// Where an upright avatar comes to by steps of 2 cm, found without a navigation mesh. Every place
// of a grid is tried by standing there. The reference of the benchmark of navigation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "scene/base/thread_pool.hpp"
#include "scene/navigation/walk/walker.hpp"

namespace enfilade::benchmarks {

class FloodFill {
 public:
  static constexpr double kSpacing = 0.02;  ///< metres between places
  static constexpr double kLift = 2e-3;  ///< metres above a place: an avatar can be put down there

  /// Fills from each of `starts` that is not filled yet, until `maxPlaces` places are found. A
  /// place that can be left but not reached again is in the component of its start.
  FloodFill(const scene::WorldData& world, const scene::NavigationAgent& agent,
            const std::vector<scene::Vec3>& starts, std::size_t maxPlaces)
      : FloodFill(world, agent, starts, maxPlaces, std::nullopt, 0) {}

  /// Fills from `start` by walks alone, and ends early when it comes to `goal`. On even floor a
  /// place where an avatar stands may be reached by no walk, if less than a millimetre is missing.
  /// `shift`: of the grid, metres.
  static FloodFill fillByWalks(const scene::WorldData& world, const scene::NavigationAgent& agent,
                               const scene::Vec3& start, std::size_t maxPlaces,
                               const scene::Vec3& goal, double shift) {
    return {world, agent, {start}, maxPlaces, goal, shift};
  }

  std::size_t size() const { return places_.size(); }
  scene::Vec3 at(std::size_t place) const {
    return computePosition(static_cast<std::int32_t>(place));
  }

  struct Component {
    std::int32_t number = 0;
    bool isWhole = true;  ///< the fill ended before `maxPlaces`
  };
  /// The connected places around a place to stand; nullopt: no place of the grid is within 3 cm.
  std::optional<Component> findComponent(const scene::Vec3& place) const;

  /// The shortest way on the grid, pulled straight where all places below the straight line are
  /// filled. Empty: no path.
  std::vector<scene::Vec3> findShortest(const scene::Vec3& from, const scene::Vec3& to) const;

 private:
  /// With a goal: by walks alone.
  FloodFill(const scene::WorldData& world, const scene::NavigationAgent& agent,
            const std::vector<scene::Vec3>& starts, std::size_t maxPlaces,
            const std::optional<scene::Vec3>& goal, double shift);

  struct Place {
    std::int32_t column;  ///< of the grid
    float height;         ///< metres
    std::int32_t component;
    std::int32_t next;  ///< another place of the column, or -1
  };

  std::int32_t computeColumn(double x, double z) const;
  scene::Vec3 computePosition(std::int32_t place) const;
  std::int32_t findPlace(std::int32_t column, double height, double reach) const;
  std::int32_t findNearest(const scene::Vec3& point) const;
  std::int32_t add(std::int32_t column, double height, std::int32_t component);
  std::optional<scene::Vec3> stepTo(scene::Walker& walker, const scene::Vec3& from, double x,
                                    double z) const;
  std::vector<scene::Vec3> stepToAll(std::vector<scene::Walker>& walkers,
                                     const std::vector<std::int32_t>& front,
                                     const std::pair<int, int>& direction);
  void fill(std::vector<scene::Walker>& walkers, std::int32_t start, std::size_t maxPlaces,
            const std::optional<scene::Vec3>& goal);
  std::vector<std::int32_t> findWay(std::int32_t from, std::int32_t to) const;
  bool isStraight(const scene::Vec3& from, const scene::Vec3& to) const;

  double stepHeight_;
  bool walks_;   ///< also on even floor
  double step_;  ///< metres between the heights of neighbours
  scene::Vec3 corner_;
  std::int32_t width_ = 0, depth_ = 0;
  std::vector<std::int32_t> first_;  ///< by column: its first place, or -1
  std::vector<Place> places_;
  std::int32_t unfinished_ = -1;  ///< component
  scene::ThreadPool threads_{static_cast<int>(std::thread::hardware_concurrency())};
};

}  // namespace enfilade::benchmarks
