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

/// A start is the last message of its chunk (RecordingWriter), so that each has a chunk.
void SeekableRecording::findRun(std::uint32_t run) {
  const std::uint16_t starts = file_.channelOf(kStartTopic);
  const auto& chunks = file_.chunks();
  begin_ = end_ = chunks.size();
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (!chunks[i].channels.contains(starts)) continue;
    ++runs_;
    if (runs_ == run) begin_ = i;
    if (runs_ == std::size_t{run} + 1) end_ = i;
  }
  if (begin_ == chunks.size()) failWithoutRun(file_.file(), run, runs_);
}

void SeekableRecording::readStart() {
  file_.open(begin_);
  mcap::Message message;
  bool found = false;
  while (!found && file_.next(message)) found = message.channel->topic == kStartTopic;
  if (!found)
    throw RecordingError(file_.file().string() + ": a chunk lacks the start that it should have");
  start_ = std::get<v1::RecordingStart>(*itemFrom(message, file_.file()));
  if (mcap::Message more; file_.next(more))
    throw RecordingError(file_.file().string() +
                         ": other chunks than those it was recorded in, as some tools make them: "
                         "it can be read from its beginning, and not from the middle");
  const std::uint64_t before =
      nanosecondsOf(static_cast<double>(firstTick()) * start_.lengths().tick());
  if (message.time < before)
    throw RecordingError(file_.file().string() + ": a branch begins before its first tick");
  began_ = message.time - before;
}

/// From the end on, since the last tick is near it.
void SeekableRecording::findLastTick() {
  lastTick_ = firstTick();
  for (std::size_t i = std::min(end_, file_.chunks().size() - 1); i >= begin_; --i) {
    file_.open(i);
    bool found = false;
    mcap::Message message;
    while (file_.next(message)) {
      if (i == end_ && message.channel->topic == kStartTopic) break;
      if (message.time <= upTo(firstTick())) continue;
      const auto item = itemFrom(message, file_.file());
      const auto* state = item ? std::get_if<v1::State>(&*item) : nullptr;
      if (state) lastTick_ = state->tick(), found = true;
    }
    if (found || i == begin_) return;
  }
}

/// Half a tick later, so that it does not matter how times of the file were rounded.
std::uint64_t SeekableRecording::upTo(std::uint64_t tick) const {
  return began_ + nanosecondsOf((static_cast<double>(tick) + 0.5) * start_.lengths().tick());
}

std::optional<v1::RecordedCheckpoint> SeekableRecording::checkpointBefore(std::uint64_t tick) {
  const std::uint16_t checkpoints = file_.channelOf(kCheckpointTopic);
  const std::uint64_t time = upTo(tick);
  for (std::size_t i = std::min(end_, file_.chunks().size()); i-- > begin_;) {
    const mcap::ChunkPlace& place = file_.chunks()[i];
    if (!place.channels.contains(checkpoints) || place.firstTime > time) continue;
    file_.open(i);
    mcap::Message message;
    std::optional<v1::RecordedCheckpoint> found;
    while (file_.next(message)) {
      if (message.channel->topic != kCheckpointTopic || message.time > time) continue;
      found = std::get<v1::RecordedCheckpoint>(*itemFrom(message, file_.file()));
    }
    seek(tick);
    if (found) return found;
  }
  return std::nullopt;
}

void SeekableRecording::seek(std::uint64_t tick) {
  after_ = upTo(tick);
  const auto& chunks = file_.chunks();
  chunk_ = begin_;
  while (chunk_ < std::min(end_, chunks.size()) && chunks[chunk_].lastTime <= after_) ++chunk_;
  if (chunk_ < chunks.size()) file_.open(chunk_);
}

std::optional<RecordedItem> SeekableRecording::next() {
  mcap::Message message;
  while (chunk_ < file_.chunks().size()) {
    while (file_.next(message)) {
      if (chunk_ == end_ && message.channel->topic == kStartTopic) {
        chunk_ = file_.chunks().size();
        return std::nullopt;
      }
      if (message.time <= after_ || message.channel->topic == kCheckpointTopic) continue;
      if (auto item = itemFrom(message, file_.file())) return item;
    }
    if (++chunk_ < file_.chunks().size()) file_.open(chunk_);
  }
  return std::nullopt;
}

}  // namespace enfilade::protocol
