// What SortAndSweep keeps from tick to tick. For its own source files only.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "collision/broad_phase/cell_grid.hpp"
#include "collision/broad_phase/endpoint_lists.hpp"
#include "collision/broad_phase/proxy_window.hpp"
#include "collision/broad_phase/sort_and_sweep.hpp"
#include "collision/broad_phase/static_grid.hpp"

namespace enfilade::collision {

enum class Presence : std::uint8_t { free, fresh, live, leaving };

/// What is read of a mover is asked for so many movers before: those of a crowd fill no near cache.
constexpr std::size_t kAskedAhead = 6;

/// Another mover whose cell meets one's own.
struct Neighbour {
  static constexpr std::uint8_t kMet = 6;

  MoverId id;
  std::uint8_t apart;  ///< kMet: their boxes overlap, as of the last update. Else they do not, and
                       ///< this is one's own half-axis on which they were found apart
  bool met() const { return apart == kMet; }
};

struct alignas(64) Mover {
  // What a steady tick reads comes first: two lines of a cache.
  HalfAxes low{}, high{};             ///< guards: while low <= reach < high nothing was passed
  std::vector<Neighbour> neighbours;  ///< sorted by id
  std::vector<SortAndSweep::Partner> partners;  ///< sorted

  MoverCell cell;
  Presence presence = Presence::free;
  bool moved = false;        ///< may have passed a guard since the last update
  bool relaid = false;       ///< its cell was laid anew in this update
  std::uint64_t laidAt = 0;  ///< tick
  HalfAxes laidReach{};      ///< then
  HalfAxes rate{};           ///< metres a tick that the reach grows, as of then
};

struct SortAndSweep::State {
  explicit State(std::span<const Box> stillBoxes);

  using Row = StillCells::Row;

  StillCells still;
  std::map<StillId, Box> stagedIn;  ///< still boxes to come
  std::set<StillId> stagedOut;      ///< still boxes to go
  std::vector<StillId> freeStillIds;
  std::size_t stillIds = 0;  ///< given so far, without those given again
  std::size_t stillCount = 0;

  MoverLists lists;  ///< of the cells of the movers
  std::vector<Mover> movers;
  // What neighbours read of a mover stands side by side.
  std::vector<HalfAxes> reaches;
  std::vector<std::uint8_t> isStirred;  ///< has moved since the last update, and has neighbours
  std::vector<MoverId> freeIds;
  std::vector<MoverId> moved, stirred, fresh, leaving;  ///< since the last update
  std::vector<MoverId> relaid;                          ///< in this update
  std::uint64_t tick = 0;
  std::size_t nextVisited = 0;

  std::vector<MoverChange> changes;  ///< scratch
  StillCells::RowList rows;          ///< scratch: the boxes about a mover
  std::vector<StillId> inReach;      ///< scratch: those that it meets
  std::vector<Partner> merged;       ///< scratch
  std::vector<BoxPair> begun, ended;
  std::size_t pairs = 0;
  SweepCounters counters;

  void stir(MoverId id, const void* reach);
  void moveFarther(MoverId id, const Box& box);

  // Pairs: sort_and_sweep_pairs.cpp.
  void beginStill(MoverId id, StillId other);
  void endStill(MoverId id, StillId other);
  void replaceStill(MoverId id);
  void beginMoving(MoverId a, MoverId b);
  void endMoving(MoverId a, MoverId b);
  void dropAll(MoverId id);

  // Movers against still boxes: sort_and_sweep_still.cpp.
  void updateStill();
  void passEnds(MoverId id);
  bool passInward(MoverId id, std::size_t k);
  bool passOutward(MoverId id, std::size_t k);
  void setBorders(MoverId id);
  HalfAxes rateOf(MoverId id) const;
  void layCell(MoverId id);
  void visitMovers();

  // Still boxes that come and go: sort_and_sweep_still.cpp.
  void applyEdits();
  void rebuildStill();

  // Movers against movers: sort_and_sweep_moving.cpp.
  void updateMoving();
  void beginNeighbours(MoverId a, MoverId b);
  void endNeighbours(MoverId a, MoverId b);
  void testNeighbours(MoverId id);
};

}  // namespace enfilade::collision
