// What SortAndSweep keeps from tick to tick. For its own source files only.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "collision/cell_grid.hpp"
#include "collision/mover_lists.hpp"
#include "collision/sort_and_sweep.hpp"
#include "collision/still_cells.hpp"

namespace enfilade::collision {

/// A mover's place in the sorted lists of one cell: on each half-axis the number of boxes whose
/// onset is within the mover's reach, which stays so while low <= reach < high.
struct Membership {
  HalfAxes low, high;
  std::array<std::uint32_t, 6> cursor;
  StillCells::Cell cell;
  CellPlace at;  ///< of the cell: kept here so that to leave it is not to look at it
  std::uint32_t level;
};

enum class Presence : std::uint8_t { free, fresh, live, leaving };

struct Mover {
  HalfAxes reach{};
  HalfAxes low{}, high{};          ///< the same for all of its cells, and for cellLow and cellHigh
  HalfAxes cellLow{}, cellHigh{};  ///< while low <= reach < high its cells are the same
  std::vector<Membership> cells;
  std::vector<CellRange> ranges;                ///< by level
  std::vector<SortAndSweep::Partner> partners;  ///< sorted
  std::vector<StillCells::Row> rows;            ///< of the still partners, beside `partners`
  std::array<std::uint8_t, 6> ahead{};          ///< steps of lookAhead() done, by half-axis
  Presence presence = Presence::free;
  bool moved = false;
  bool recheck = false;  ///< the partners it holds are to be tested once more

  /// In no cell yet, or no longer rightly in the ones it was.
  void leaveCells();
};

struct SortAndSweep::State {
  explicit State(std::span<const Box> stillBoxes);

  using Cell = StillCells::Cell;
  using Row = StillCells::Row;
  struct Found {
    Partner partner;
    Row row;
  };

  StillCells still;
  std::map<StillId, Box> stagedIn;  ///< still boxes to come
  std::set<StillId> stagedOut;      ///< still boxes to go
  std::vector<StillId> freeStillIds;
  std::size_t stillIds = 0;  ///< given so far, without those given again
  std::size_t stillCount = 0;

  MoverLists lists;
  std::vector<Mover> movers;
  std::vector<MoverId> freeIds;
  std::vector<MoverId> moved, fresh, leaving;  ///< since the last update
  std::vector<MoverChange> changes;            ///< scratch
  std::vector<Found> found;                    ///< scratch: what one mover was found to meet
  std::vector<Cell> entered;                   ///< scratch: cells that one mover enters
  std::vector<BoxPair> begun, ended;
  std::size_t pairs = 0;
  SweepCounters counters;

  // Pairs: sort_and_sweep_pairs.cpp.
  void test(const Mover& mover, Row row);
  void tellStill(MoverId id, Partner partner);
  void insertFound(MoverId id);
  void mergeFound(MoverId id);
  void takeFound(MoverId id);
  void endStill(MoverId id, Row row);
  void beginMoving(MoverId a, MoverId b);
  void endMoving(MoverId a, MoverId b);
  void dropAll(MoverId id);
  void recheck(MoverId id);

  // Movers against still boxes: sort_and_sweep_still.cpp.
  void updateStill(MoverId id);
  void enterRanges(MoverId id);
  void joinCells(MoverId id);
  void place(const Mover& mover, Membership& membership);
  void placeByScan(const Mover& mover, Membership& membership);
  void placeBySearch(const Mover& mover, Membership& membership);
  void guard(Membership& membership, std::size_t k) const;
  double border(Mover& mover, std::size_t k) const;
  void lookAhead(const Mover& mover, std::size_t k) const;
  void advance(MoverId id, Membership& membership, std::size_t k);

  // Still boxes that come and go: sort_and_sweep_still.cpp.
  void applyEdits();
  void rebuildStill();
  void renumberRows(MoverId id);
  bool touchedByEdits(const Mover& mover) const;

  void updateMoving();
};

}  // namespace enfilade::collision
