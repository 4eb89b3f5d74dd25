// What changed between two walks: plain data, and how it is found.
//
// Two things are the same in both walks when their names are the same: an avatar's or a body's
// name, an object's GlobalId, else its path. The contacts of a pair are put in order of time and
// matched in this order so that the places differ least in all; what would differ by kSamePlace or
// more, and what is left over, is new or gone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/diff/recorded_walk.hpp"

namespace enfilade::server {

/// Metres: farther apart two contacts of a pair are not the same one.
inline constexpr double kSamePlace = 2;

/// What happened between two things that a comparison tells, what weighs most first.
enum class HappeningKind : std::uint8_t { blocked, contact, fall, enter, leave, ground };
inline constexpr std::size_t kHappeningKinds = 6;

enum class Model : std::uint8_t { both, before, after, unknown };

/// Something that happened in one walk alone, or otherwise in the other. At least one is given.
struct HappeningChange {
  HappeningKind kind = HappeningKind::contact;
  std::optional<Happening> before, after;
  double shift = 0;  ///< metres from where it was, both given
  double delay = 0;  ///< seconds later than it was, both given
  /// Contacts of one walk alone: how near the pair came in the other; nullopt: never so near that
  /// it was told.
  std::optional<double> otherwise;
  Model inModel = Model::unknown;  ///< which model has b
  std::size_t run = 0;
  bool worse = false;
  std::string picture;  ///< its file, where one was made
};

/// An order that ended otherwise or at another time.
struct OrderChange {
  std::optional<OrderEnd> before, after;  ///< at least one
  std::size_t run = 0;
  bool worse = false;
  std::string picture;  ///< its file, where one was made
};

/// How near a pair came, where that changed by more than the tolerance and no contact is new or
/// gone.
struct ClearanceChange {
  std::string a, b;  ///< as the later walk names them, or the earlier where only that does
  std::optional<Nearest> before, after;  ///< nullopt: farther than the near miss distance
  double least = 0;                      ///< metres by which it changed at least: < 0 is nearer
  Model inModel = Model::unknown;
  std::size_t run = 0;
  bool worse = false;
  std::string picture;  ///< its file, where one was made
};

/// An avatar that went otherwise, or is in one walk alone.
struct WayChange {
  std::string avatar;
  std::optional<AvatarRecord> before, after;  ///< at least one
  std::uint64_t firstTick = 0;                ///< at which the feet are not in the same place
  double farthest = 0;                        ///< metres between the feet, both in the world
  std::uint64_t farthestTick = 0;
  std::size_t run = 0;
};

/// A command of the earlier walk that the later model did not take.
struct RefusedCommand {
  std::uint64_t tick = 0;
  std::string who, why;
};

struct WalkDifference {
  double tolerance = 0;                     ///< metres
  RecordedWalk before, after;               ///< without their pairs
  std::vector<HappeningChange> happenings;  ///< by kind, then worst first
  std::vector<OrderChange> orders;          ///< worst first
  std::vector<ClearanceChange> clearances;  ///< what came nearest by most first
  std::vector<WayChange> ways;              ///< in order of run and name
  std::size_t worse = 0;                    ///< changes for the worse, refused commands among them
  std::vector<RefusedCommand> refused;      ///< of a walk that was made again in another model

  /// Nothing to tell, though hashes of scenes and files may differ.
  bool none() const;
};

/// `tolerance`: metres by which places and clearances may differ; `runBefore`: of `before` that one
/// alone (left out: all, and beside a branch the one that it left). Reads both files. Throws
/// protocol::mcap::RecordingError.
WalkDifference compareWalks(const std::filesystem::path& before, const std::filesystem::path& after,
                            double tolerance,
                            std::optional<std::uint32_t> runBefore = std::nullopt);

/// Pairs two ascending lists of happenings: indexes into both, each used once at most, both
/// ascending. What is kSamePlace or farther apart is not paired.
std::vector<std::pair<std::size_t, std::size_t>> matchedHappenings(
    const std::vector<Happening>& before, const std::vector<Happening>& after);

}  // namespace enfilade::server
