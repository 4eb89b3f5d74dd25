// A run of a recording with random access: the nearest checkpoint before a tick, and the items
// after it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "protocol/mcap/indexed_reader.hpp"
#include "protocol/recording/recording.hpp"

namespace enfilade::protocol {

/// Reads one run from any tick. All functions throw mcap::RecordingError.
class SeekableRecording {
 public:
  /// `run`: number of the run, from 1.
  explicit SeekableRecording(const std::filesystem::path& file, std::uint32_t run = 1);

  const v1::RecordingStart& start() const { return start_; }
  /// The tick before the first recorded tick: 0, or the tick at which a branch left its parent.
  std::uint64_t firstTick() const { return start_.parent().tick(); }
  std::uint64_t lastTick() const { return lastTick_; }  ///< the last tick with a recorded state
  bool closed() const { return file_.closed(); }        ///< true if the writer closed the file
  std::size_t runs() const { return runs_; }            ///< number of runs in the file

  /// Returns the last checkpoint at or before `tick`.
  std::optional<v1::RecordedCheckpoint> checkpointBefore(std::uint64_t tick);

  /// Positions next() after `tick` and its checkpoint.
  void seek(std::uint64_t tick);
  /// Returns the items in order of time; nullopt at the end of the run.
  std::optional<RecordedItem> next();

 private:
  void findRun(std::uint32_t run);
  void readStart();
  void findLastTick();
  std::uint64_t toFileTime(std::uint64_t tick) const;

  mcap::IndexedReader file_;
  std::size_t runs_ = 0;
  /// The chunk that ends with the start of this run, and the chunk with the start of the next run
  /// (or the number of chunks). Messages before the start belong to another run.
  std::size_t beginChunk_ = 0, endChunk_ = 0;
  v1::RecordingStart start_;
  std::uint64_t startTime_ = 0;  ///< file time of tick 0, nanoseconds
  std::uint64_t lastTick_ = 0;
  std::size_t chunk_ = 0;
  std::uint64_t afterTime_ = 0;  ///< file time, nanoseconds
};

}  // namespace enfilade::protocol
