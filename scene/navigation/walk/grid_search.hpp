// Searches a path on a fine grid, where each edge is walked: finds the paths that a navigation mesh
// is too coarse for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

/// True if the walker, who stands at `from`, arrives at `to`, up to `heightError` metres above or
/// below.
bool walks(Walker& walker, const Vec3& from, const Vec3& to, double heightError);

inline constexpr double kSameHeight = 0.05;  ///< metres: of feet at one place on two paths

/// Whether the straight walk is clear, as Walker::isPathClear(), and ends at the height of `to`.
bool isWalkClear(Walker& walker, const Vec3& from, const Vec3& to);

/// FeetTravel::length() along places; infinite if a leg cannot be walked.
double measureLength(Walker& walker, std::span<const Vec3> places);

/// Length of a shortest path on a grid, of the same path pulled tight: at most, on even floor.
inline constexpr double kGridExcess = 1.08;
inline constexpr double kCoarseSpacing = 0.12, kFineSpacing = 0.03;  ///< metres, of grids

struct GridSearch {
  double spacing = 0.1;        ///< metres between places
  double margin = 1.5;         ///< metres: how far the path may leave the box of both ends
  std::size_t maxWalks = 0;    ///< edges to walk
  bool countsHeights = false;  ///< the length of a path is that of the feet, else across
  /// Metres. A lower bound of the length of a path over a place is compared with it.
  double maxLength = std::numeric_limits<double>::infinity();
};

/// The places of a path between two places where the walker stood, with both; nullopt: none was
/// found within the limits. Each leg was walked. Subtracts the walks from `search.maxWalks`.
std::optional<std::vector<Vec3>> findGridPath(Walker& walker, const Vec3& from, const Vec3& to,
                                              GridSearch& search);

using PlaceTest = std::function<bool(const Vec3& footPosition)>;

/// The end of a search that leads out of somewhere.
struct PathOut {
  PlaceTest isWanted;               ///< the path ends there
  PlaceTest isOpen = {};            ///< it may lead on from there; null: from anywhere
  std::optional<Vec3> toward = {};  ///< the path from here over its end to this point is short
};

/// As findGridPath(), to the closest place that is wanted and at most `search.margin` metres away
/// on each axis.
std::optional<std::vector<Vec3>> findGridPathOut(Walker& walker, const Vec3& from,
                                                 const PathOut& out, GridSearch& search);

/// Lines between places of a path that are tried as shortcuts. A line that is stopped is walked
/// tick by tick, which takes long. This pays after a search on a grid, and rarely at the corners of
/// a shortest line. `tight`: all, of a path that was pulled tight. Else a shortcut over a step must
/// be shorter by far, since a path on a grid will become shorter.
enum class Shortcuts : std::uint8_t { all, tight, free };

/// Moves the places between both ends towards the lines between their neighbours, and cuts corners.
/// The legs can then still be walked, and the path of the feet over steps is no longer.
void pullTight(Walker& walker, std::vector<Vec3>& places);

/// Leaves out places of a path. The legs between the others can be walked, and the path of the feet
/// over steps is no longer.
std::vector<Vec3> shortenPath(Walker& walker, const std::vector<Vec3>& places, Shortcuts kind);

}  // namespace enfilade::scene
