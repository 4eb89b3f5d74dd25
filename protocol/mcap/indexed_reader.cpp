#include "protocol/mcap/indexed_reader.hpp"

#include "protocol/mcap/reader.hpp"

namespace enfilade::protocol::mcap {
namespace {

constexpr std::uint64_t kFooterBytes =
    kRecordHeadBytes + 20;                     // bytes: summary start, offset start, CRC
constexpr std::uint64_t kChunkHeadBytes = 28;  // bytes: times, size, CRC
constexpr std::uint64_t kDataEndBytes = kRecordHeadBytes + 4;

ChunkIndex parseChunkIndex(std::string_view content) {
  Fields fields(content);
  ChunkIndex index;
  index.firstTime = fields.number<std::uint64_t>();
  index.lastTime = fields.number<std::uint64_t>();
  index.start = fields.number<std::uint64_t>();
  index.length = fields.number<std::uint64_t>();
  Fields offsets(fields.string());
  while (!offsets.empty()) {
    index.channels.insert(offsets.number<std::uint16_t>());
    offsets.number<std::uint64_t>();
  }
  index.indexLength = fields.number<std::uint64_t>();
  return index;
}

/// Makes the index records that must follow the chunk.
std::string makeIndexRecords(const Chunk& chunk) {
  std::string records;
  for (const auto& [channel, content] : chunk.index)
    putRecord(records, Opcode::messageIndex, content);
  return records;
}

}  // namespace

IndexedReader::IndexedReader(std::filesystem::path file) : file_(std::move(file)) {
  stream_ = openMcap(file_, size_);
  closed_ = readSummary();
  if (!closed_) scan();
  if (!closed_) dropTornChunk();
  if (!chunks_.empty()) open(0);  // loads the definitions
}

void IndexedReader::fail(std::uint64_t at, const std::string& what) const {
  throw RecordingError(file_.string() + ": at byte " + std::to_string(at) + ": " + what);
}

std::string IndexedReader::bytesAt(std::uint64_t at, std::uint64_t length) {
  if (at > size_ || length > size_ - at || length > 2 * kMaxChunkBytes)
    fail(at, "the file does not have " + std::to_string(length) + " bytes there");
  std::string bytes(length, '\0');
  stream_.clear();
  stream_.seekg(static_cast<std::streamoff>(at));
  stream_.read(bytes.data(), static_cast<std::streamsize>(length));
  if (!stream_) fail(at, "the file cannot be read further");
  return bytes;
}

/// Returns false if the file was not closed.
bool IndexedReader::readSummary() {
  const std::uint64_t minStart = kMagic.size() + kDataEndBytes + kFooterBytes + kMagic.size();
  if (size_ < minStart || bytesAt(size_ - kMagic.size(), kMagic.size()) != kMagic) return false;
  const std::uint64_t footerAt = size_ - kMagic.size() - kFooterBytes;
  const std::string footer = bytesAt(footerAt, kFooterBytes);
  Fields fields(footer);
  if (static_cast<Opcode>(fields.number<std::uint8_t>()) != Opcode::footer ||
      fields.number<std::uint64_t>() != kFooterBytes - kRecordHeadBytes)
    return false;
  const auto start = fields.number<std::uint64_t>();
  fields.number<std::uint64_t>();  // summary offset start
  const auto crc = fields.number<std::uint32_t>();
  if (start < kMagic.size() + kDataEndBytes || start > footerAt)
    fail(footerAt, "the footer gives a wrong summary position");
  const std::string records = bytesAt(start, footerAt - start);
  if (computeCrc(std::string_view(footer).substr(0, kFooterBytes - 4), computeCrc(records)) != crc)
    fail(footerAt, "the summary is corrupt (its CRC differs)");
  try {
    readSummaryRecords(records);
  } catch (const std::out_of_range& error) {
    fail(start, error.what());
  }
  return true;
}

void IndexedReader::readSummaryRecords(std::string_view records) {
  Fields fields(records);
  while (!fields.empty()) {
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    const std::string_view content = fields.takeBytes(fields.number<std::uint64_t>());
    if (opcode == Opcode::schema || opcode == Opcode::channel) definitions_.read(opcode, content);
    if (opcode == Opcode::chunkIndex) chunks_.push_back(parseChunkIndex(content));
  }
}

/// Finds the chunks by scanning all record headers. Incomplete records are skipped.
void IndexedReader::scan() {
  std::uint64_t at = kMagic.size();
  while (size_ - at >= kRecordHeadBytes) {
    const std::string head = bytesAt(at, kRecordHeadBytes);
    Fields fields(head);
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    const auto length = fields.number<std::uint64_t>();
    if (length > size_ - at - kRecordHeadBytes) break;
    const std::uint64_t end = at + kRecordHeadBytes + length;
    if (opcode == Opcode::chunk && length >= kChunkHeadBytes) {
      const std::string bytes = bytesAt(at + kRecordHeadBytes, kChunkHeadBytes);
      Fields content(bytes);
      const ChunkHead chunk = parseChunkHead(content);
      chunks_.push_back({at, end - at, 0, chunk.firstTime, chunk.lastTime, {}});
    } else if (opcode == Opcode::messageIndex && !chunks_.empty() && length >= 2) {
      const std::string number = bytesAt(at + kRecordHeadBytes, 2);
      chunks_.back().channels.insert(Fields(number).number<std::uint16_t>());
      chunks_.back().indexLength += end - at;
    } else if (opcode == Opcode::dataEnd) {
      return;
    }
    at = end;
  }
}

std::uint16_t IndexedReader::findChannel(const std::string& topic) const {
  for (const auto& [number, channel] : definitions_.channels)
    if (channel.topic == topic) return number;
  return 0;
}

Chunk IndexedReader::loadChunk(const ChunkIndex& index) {
  const std::string record = bytesAt(index.start, index.length);
  try {
    Fields fields(record);
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    if (opcode != Opcode::chunk ||
        fields.number<std::uint64_t>() != record.size() - kRecordHeadBytes)
      fail(index.start, "the summary gives a wrong chunk position");
    Chunk chunk = openChunk(fields.rest(), definitions_);
    if (chunk.head.firstTime != index.firstTime || chunk.head.lastTime != index.lastTime)
      fail(index.start, "a chunk's times differ from the summary");
    return chunk;
  } catch (const std::out_of_range& error) {
    fail(index.start, error.what());
  }
}

/// Chunk and indexes are written in one call, but a crash may leave only a part on the disk.
void IndexedReader::dropTornChunk() {
  if (chunks_.empty()) return;
  // Without a summary all chunks are read for definitions: a channel may begin in any of them.
  for (std::size_t i = 0; i + 1 < chunks_.size(); ++i) loadChunk(chunks_[i]);
  const ChunkIndex& last = chunks_.back();
  const std::string expected = makeIndexRecords(loadChunk(last));
  if (last.indexLength < expected.size() && expected.starts_with(indexBytes(last)))
    chunks_.pop_back();
}

std::string IndexedReader::indexBytes(const ChunkIndex& index) {
  return bytesAt(index.start + index.length, index.indexLength);
}

void IndexedReader::open(std::size_t chunk) {
  offset_ = 0;
  if (chunk == openChunk_) return;
  openChunk_ = ~std::size_t{0};
  const ChunkIndex& index = chunks_.at(chunk);
  Chunk opened = loadChunk(index);
  if (indexBytes(index) != makeIndexRecords(opened))
    fail(index.start + index.length, "an index does not match its chunk");
  records_ = std::move(opened.records);
  openChunk_ = chunk;
}

bool IndexedReader::next(Message& message) {
  return readNextMessage(records_, offset_, definitions_, message);
}

}  // namespace enfilade::protocol::mcap
