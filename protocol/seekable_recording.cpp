#include "protocol/seekable_recording.hpp"

#include <algorithm>

namespace enfilade::protocol {

using mcap::RecordingError;

SeekableRecording::SeekableRecording(const std::filesystem::path& file) : file_(file) {
  readStart();
  findEnd();
  seek(firstTick());
}

void SeekableRecording::readStart() {
  if (!file_.chunks().empty()) {
    file_.open(0);
    mcap::Message message;
    while (file_.next(message)) {
      const auto item = itemFrom(message, file_.file());
      if (!item || !std::holds_alternative<v1::RecordingStart>(*item)) continue;
      start_ = std::get<v1::RecordingStart>(*item);
      return;
    }
  }
  throw RecordingError(file_.file().string() + ": no recording of Enfilade begins in it");
}

/// Where the walk ends: at its second start, or with the file.
void SeekableRecording::findEnd() {
  const std::uint16_t starts = file_.channelOf(kStartTopic);
  const auto& chunks = file_.chunks();
  end_ = 1;
  while (end_ < chunks.size() && !chunks[end_].channels.contains(starts)) ++end_;
  lastTick_ = firstTick();
  const std::uint64_t before = timeOf(firstTick());
  for (std::size_t i = std::min(end_, chunks.size() - 1);; --i) {
    file_.open(i);
    mcap::Message message;
    bool found = false;
    while (file_.next(message)) {
      if (i == end_ && message.channel->topic == kStartTopic) break;
      if (message.time <= before) continue;
      const auto item = itemFrom(message, file_.file());
      const auto* state = item ? std::get_if<v1::State>(&*item) : nullptr;
      if (state) lastTick_ = state->tick(), found = true;
    }
    if (found || i == 0) return;
  }
}

std::uint64_t SeekableRecording::timeOf(std::uint64_t tick) const {
  return nanosecondsOf(static_cast<double>(tick) * start_.lengths().tick());
}

std::optional<v1::RecordedCheckpoint> SeekableRecording::checkpointBefore(std::uint64_t tick) {
  const std::uint16_t checkpoints = file_.channelOf(kCheckpointTopic);
  const std::uint64_t time = timeOf(tick);
  for (std::size_t i = std::min(end_, file_.chunks().size()); i-- > 0;) {
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
  after_ = timeOf(tick);
  const auto& chunks = file_.chunks();
  chunk_ = 0;
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
