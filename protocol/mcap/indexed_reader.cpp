#include "protocol/mcap/indexed_reader.hpp"

#include "protocol/mcap/reader.hpp"

namespace enfilade::protocol::mcap {
namespace {

constexpr std::uint64_t kFooter = kRecordHead + 20;  // bytes: start of the summary, offsets, CRC
constexpr std::uint64_t kChunkHead = 28;             // bytes: times, size, CRC
constexpr std::uint64_t kDataEnd = kRecordHead + 4;

ChunkPlace placeFrom(std::string_view content) {
  Fields fields(content);
  ChunkPlace place;
  place.firstTime = fields.number<std::uint64_t>();
  place.lastTime = fields.number<std::uint64_t>();
  place.start = fields.number<std::uint64_t>();
  place.length = fields.number<std::uint64_t>();
  Fields offsets(fields.string());
  while (!offsets.empty()) {
    place.channels.insert(offsets.number<std::uint16_t>());
    offsets.number<std::uint64_t>();
  }
  place.indexLength = fields.number<std::uint64_t>();
  return place;
}

/// The records that must follow the chunk.
std::string indexesOf(const Chunk& chunk) {
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
  if (!chunks_.empty()) open(0);  // brings the definitions
}

void IndexedReader::fail(std::uint64_t at, const std::string& what) const {
  throw RecordingError(file_.string() + ": at byte " + std::to_string(at) + ": " + what);
}

std::string IndexedReader::bytesAt(std::uint64_t at, std::uint64_t length) {
  if (at > size_ || length > size_ - at || length > 2 * kMostChunkBytes)
    fail(at, "the file has no " + std::to_string(length) + " bytes there");
  std::string bytes(length, '\0');
  stream_.clear();
  stream_.seekg(static_cast<std::streamoff>(at));
  stream_.read(bytes.data(), static_cast<std::streamsize>(length));
  if (!stream_) fail(at, "the file cannot be read on");
  return bytes;
}

/// False where the file does not end as a closed one.
bool IndexedReader::readSummary() {
  const std::uint64_t least = kMagic.size() + kDataEnd + kFooter + kMagic.size();
  if (size_ < least || bytesAt(size_ - kMagic.size(), kMagic.size()) != kMagic) return false;
  const std::uint64_t footerAt = size_ - kMagic.size() - kFooter;
  const std::string footer = bytesAt(footerAt, kFooter);
  Fields fields(footer);
  if (static_cast<Opcode>(fields.number<std::uint8_t>()) != Opcode::footer ||
      fields.number<std::uint64_t>() != kFooter - kRecordHead)
    return false;
  const auto start = fields.number<std::uint64_t>();
  fields.number<std::uint64_t>();  // offsets of groups
  const auto crc = fields.number<std::uint32_t>();
  if (start < kMagic.size() + kDataEnd || start > footerAt)
    fail(footerAt, "the summary is not where the footer says");
  const std::string records = bytesAt(start, footerAt - start);
  if (crcOf(std::string_view(footer).substr(0, kFooter - 4), crcOf(records)) != crc)
    fail(footerAt, "the summary is not as it was written (its CRC differs)");
  try {
    readSummaryRecords(records);
  } catch (const std::out_of_range& what) {
    fail(start, what.what());
  }
  return true;
}

void IndexedReader::readSummaryRecords(std::string_view records) {
  Fields fields(records);
  while (!fields.empty()) {
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    const std::string_view content = fields.take(fields.number<std::uint64_t>());
    if (opcode == Opcode::schema || opcode == Opcode::channel) definitions_.read(opcode, content);
    if (opcode == Opcode::chunkIndex) chunks_.push_back(placeFrom(content));
  }
}

/// Finds the chunks by the heads of all records; what does not stand there whole is left out.
void IndexedReader::scan() {
  std::uint64_t at = kMagic.size();
  while (size_ - at >= kRecordHead) {
    const std::string head = bytesAt(at, kRecordHead);
    Fields fields(head);
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    const auto length = fields.number<std::uint64_t>();
    if (length > size_ - at - kRecordHead) break;
    const std::uint64_t end = at + kRecordHead + length;
    if (opcode == Opcode::chunk && length >= kChunkHead) {
      const std::string bytes = bytesAt(at + kRecordHead, kChunkHead);
      Fields content(bytes);
      const ChunkHead chunk = chunkHeadFrom(content);
      chunks_.push_back({at, end - at, 0, chunk.firstTime, chunk.lastTime, {}});
    } else if (opcode == Opcode::messageIndex && !chunks_.empty() && length >= 2) {
      const std::string number = bytesAt(at + kRecordHead, 2);
      chunks_.back().channels.insert(Fields(number).number<std::uint16_t>());
      chunks_.back().indexLength += end - at;
    } else if (opcode == Opcode::dataEnd) {
      return;
    }
    at = end;
  }
}

std::uint16_t IndexedReader::channelOf(const std::string& topic) const {
  for (const auto& [number, channel] : definitions_.channels)
    if (channel.topic == topic) return number;
  return 0;
}

Chunk IndexedReader::unpack(const ChunkPlace& place) {
  const std::string record = bytesAt(place.start, place.length);
  try {
    Fields fields(record);
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    if (opcode != Opcode::chunk || fields.number<std::uint64_t>() != record.size() - kRecordHead)
      fail(place.start, "there is no chunk where the summary says");
    Chunk chunk = openChunk(fields.rest(), definitions_);
    if (chunk.head.firstTime != place.firstTime || chunk.head.lastTime != place.lastTime)
      fail(place.start, "a chunk has other times than the summary says");
    return chunk;
  } catch (const std::out_of_range& what) {
    fail(place.start, what.what());
  }
}

/// Chunk and indexes are written in one piece, but a disk may keep only a part of it.
void IndexedReader::dropTornChunk() {
  if (chunks_.empty()) return;
  // Without a summary all of them are needed for the definitions: channels may begin in any.
  for (std::size_t i = 0; i + 1 < chunks_.size(); ++i) unpack(chunks_[i]);
  const ChunkPlace& last = chunks_.back();
  const std::string expected = indexesOf(unpack(last));
  if (last.indexLength < expected.size() && expected.starts_with(indexBytes(last)))
    chunks_.pop_back();
}

std::string IndexedReader::indexBytes(const ChunkPlace& place) {
  return bytesAt(place.start + place.length, place.indexLength);
}

void IndexedReader::open(std::size_t chunk) {
  at_ = 0;
  if (chunk == open_) return;
  open_ = ~std::size_t{0};
  const ChunkPlace& place = chunks_.at(chunk);
  Chunk opened = unpack(place);
  if (indexBytes(place) != indexesOf(opened))
    fail(place.start + place.length, "an index is not that of its chunk");
  records_ = std::move(opened.records);
  open_ = chunk;
}

bool IndexedReader::next(Message& message) {
  return nextMessage(records_, at_, definitions_, message);
}

}  // namespace enfilade::protocol::mcap
