#include "protocol/recording/seekable_recording.hpp"

#include <algorithm>

namespace enfilade::protocol {

using mcap::RecordingError;

SeekableRecording::SeekableRecording(const std::filesystem::path& file, std::uint32_t run)
    : file_(file) {
  findRun(run);
  readStart();
  findLastTick();
  seek(firstTick());
}

/// Finds a run. RecordingWriter ends a chunk after each start, so that each start has its own
/// chunk.
void SeekableRecording::findRun(std::uint32_t run) {
  const std::uint16_t starts = file_.findChannel(kStartTopic);
  const auto& chunks = file_.chunks();
  beginChunk_ = endChunk_ = chunks.size();
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (!chunks[i].channels.contains(starts)) continue;
    ++runs_;
    if (runs_ == run) beginChunk_ = i;
    if (runs_ == std::size_t{run} + 1) endChunk_ = i;
  }
  if (beginChunk_ == chunks.size()) throwMissingRun(file_.file(), run, runs_);
}

void SeekableRecording::readStart() {
  file_.open(beginChunk_);
  mcap::Message message;
  bool found = false;
  while (!found && file_.next(message)) found = message.channel->topic == kStartTopic;
  if (!found) throw RecordingError(file_.file().string() + ": a chunk lacks its expected start");
  start_ = std::get<v1::RecordingStart>(*parseRecordedItem(message, file_.file()));
  if (mcap::Message more; file_.next(more))
    throw RecordingError(file_.file().string() +
                         ": its chunks are not those of the recorder; another tool may have "
                         "changed them: "
                         "it can be read only from its beginning");
  const std::uint64_t before =
      toNanoseconds(static_cast<double>(firstTick()) * start_.lengths().tick());
  if (message.time < before)
    throw RecordingError(file_.file().string() + ": a branch begins before its first tick");
  startTime_ = message.time - before;
}

/// Searches backwards, because the last tick is near the end.
void SeekableRecording::findLastTick() {
  lastTick_ = firstTick();
  for (std::size_t i = std::min(endChunk_, file_.chunks().size() - 1); i >= beginChunk_; --i) {
    file_.open(i);
    bool found = false;
    mcap::Message message;
    while (file_.next(message)) {
      if (i == endChunk_ && message.channel->topic == kStartTopic) break;
      if (message.time <= toFileTime(firstTick())) continue;
      const auto item = parseRecordedItem(message, file_.file());
      const auto* state = item ? std::get_if<v1::State>(&*item) : nullptr;
      if (state) lastTick_ = state->tick(), found = true;
    }
    if (found || i == beginChunk_) return;
  }
}

/// Returns the time half a tick after `tick`, so that rounded file times compare correctly.
std::uint64_t SeekableRecording::toFileTime(std::uint64_t tick) const {
  return startTime_ + toNanoseconds((static_cast<double>(tick) + 0.5) * start_.lengths().tick());
}

std::optional<v1::RecordedCheckpoint> SeekableRecording::checkpointBefore(std::uint64_t tick) {
  const std::uint16_t checkpoints = file_.findChannel(kCheckpointTopic);
  const std::uint64_t time = toFileTime(tick);
  for (std::size_t i = std::min(endChunk_, file_.chunks().size()); i-- > beginChunk_;) {
    const mcap::ChunkIndex& index = file_.chunks()[i];
    if (!index.channels.contains(checkpoints) || index.firstTime > time) continue;
    file_.open(i);
    mcap::Message message;
    std::optional<v1::RecordedCheckpoint> found;
    while (file_.next(message)) {
      if (message.channel->topic != kCheckpointTopic || message.time > time) continue;
      found = std::get<v1::RecordedCheckpoint>(*parseRecordedItem(message, file_.file()));
    }
    seek(tick);
    if (found) return found;
  }
  return std::nullopt;
}

void SeekableRecording::seek(std::uint64_t tick) {
  afterTime_ = toFileTime(tick);
  const auto& chunks = file_.chunks();
  chunk_ = beginChunk_;
  while (chunk_ < std::min(endChunk_, chunks.size()) && chunks[chunk_].lastTime <= afterTime_)
    ++chunk_;
  if (chunk_ < chunks.size()) file_.open(chunk_);
}

std::optional<RecordedItem> SeekableRecording::next() {
  mcap::Message message;
  while (chunk_ < file_.chunks().size()) {
    while (file_.next(message)) {
      if (chunk_ == endChunk_ && message.channel->topic == kStartTopic) {
        chunk_ = file_.chunks().size();
        return std::nullopt;
      }
      if (message.time <= afterTime_ || message.channel->topic == kCheckpointTopic) continue;
      if (auto item = parseRecordedItem(message, file_.file())) return item;
    }
    if (++chunk_ < file_.chunks().size()) file_.open(chunk_);
  }
  return std::nullopt;
}

}  // namespace enfilade::protocol
