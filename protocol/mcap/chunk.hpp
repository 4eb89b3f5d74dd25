// The content of an MCAP chunk, validated by its CRC.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "protocol/mcap/records.hpp"

namespace enfilade::protocol::mcap {

struct Channel {
  std::string topic, messageEncoding, schemaName;
};

/// One message. `data` points into the chunk and lives as long as it.
struct Message {
  const Channel* channel = nullptr;
  std::uint32_t sequence = 0;
  std::uint64_t time = 0;  ///< nanoseconds
  std::string_view data;
};

/// Schemas and channels read so far. All functions throw std::out_of_range with the reason.
struct Definitions {
  std::map<std::uint16_t, std::string> schemas;
  std::map<std::uint16_t, Channel> channels;

  void read(Opcode opcode, std::string_view content);
  Message parseMessage(std::string_view content) const;
};

/// The header fields of a chunk.
struct ChunkHead {
  std::uint64_t firstTime = 0, lastTime = 0;  ///< nanoseconds
  std::uint64_t uncompressedSize = 0;         ///< bytes
  std::uint32_t crc = 0;
};
ChunkHead parseChunkHead(Fields& fields);

struct Chunk {
  ChunkHead head;
  std::string records;
  /// Content of the MessageIndex record of each channel.
  std::map<std::uint16_t, std::string> index;
};

/// Decompresses a chunk record and checks it against its CRC and header; adds its definitions.
/// Throws std::out_of_range with the reason.
Chunk openChunk(std::string_view content, Definitions& definitions);

/// Reads the next message of `records` from offset `at` and advances `at`; false at the end.
bool readNextMessage(std::string_view records, std::size_t& at, const Definitions& definitions,
                     Message& message);

/// CRC of `bytes` appended to data with the CRC `before`.
std::uint32_t computeCrc(std::string_view bytes, std::uint32_t before = 0);

}  // namespace enfilade::protocol::mcap
