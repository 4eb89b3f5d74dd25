// A recording: what a world was told and what became of it, tick by tick, as MCAP (RECORDING.md).
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

/// All functions throw mcap::RecordingError.
class RecordingWriter {
 public:
  /// `library`: who writes, name and version. A file that is there is begun anew, or refused.
  RecordingWriter(const std::filesystem::path& file, const std::string& library,
                  bool replace = true);

  /// `time`: seconds of simulated time, above 0 for a branch.
  void write(const v1::RecordingStart& start, double time = 0);
  void write(const v1::RecordedCommands& commands, double time);
  void write(const v1::TickEvents& events);
  void write(const v1::State& state);
  void write(const v1::RecordedNames& names);
  /// In a chunk of its own, so that who seeks it unpacks nothing else. Returns the bytes that it
  /// took in the file.
  std::uint64_t write(const v1::RecordedCheckpoint& checkpoint, double time);
  /// To a channel of that name, which is for this kind of message.
  void write(const std::string& topic, double time, const google::protobuf::Message& message);

  /// Seconds of simulated time as the file counts them: where the world began anew, they go on.
  double fileTime(double time) const { return began_ + time; }
  void flush() { file_.flush(); }
  void close() { file_.close(); }
  std::uint64_t bytesWritten() const { return file_.bytesWritten(); }

 private:
  void writeTo(std::uint16_t channel, double time, const google::protobuf::MessageLite& message);

  mcap::Writer file_;
  std::string bytes_;  // kept, so that a tick allocates nothing
  std::map<std::string, std::uint16_t> others_;
  double startTime_ = 0;         ///< seconds of the world's time
  double began_ = 0, last_ = 0;  ///< seconds in the file: of the world's beginning, written last
  std::uint16_t start_, commands_, events_, state_, names_, checkpoint_;
};

using RecordedItem = std::variant<v1::RecordingStart, v1::RecordedCommands, v1::TickEvents,
                                  v1::State, v1::RecordedNames, v1::RecordedCheckpoint>;

/// nullopt for messages of other programs.
std::optional<RecordedItem> itemFrom(const mcap::Message& message,
                                     const std::filesystem::path& file);
inline constexpr const char* kStartTopic = "/enfilade/start";
inline constexpr const char* kEventsTopic = "/enfilade/events";
inline constexpr const char* kCheckpointTopic = "/enfilade/checkpoint";

/// Nanoseconds, as recordings have them.
std::uint64_t nanosecondsOf(double seconds);

/// A run is what was recorded from one beginning of the world to the next; they count from 1. There
/// is no run `asked` of `runs`: says so, and throws.
[[noreturn]] void failWithoutRun(const std::filesystem::path& file, std::uint32_t asked,
                                 std::size_t runs);

class RecordingReader {
 public:
  /// `run`: that one alone, and the names, which are told after the first start only, after its
  /// own; left out: all of them.
  explicit RecordingReader(const std::filesystem::path& file,
                           std::optional<std::uint32_t> run = std::nullopt);

  /// In the order in which it happened; what other programs may have added is left out.
  std::optional<RecordedItem> next();
  /// As mcap::Reader has them.
  bool closed() const { return file_.closed(); }
  /// At the end: what was asked for is all there. Of a run that another follows it is, even where
  /// the file ends in the middle of that one.
  bool complete() const { return closed() || (run_ && begun_ > *run_); }
  std::uint64_t wholeBytes() const { return file_.wholeBytes(); }

 private:
  bool isWanted(const RecordedItem& item);

  std::filesystem::path path_;
  mcap::Reader file_;
  std::optional<std::uint32_t> run_;
  std::uint32_t begun_ = 0;         ///< runs, up to here
  std::deque<RecordedItem> names_;  ///< told before the run that is wanted
};

/// 16 digits, as hashes are written everywhere.
std::string hexadecimal(std::uint64_t hash);

/// Where two states of the same tick differ first.
struct StateDifference {
  std::string who;    ///< an avatar's or a body's name; "the world"
  std::string field;  ///< as "feet.x"; "state hash" where only that differs
  std::string recorded, replayed;
};
/// nullopt when they are equal to the last bit.
std::optional<StateDifference> firstDifference(const v1::State& recorded,
                                               const v1::State& replayed);

}  // namespace enfilade::protocol
