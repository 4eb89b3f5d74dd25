#include "protocol/mcap/reader.hpp"

#include <algorithm>

namespace enfilade::protocol::mcap {

bool isMcap(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string magic(kMagic.size(), '\0');
  return stream.read(magic.data(), static_cast<std::streamsize>(magic.size())) && magic == kMagic;
}

std::ifstream openMcap(const std::filesystem::path& file, std::uint64_t& size) {
  std::error_code problem;
  std::ifstream stream;
  size = std::filesystem::file_size(file, problem);
  if (!problem) stream.open(file, std::ios::binary);
  if (problem || !stream)
    throw RecordingError(file.string() + ": cannot be read" +
                         (problem ? ": " + problem.message() : std::string()));
  std::string magic(kMagic.size(), '\0');
  stream.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (!stream || magic != kMagic)
    throw RecordingError(file.string() +
                         ": at byte 0: this is no MCAP file: it does not begin as one");
  return stream;
}

Reader::Reader(std::filesystem::path file) : file_(std::move(file)) {
  stream_ = openMcap(file_, size_);
  position_ = kMagic.size();
  crc_ = crcOf(kMagic);
  const auto header = readRecord();
  if (!header || header->opcode != Opcode::header) fail(position_, "there is no header");
  try {
    Fields fields(header->content);
    fields.string();  // the profile
    library_ = fields.string();
  } catch (const std::out_of_range& what) {
    fail(header->start, what.what());
  }
  whole_ = position_;
}

void Reader::fail(std::uint64_t at, const std::string& what) const {
  throw RecordingError(file_.string() + ": at byte " + std::to_string(at) + ": " + what);
}

/// nullopt when the file ends before the record does.
std::optional<Reader::Record> Reader::readRecord() {
  if (size_ - position_ < kRecordHead) return std::nullopt;
  Record record{{}, position_, std::string(kRecordHead, '\0'), {}};
  stream_.read(record.head.data(), static_cast<std::streamsize>(kRecordHead));
  Fields fields(record.head);
  record.opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
  const auto length = fields.number<std::uint64_t>();
  if (length > 2 * kMostChunkBytes)
    fail(position_, "a record claims " + std::to_string(length) + " bytes");
  if (length > size_ - position_ - kRecordHead) return std::nullopt;
  record.content.resize(length);
  stream_.read(record.content.data(), static_cast<std::streamsize>(length));
  if (!stream_) fail(position_, "the file cannot be read on");
  position_ += kRecordHead + length;
  // The CRC of the data section covers all that comes before the record that holds it.
  if (record.opcode != Opcode::dataEnd) crc_ = crcOf(record.content, crcOf(record.head, crc_));
  return record;
}

/// Notes what the chunk's indexes must say.
void Reader::takeChunk(const Record& record) {
  Chunk chunk;
  try {
    chunk = openChunk(record.content, definitions_);
  } catch (const std::out_of_range& what) {
    fail(record.start, what.what());
  }
  chunk_ = std::move(chunk.records);
  ++chunks_;
  inChunk_ = 0;
  expected_.clear();
  for (auto& [channel, content] : chunk.index) expected_.push_back(std::move(content));
}

void Reader::checkIndex(const Record& record) {
  if (expected_.empty() || expected_.front() != record.content)
    fail(record.start, "an index is not that of its chunk");
  expected_.erase(expected_.begin());
  if (expected_.empty()) whole_ = position_;
}

/// From the end of the data to the end of the file.
void Reader::readSummary(const Record& dataEnd) {
  if (Fields(dataEnd.content).number<std::uint32_t>() != crc_)
    fail(dataEnd.start, "the data are not as they were written (their CRC differs)");
  const std::uint64_t start = position_;
  std::uint32_t crc = 0;
  for (;;) {
    const auto record = readRecord();
    if (!record) return;  // cut off in the summary: the data are whole
    if (record->opcode == Opcode::statistics &&
        Fields(record->content).number<std::uint64_t>() != messages_)
      fail(record->start, "the summary counts other messages than there are");
    if (record->opcode != Opcode::footer) {
      crc = crcOf(record->content, crcOf(record->head, crc));
      continue;
    }
    Fields fields(record->content);
    const std::string_view offsets = fields.take(16);
    crc = crcOf(offsets, crcOf(record->head, crc));
    if (Fields(offsets).number<std::uint64_t>() != start || fields.number<std::uint32_t>() != crc)
      fail(record->start, "the summary is not as it was written (its CRC differs)");
    std::string magic(kMagic.size(), '\0');
    stream_.read(magic.data(), static_cast<std::streamsize>(magic.size()));
    if (!stream_ || magic != kMagic || size_ != position_ + kMagic.size())
      fail(position_, "the file does not end as an MCAP file");
    whole_ = size_;
    closed_ = true;
    return;
  }
}

/// Opens the next chunk; false at the end of the data.
bool Reader::readMore() {
  for (;;) {
    const auto record = readRecord();
    if (!record) return false;
    if (!expected_.empty() && record->opcode != Opcode::messageIndex)
      fail(record->start, "a chunk's index is missing");
    switch (record->opcode) {
      case Opcode::chunk:
        takeChunk(*record);
        if (expected_.empty()) whole_ = position_;
        return true;
      case Opcode::messageIndex:
        checkIndex(*record);
        break;
      case Opcode::dataEnd:
        whole_ = position_;
        readSummary(*record);
        return false;
      default:
        fail(record->start, "an unknown record stands between the chunks");
    }
  }
}

std::optional<Message> Reader::next() {
  Message message;
  try {
    while (!ended_) {
      if (nextMessage(chunk_, inChunk_, definitions_, message)) {
        ++messages_;
        return message;
      }
      ended_ = !readMore();
    }
  } catch (const std::out_of_range& what) {
    ended_ = true;
    fail(position_, what.what());
  } catch (const RecordingError&) {
    ended_ = true;
    throw;
  }
  return std::nullopt;
}

}  // namespace enfilade::protocol::mcap
