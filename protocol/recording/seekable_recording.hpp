// A run of a recording, read from any tick on: the nearest checkpoint before it, and what happened
// after it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "protocol/mcap/indexed_reader.hpp"
#include "protocol/recording/recording.hpp"

namespace enfilade::protocol {

/// All functions throw mcap::RecordingError.
class SeekableRecording {
 public:
  /// `run`: as RecordingReader's.
  explicit SeekableRecording(const std::filesystem::path& file, std::uint32_t run = 1);

  const v1::RecordingStart& start() const { return start_; }
  /// The tick that it begins after: 0, or where a branch left its parent.
  std::uint64_t firstTick() const { return start_.parent().tick(); }
  std::uint64_t lastTick() const { return lastTick_; }  ///< the last of which a state was recorded
  bool closed() const { return file_.closed(); }        ///< by its writer
  std::size_t runs() const { return runs_; }            ///< in the file

  /// The last one at or before `tick`.
  std::optional<v1::RecordedCheckpoint> checkpointBefore(std::uint64_t tick);

  /// next() goes on with what happened after `tick`, its checkpoint left out.
  void seek(std::uint64_t tick);
  /// In the order in which it happened; nullopt at the end of the run.
  std::optional<RecordedItem> next();

 private:
  void findRun(std::uint32_t run);
  void readStart();
  void findLastTick();
  std::uint64_t upTo(std::uint64_t tick) const;

  mcap::IndexedReader file_;
  std::size_t runs_ = 0;
  /// The chunk that ends with the run's start, and the one that has the next run's, or how many
  /// chunks there are: what the former holds before its start is another run's.
  std::size_t begin_ = 0, end_ = 0;
  v1::RecordingStart start_;
  std::uint64_t began_ = 0;  ///< nanoseconds in the file, of its tick 0
  std::uint64_t lastTick_ = 0;
  std::size_t chunk_ = 0;
  std::uint64_t after_ = 0;  ///< nanoseconds in the file
};

}  // namespace enfilade::protocol
