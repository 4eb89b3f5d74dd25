// Finds all overlapping pairs of many boxes at once, without knowledge of an earlier tick: uniform
// grids that a counting sort fills. For boxes that all move: sorted lists would exchange most of
// their endpoints there.
//
// The boxes are divided into levels by size. A level is a grid whose cells are as large as its
// largest box on each axis. A box lies in the cell of its low corner. Two boxes of a level
// therefore overlap only if their cells are equal or adjacent. Cell coordinates wrap around at the
// edge of the grid. Distant boxes may thus share a cell; each candidate is compared exactly.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "collision/broad_phase/signed_bounds.hpp"
#include "collision/processor.hpp"

namespace enfilade::collision {

class BoxTable {
 public:
  using Id = std::uint32_t;
  using IdPair = std::pair<Id, Id>;

  /// Replaces the contents by the boxes `maxEndpoints[id]` of `ids`, which must be finite and not
  /// empty. Fewer than 2^31 boxes.
  void build(std::span<const SignedBounds> maxEndpoints, std::span<const Id> ids);

  /// Appends all overlapping pairs of boxes of the table: each once, in any order of pairs and ids.
  void findPairs(std::vector<IdPair>& pairs) const;
  /// Appends (id, other) for each box of the table that overlaps this one, which is not in it.
  void findOverlaps(const SignedBounds& maxEndpoints, Id id, std::vector<IdPair>& pairs) const;

  std::span<const Id> ids() const { return ids_; }  ///< of all boxes, by cell

  bool useAvx = hasAvx();  ///< the result does not depend on it

 private:
  /// Boxes of similar size.
  struct SizeClass {
    std::uint32_t count = 0;
    SignedBounds bounds{};              ///< of all boxes, as maximum endpoints
    std::array<double, 3> maxExtent{};  ///< metres, on each axis
    void add(const SignedBounds& box, const std::array<double, 3>& extent);
    void add(const SizeClass& other);
  };
  struct Level {
    SizeClass content;
    std::array<double, 3> inverseEdge{};  ///< 1/metres
    std::array<std::int64_t, 3> cells{};  ///< number on each axis
    std::array<double, 3> inverseCells{};
    std::size_t firstCell = 0;  ///< in cellStart_
    double cellCount() const {
      return static_cast<double>(cells[0]) * static_cast<double>(cells[1]) *
             static_cast<double>(cells[2]);
    }
  };
  struct Run {
    std::uint32_t begin, end;  ///< indices into boxes_ and ids_
  };
  struct RunList;
  class PairWriter;

  void classify(std::span<const SignedBounds> maxEndpoints, std::span<const Id> ids);
  void makeLevels();
  static void sizeGrid(Level& level);
  Run cellsAt(std::size_t first, std::size_t end) const {
    return {cellStart_[first], cellStart_[end]};
  }
  template <typename Visit>
  void visitNear(const Level& level, const SignedBounds& box, const Visit& visit) const;
  void findPairsInLevel(const Level& level, PairWriter& writer) const;
  void findPairsInRow(const Level& level, std::size_t x, std::size_t y, PairWriter& writer) const;
  void findPairsBetween(const Level& fine, const Level& coarse, PairWriter& writer) const;
  Run getBoxes(const Level& level) const;

  std::vector<SizeClass> classes_;              ///< by exponent of the largest extent
  std::vector<std::uint16_t> usedExponents_;    ///< ascending
  std::vector<std::uint16_t> exponentOfBox_;    ///< scratch, as given
  std::vector<std::uint16_t> levelByExponent_;  ///< index into levels_
  std::vector<Level> levels_;                   ///< fine ones first
  std::vector<std::uint32_t> cellOfBox_;        ///< scratch, as given
  std::vector<std::uint32_t> cellStart_;        ///< by cell of all levels, and the end
  std::vector<SignedBounds> boxes_;             ///< by cell
  std::vector<Id> ids_;                         ///< of boxes_
  std::vector<std::uint32_t> cells_;            ///< of boxes_
};

}  // namespace enfilade::collision
