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
    throw RecordingError(file.string() + ": at byte 0: not an MCAP file");
  return stream;
}

Reader::Reader(std::filesystem::path file) : file_(std::move(file)) {
  stream_ = openMcap(file_, size_);
  position_ = kMagic.size();
  crc_ = computeCrc(kMagic);
  const auto header = readRecord();
  if (!header || header->opcode != Opcode::header) fail(position_, "the header is missing");
  try {
    Fields fields(header->content);
    fields.string();  // profile
    library_ = fields.string();
  } catch (const std::out_of_range& error) {
    fail(header->start, error.what());
  }
  wholeBytes_ = position_;
}

void Reader::fail(std::uint64_t at, const std::string& what) const {
  throw RecordingError(file_.string() + ": at byte " + std::to_string(at) + ": " + what);
}

/// Returns nullopt if the file ends inside the record.
std::optional<Reader::Record> Reader::readRecord() {
  if (size_ - position_ < kRecordHeadBytes) return std::nullopt;
  Record record{{}, position_, std::string(kRecordHeadBytes, '\0'), {}};
  stream_.read(record.head.data(), static_cast<std::streamsize>(kRecordHeadBytes));
  Fields fields(record.head);
  record.opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
  const auto length = fields.number<std::uint64_t>();
  if (length > 2 * kMaxChunkBytes)
    fail(position_, "a record claims " + std::to_string(length) + " bytes");
  if (length > size_ - position_ - kRecordHeadBytes) return std::nullopt;
  record.content.resize(length);
  stream_.read(record.content.data(), static_cast<std::streamsize>(length));
  if (!stream_) fail(position_, "the file cannot be read further");
  position_ += kRecordHeadBytes + length;
  // The data CRC covers all bytes before the DataEnd record, which contains it.
  if (record.opcode != Opcode::dataEnd)
    crc_ = computeCrc(record.content, computeCrc(record.head, crc_));
  return record;
}

/// Opens a chunk and stores its expected index records.
void Reader::loadChunk(const Record& record) {
  Chunk chunk;
  try {
    chunk = openChunk(record.content, definitions_);
  } catch (const std::out_of_range& error) {
    fail(record.start, error.what());
  }
  chunk_ = std::move(chunk.records);
  ++chunks_;
  chunkOffset_ = 0;
  expectedIndexes_.clear();
  for (auto& [channel, content] : chunk.index) expectedIndexes_.push_back(std::move(content));
}

void Reader::checkIndex(const Record& record) {
  if (expectedIndexes_.empty() || expectedIndexes_.front() != record.content)
    fail(record.start, "an index does not match its chunk");
  expectedIndexes_.erase(expectedIndexes_.begin());
  if (expectedIndexes_.empty()) wholeBytes_ = position_;
}

/// Checks the file from the end of the data to its end.
void Reader::readSummary(const Record& dataEnd) {
  if (Fields(dataEnd.content).number<std::uint32_t>() != crc_)
    fail(dataEnd.start, "the data are corrupt (their CRC differs)");
  const std::uint64_t start = position_;
  std::uint32_t crc = 0;
  for (;;) {
    const auto record = readRecord();
    if (!record) return;  // truncated in the summary: the data are complete
    if (record->opcode == Opcode::statistics &&
        Fields(record->content).number<std::uint64_t>() != messages_)
      fail(record->start, "the summary has a wrong message count");
    if (record->opcode != Opcode::footer) {
      crc = computeCrc(record->content, computeCrc(record->head, crc));
      continue;
    }
    Fields fields(record->content);
    const std::string_view offsets = fields.takeBytes(16);
    crc = computeCrc(offsets, computeCrc(record->head, crc));
    if (Fields(offsets).number<std::uint64_t>() != start || fields.number<std::uint32_t>() != crc)
      fail(record->start, "the summary is corrupt (its CRC differs)");
    std::string magic(kMagic.size(), '\0');
    stream_.read(magic.data(), static_cast<std::streamsize>(magic.size()));
    if (!stream_ || magic != kMagic || size_ != position_ + kMagic.size())
      fail(position_, "the closing magic bytes are missing");
    wholeBytes_ = size_;
    closed_ = true;
    return;
  }
}

/// Opens the next chunk; false at the end of the data.
bool Reader::loadNextChunk() {
  for (;;) {
    const auto record = readRecord();
    if (!record) return false;
    if (!expectedIndexes_.empty() && record->opcode != Opcode::messageIndex)
      fail(record->start, "a chunk's index is missing");
    switch (record->opcode) {
      case Opcode::chunk:
        loadChunk(*record);
        if (expectedIndexes_.empty()) wholeBytes_ = position_;
        return true;
      case Opcode::messageIndex:
        checkIndex(*record);
        break;
      case Opcode::dataEnd:
        wholeBytes_ = position_;
        readSummary(*record);
        return false;
      default:
        fail(record->start, "an unknown record lies between the chunks");
    }
  }
}

std::optional<Message> Reader::next() {
  Message message;
  try {
    while (!ended_) {
      if (readNextMessage(chunk_, chunkOffset_, definitions_, message)) {
        ++messages_;
        return message;
      }
      ended_ = !loadNextChunk();
    }
  } catch (const std::out_of_range& error) {
    ended_ = true;
    fail(position_, error.what());
  } catch (const RecordingError&) {
    ended_ = true;
    throw;
  }
  return std::nullopt;
}

}  // namespace enfilade::protocol::mcap
