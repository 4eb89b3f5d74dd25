// Recordings: the commands, states and events of a world, tick by tick, as MCAP (RECORDING.md).
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "protocol/mcap/reader.hpp"
#include "protocol/mcap/writer.hpp"
#include "protocol/recording.pb.h"

namespace enfilade::protocol {

/// A FileDescriptorSet with the message's file and all its imports, as bytes: the schema of
/// channels with encoding "protobuf".
std::string serializeSchema(const google::protobuf::Descriptor& message);

/// Writes a recording. All functions throw mcap::RecordingError.
class RecordingWriter {
 public:
  /// `library`: name and version of the writing program. An existing file is overwritten or
  /// refused.
  RecordingWriter(const std::filesystem::path& file, const std::string& library,
                  bool replace = true);

  /// `time`: simulated time in seconds; above 0 for a branch.
  void write(const v1::RecordingStart& start, double time = 0);
  void write(const v1::RecordedCommands& commands, double time);
  void write(const v1::TickEvents& events);
  void write(const v1::State& state);
  void write(const v1::RecordedNames& names);
  /// Writes a checkpoint in its own chunk, so that seeking decompresses nothing else. Returns its
  /// size in the file, bytes.
  std::uint64_t write(const v1::RecordedCheckpoint& checkpoint, double time);
  /// Writes to the channel of this topic. All its messages must have the same type.
  void write(const std::string& topic, double time, const google::protobuf::Message& message);

  /// Converts simulated time to file time, in seconds. File time continues when the world restarts.
  double fileTime(double time) const { return runStart_ + time; }
  void flush() { file_.flush(); }
  void close() { file_.close(); }
  std::uint64_t bytesWritten() const { return file_.bytesWritten(); }

 private:
  void writeToChannel(std::uint16_t channel, double time,
                      const google::protobuf::MessageLite& message);

  mcap::Writer file_;
  std::string bytes_;  // buffer, kept so that a tick does not allocate
  std::map<std::string, std::uint16_t> extraChannels_;
  double startTime_ = 0;                ///< simulated time, seconds
  double runStart_ = 0, lastTime_ = 0;  ///< file time in seconds: start of the run, last message
  std::uint16_t start_, commands_, events_, state_, names_, checkpoint_;
};

using RecordedItem = std::variant<v1::RecordingStart, v1::RecordedCommands, v1::TickEvents,
                                  v1::State, v1::RecordedNames, v1::RecordedCheckpoint>;

/// Parses a message; nullopt for messages of other programs.
std::optional<RecordedItem> parseRecordedItem(const mcap::Message& message,
                                              const std::filesystem::path& file);
inline constexpr const char* kStartTopic = "/enfilade/start";
inline constexpr const char* kStateTopic = "/enfilade/state";
inline constexpr const char* kEventsTopic = "/enfilade/events";
inline constexpr const char* kCheckpointTopic = "/enfilade/checkpoint";

/// Converts seconds to the nanoseconds of recordings.
std::uint64_t toNanoseconds(double seconds);

/// Throws because the file has `runs` runs, and not run `requestedRun`. A run lasts from one start
/// of the world to the next; runs count from 1.
[[noreturn]] void throwMissingRun(const std::filesystem::path& file, std::uint32_t requestedRun,
                                  std::size_t runs);

class RecordingReader {
 public:
  /// `run`: reads only this run; nullopt: all runs. The names, which the file has only after the
  /// first start, follow the start of the requested run.
  explicit RecordingReader(const std::filesystem::path& file,
                           std::optional<std::uint32_t> run = std::nullopt);

  /// Returns the items in order of time. Messages of other programs are skipped.
  std::optional<RecordedItem> next();
  /// As in mcap::Reader.
  bool closed() const { return file_.closed(); }
  /// Valid at the end. True if the requested runs are complete. A run that another run follows is
  /// complete, even in a truncated file.
  bool complete() const { return closed() || (run_ && runsBegun_ > *run_); }
  std::uint64_t wholeBytes() const { return file_.wholeBytes(); }

 private:
  bool isWanted(const RecordedItem& item);

  std::filesystem::path path_;
  mcap::Reader file_;
  std::optional<std::uint32_t> run_;
  std::uint32_t runsBegun_ = 0;     ///< number of runs started so far
  std::deque<RecordedItem> names_;  ///< names from before the requested run
};

/// Formats a hash with 16 hexadecimal digits.
std::string toHex(std::uint64_t hash);

/// The first difference of two states of the same tick.
struct StateDifference {
  std::string entity;  ///< name of an avatar or body, or "the world"
  std::string field;   ///< for example "feet.x"; "state hash" if only the hash differs
  std::string recorded, replayed;
};
/// Compares two states; nullopt if they are bitwise equal.
std::optional<StateDifference> findFirstDifference(const v1::State& recorded,
                                                   const v1::State& replayed);

}  // namespace enfilade::protocol
