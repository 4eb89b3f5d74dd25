// The differences of two walks, as plain data, and their computation.
//
// Entities of both walks match by name: name of an avatar or body, GlobalId of an object, else its
// path. The events of a pair are aligned in order of time with minimal total distance
// (align_events.hpp). Events that stay unpaired are new or removed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/diff/recorded_walk.hpp"

namespace enfilade::server {

/// Kinds of compared events, in order of importance.
enum class WalkEventKind : std::uint8_t { blocked, contact, fall, enter, leave, ground };
inline constexpr std::size_t kWalkEventKinds = 6;

enum class ModelSide : std::uint8_t { both, before, after, unknown };

/// An event of only one walk, or one that differs. At least one of `before` and `after` is set.
struct WalkEventChange {
  WalkEventKind kind = WalkEventKind::contact;
  std::optional<WalkEvent> before, after;
  double shift = 0;  ///< metres between both events
  double delay = 0;  ///< seconds from `before` to `after`
  /// For contacts of only one walk: minimum distance in the other walk, metres; nullopt: never
  /// reported.
  std::optional<double> otherDistance;
  ModelSide inModel = ModelSide::unknown;  ///< models that contain b
  std::size_t run = 0;
  bool worse = false;
  std::string picture;  ///< picture file, or empty
};

/// An order with another outcome or end time.
struct OrderChange {
  std::optional<FinishedOrder> before, after;  ///< at least one
  std::size_t run = 0;
  bool worse = false;
  std::string picture;  ///< picture file, or empty
};

/// A clearance that changed by more than the tolerance, for a pair without new or removed contacts.
struct ClearanceChange {
  std::string a, b;                      ///< names in the later walk, else in the earlier
  std::optional<Nearest> before, after;  ///< nullopt: more than the near miss distance
  double minChange = 0;                  ///< lower bound of the change, metres; < 0: closer
  ModelSide inModel = ModelSide::unknown;
  std::size_t run = 0;
  bool worse = false;
  std::string picture;  ///< picture file, or empty
};

/// An avatar with another path, or of only one walk.
struct PathChange {
  std::string avatar;
  std::optional<AvatarRecord> before, after;  ///< at least one
  std::uint64_t firstTick = 0;                ///< first tick with different positions
  double maxDistance = 0;                     ///< maximum distance of the feet, metres
  std::uint64_t maxDistanceTick = 0;
  std::size_t run = 0;
};

/// A command of the earlier walk that the later model refused.
struct RefusedCommand {
  std::uint64_t tick = 0;
  std::string name, reason;
};

struct WalkDifference {
  double tolerance = 0;                     ///< metres
  RecordedWalk before, after;               ///< without pairs
  std::vector<WalkEventChange> events;      ///< by kind, then worst first
  std::vector<OrderChange> orders;          ///< worst first
  std::vector<ClearanceChange> clearances;  ///< largest decrease first
  std::vector<PathChange> paths;            ///< ordered by run and name
  std::size_t worse = 0;                    ///< number of regressions, including refused commands
  std::vector<RefusedCommand> refused;      ///< of a re-simulation

  /// True if there are no changes. Hashes of scenes and files may differ.
  bool isEmpty() const;
};

/// Reads and compares two recordings. `tolerance`: metres; smaller differences are ignored.
/// `runBefore`: uses only this run of `before` (nullopt: all, or the parent run if `after` is a
/// branch). Throws protocol::mcap::RecordingError.
WalkDifference compareWalks(const std::filesystem::path& before, const std::filesystem::path& after,
                            double tolerance,
                            std::optional<std::uint32_t> runBefore = std::nullopt);

}  // namespace enfilade::server
