// A recording that is read from any tick on: the nearest checkpoint before it, and what happened
// after it. Of a file in which the world begins anew only the first walk is read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "protocol/mcap/indexed_reader.hpp"
#include "protocol/recording.hpp"

namespace enfilade::protocol {

/// All functions throw mcap::RecordingError.
class SeekableRecording {
 public:
  explicit SeekableRecording(const std::filesystem::path& file);

  const v1::RecordingStart& start() const { return start_; }
  /// The tick that it begins after: 0, or where a branch left its parent.
  std::uint64_t firstTick() const { return start_.parent().tick(); }
  std::uint64_t lastTick() const { return lastTick_; }  ///< the last of which a state was recorded
  bool closed() const { return file_.closed(); }        ///< by its writer
  bool beginsAnew() const { return end_ < file_.chunks().size(); }  ///< there are more walks

  /// The last one at or before `tick`.
  std::optional<v1::RecordedCheckpoint> checkpointBefore(std::uint64_t tick);

  /// next() goes on with what happened after `tick`, its checkpoint left out.
  void seek(std::uint64_t tick);
  /// In the order in which it happened; nullopt at the end of the walk.
  std::optional<RecordedItem> next();

 private:
  void readStart();
  void findEnd();
  std::uint64_t timeOf(std::uint64_t tick) const;

  mcap::IndexedReader file_;
  v1::RecordingStart start_;
  std::size_t end_ = 0;  ///< the chunk in which the next walk begins, or how many there are
  std::uint64_t lastTick_ = 0;
  std::size_t chunk_ = 0;
  std::uint64_t after_ = 0;  ///< nanoseconds
};

}  // namespace enfilade::protocol
