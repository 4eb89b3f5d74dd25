#include "protocol/mcap/chunk.hpp"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>

namespace enfilade::protocol::mcap {
namespace {

std::string decompress(std::string_view compression, std::string_view packed, std::uint64_t size) {
  if (compression.empty()) return std::string(packed);
  if (compression != "zstd")
    throw std::out_of_range("a chunk is compressed with '" + std::string(compression) +
                            "', not with "
                            "zstd");
  std::string records(size, '\0');
  const std::size_t unpacked =
      ZSTD_decompress(records.data(), records.size(), packed.data(), packed.size());
  if (ZSTD_isError(unpacked) || unpacked != size)
    throw std::out_of_range("a chunk cannot be decompressed");
  return records;
}

/// Reads the definitions and computes the expected message indexes of the chunk.
void readRecords(Chunk& chunk, Definitions& definitions) {
  std::uint64_t earliest = ~std::uint64_t{0}, latest = 0;
  Fields records(chunk.records);
  while (!records.empty()) {
    const std::uint64_t offset = chunk.records.size() - Fields(records).rest().size();
    const auto opcode = static_cast<Opcode>(records.number<std::uint8_t>());
    const std::string_view content = records.takeBytes(records.number<std::uint64_t>());
    if (opcode == Opcode::schema || opcode == Opcode::channel) definitions.read(opcode, content);
    if (opcode != Opcode::message) continue;
    const Message message = definitions.parseMessage(content);
    earliest = std::min(earliest, message.time);
    latest = std::max(latest, message.time);
    std::string& entries = chunk.index[Fields(content).number<std::uint16_t>()];
    putNumber(entries, message.time);
    putNumber(entries, offset);
  }
  const bool holdsMessages = !chunk.index.empty();
  if (holdsMessages && (earliest != chunk.head.firstTime || latest != chunk.head.lastTime))
    throw std::out_of_range("a chunk's times differ from those of its messages");
  for (auto& [channel, entries] : chunk.index) {
    std::string content;
    putNumber(content, channel);
    putString(content, entries);
    entries = std::move(content);
  }
}

}  // namespace

std::uint32_t computeCrc(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void Definitions::read(Opcode opcode, std::string_view content) {
  Fields fields(content);
  const auto number = fields.number<std::uint16_t>();
  if (opcode == Opcode::schema) {
    schemas[number] = fields.string();
    return;
  }
  Channel channel;
  const auto schema = fields.number<std::uint16_t>();
  channel.topic = fields.string();
  channel.messageEncoding = fields.string();
  if (!schemas.contains(schema)) throw std::out_of_range("a channel has no schema");
  channel.schemaName = schemas.at(schema);
  channels[number] = std::move(channel);
}

Message Definitions::parseMessage(std::string_view content) const {
  Fields fields(content);
  const auto found = channels.find(fields.number<std::uint16_t>());
  if (found == channels.end()) throw std::out_of_range("a message has an unknown channel");
  Message message;
  message.channel = &found->second;
  message.sequence = fields.number<std::uint32_t>();
  message.time = fields.number<std::uint64_t>();
  fields.number<std::uint64_t>();  // publish time
  message.data = fields.rest();
  return message;
}

ChunkHead parseChunkHead(Fields& fields) {
  ChunkHead head;
  head.firstTime = fields.number<std::uint64_t>();
  head.lastTime = fields.number<std::uint64_t>();
  head.uncompressedSize = fields.number<std::uint64_t>();
  head.crc = fields.number<std::uint32_t>();
  return head;
}

Chunk openChunk(std::string_view content, Definitions& definitions) {
  Fields fields(content);
  Chunk chunk;
  chunk.head = parseChunkHead(fields);
  const std::string_view compression = fields.string();
  const std::string_view packed = fields.takeBytes(fields.number<std::uint64_t>());
  if (!fields.empty()) throw std::out_of_range("a chunk is longer than its content");
  if (chunk.head.uncompressedSize > kMaxChunkBytes)
    throw std::out_of_range("a chunk claims too many bytes");
  chunk.records = decompress(compression, packed, chunk.head.uncompressedSize);
  if (chunk.records.size() != chunk.head.uncompressedSize ||
      computeCrc(chunk.records) != chunk.head.crc)
    throw std::out_of_range("a chunk is corrupt (its CRC differs)");
  readRecords(chunk, definitions);
  return chunk;
}

bool readNextMessage(std::string_view records, std::size_t& at, const Definitions& definitions,
                     Message& message) {
  while (at < records.size()) {
    Fields fields(records.substr(at));
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>());
    const std::string_view content = fields.takeBytes(fields.number<std::uint64_t>());
    at += kRecordHeadBytes + content.size();
    if (opcode != Opcode::message) continue;
    message = definitions.parseMessage(content);
    return true;
  }
  return false;
}

}  // namespace enfilade::protocol::mcap
