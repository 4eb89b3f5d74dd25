// What a recording tells of a walk, gathered for comparing: who touched what, where and when, how
// orders ended, how near things came.
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

/// A contact that begins, a blocked move, someone in or out of a trigger.
struct Happening {
  std::string a, b;  ///< as the recording names them
  std::uint64_t tick = 0;
  double time = 0;              ///< seconds
  Vec3 point = Vec3::Zero();    ///< on b; scene frame, metres
  Vec3 normal = Vec3::Zero();   ///< unit, from a to b; zero where there is none
  double distance = 0;          ///< metres, >= 0
  std::optional<double> ended;  ///< seconds; contacts alone, nullopt: it lasts to the end
};

/// The least distance that was told of a pair.
struct Nearest {
  double distance = 0;  ///< metres, >= 0
  std::uint64_t tick = 0;
  double time = 0;
  Vec3 point = Vec3::Zero();
};

/// All that two did with one another, in order of time.
struct PairRecord {
  std::vector<Happening> contacts, ground, blocked, enters, leaves, falls;
  std::optional<Nearest> nearest;  ///< of contacts and near misses, those with the ground left out
};

/// How an order went, or that someone left.
struct OrderEnd {
  v1::Notice::Kind kind = v1::Notice::KIND_UNSPECIFIED;
  std::string avatar;
  std::uint64_t tag = 0;
  std::uint32_t repeat = 0;  ///< how many of this avatar and tag ended before
  std::uint64_t tick = 0;
  double time = 0;
  Vec3 position = Vec3::Zero();  ///< the feet
  std::string obstacle, text;
};

struct AvatarRecord {
  double entered = 0, last = 0;  ///< seconds: the first and the last state that has it
  double wayLength = 0;          ///< metres that the feet came
};

/// A world from its first tick on.
struct RecordedRun {
  v1::RecordingStart start;
  std::uint64_t ticks = 0, hash = 0;
  double time = 0;                                                  ///< seconds, at the end
  std::map<std::pair<std::string, std::string>, PairRecord> pairs;  ///< by the names of a and b
  std::vector<OrderEnd> orders;
  std::map<std::string, AvatarRecord> avatars;
};

struct RecordedWalk {
  std::filesystem::path file;
  std::optional<std::uint32_t> run;  ///< of the file that one alone was read, which counts from 1
  std::vector<RecordedRun> runs;     ///< at least one; more where the world began anew
  bool closed = false;               ///< else the file ends in the middle
  std::uint64_t wholeBytes = 0;
  /// GlobalId ("" where there is none) by the path of each object; nullopt: the recording does not
  /// list its objects, as those of earlier versions.
  std::optional<std::unordered_map<std::string, std::string>> objects;
  std::unordered_map<std::string, std::string> bodies;  ///< path of the first object, by its name
};

/// A moment of a recording; orders by run, then by tick.
struct WalkMoment {
  std::size_t run = 0;
  std::uint64_t tick = 0;
  auto operator<=>(const WalkMoment&) const = default;
};
WalkMoment endOf(const RecordedWalk& walk);

/// What is told of a walk: of its first run nothing up to `since`, and nothing after `until`; of a
/// file with several runs `run` alone, if one is given.
struct WalkPart {
  std::optional<std::uint32_t> run = std::nullopt;
  std::uint64_t since = 0;
  std::optional<WalkMoment> until = std::nullopt;
};

/// Throws protocol::mcap::RecordingError.
RecordedWalk readWalk(const std::filesystem::path& file, const WalkPart& part = {});

}  // namespace enfilade::server
