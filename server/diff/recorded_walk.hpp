// Data of a recorded walk for comparison: contacts with place and time, ends of orders, and
// clearances.
#pragma once

#include <compare>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "collision/types.hpp"
#include "protocol/recording.pb.h"

namespace enfilade::server {

using collision::Vec3;

/// An event of a walk: a contact that begins, a blocked move, or a trigger entered or left.
struct WalkEvent {
  std::string a, b;                  ///< names in the recording
  std::string aGlobalId, bGlobalId;  ///< of IFC; empty: none
  std::uint64_t tick = 0;
  double time = 0;              ///< seconds
  Vec3 point = Vec3::Zero();    ///< on b; scene frame, metres
  Vec3 normal = Vec3::Zero();   ///< unit, from a to b; zero if unknown
  double distance = 0;          ///< metres, >= 0
  std::optional<double> ended;  ///< seconds; only for contacts; nullopt: active until the end
};

/// The minimum reported distance of a pair.
struct Nearest {
  double distance = 0;  ///< metres, >= 0
  std::uint64_t tick = 0;
  double time = 0;
  Vec3 point = Vec3::Zero();
};

/// All events of a pair, in order of time.
struct PairRecord {
  std::vector<WalkEvent> contacts, ground, blocked, enters, leaves, falls;
  std::optional<Nearest> nearest;  ///< of contacts and near misses, without ground contacts
};

/// The end of an order, or an avatar that left.
struct FinishedOrder {
  v1::Notice::Kind kind = v1::Notice::KIND_UNSPECIFIED;
  std::string avatar;
  std::uint64_t tag = 0;
  std::uint32_t repeat = 0;  ///< number of earlier ends with this avatar and tag
  std::uint64_t tick = 0;
  double time = 0;
  Vec3 position = Vec3::Zero();  ///< of the feet
  std::string obstacle, text;
};

struct AvatarRecord {
  double entered = 0, last = 0;  ///< seconds: first and last state with the avatar
  double pathLength = 0;         ///< path length of the feet, metres
};

/// One run: a world from its first tick.
struct RecordedRun {
  v1::RecordingStart start;
  std::uint64_t ticks = 0, hash = 0;
  double time = 0;                                                  ///< seconds, at the end
  std::map<std::pair<std::string, std::string>, PairRecord> pairs;  ///< by the names of a and b
  std::vector<FinishedOrder> orders;
  std::map<std::string, AvatarRecord> avatars;
};

struct RecordedWalk {
  std::filesystem::path file;
  std::optional<std::uint32_t> run;  ///< if only one run of the file was read: its number, from 1
  std::vector<RecordedRun> runs;     ///< at least one; more if the world restarted
  bool closed = false;               ///< false: the file is truncated
  std::uint64_t wholeBytes = 0;
  /// GlobalId (or "") by object path; nullopt: the recording does not list its objects, as in
  /// earlier versions.
  std::optional<std::unordered_map<std::string, std::string>> objects;
  std::unordered_map<std::string, std::string> bodies;  ///< path of the first object, by body name
};

/// A moment of a recording, ordered by run, then by tick.
struct WalkMoment {
  std::size_t run = 0;
  std::uint64_t tick = 0;
  auto operator<=>(const WalkMoment&) const = default;
};
WalkMoment findEnd(const RecordedWalk& walk);

/// The range of a walk to read: its first run after tick `afterTick`, up to `until`. If `run` is
/// given, only this run of the file.
struct WalkRange {
  std::optional<std::uint32_t> run = std::nullopt;
  std::uint64_t afterTick = 0;
  std::optional<WalkMoment> until = std::nullopt;
};

/// Reads a walk. Throws protocol::mcap::RecordingError.
RecordedWalk readWalk(const std::filesystem::path& file, const WalkRange& range = {});

}  // namespace enfilade::server
