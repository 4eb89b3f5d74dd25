// What a chunk of an MCAP file holds, believed only as far as its CRC goes.
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

/// Its data live as long as the chunk that they stand in.
struct Message {
  const Channel* channel = nullptr;
  std::uint32_t sequence = 0;
  std::uint64_t time = 0;  ///< nanoseconds
  std::string_view data;
};

/// Schemas and channels that were met so far. All throw std::out_of_range, saying what is wrong.
struct Definitions {
  std::map<std::uint16_t, std::string> schemas;
  std::map<std::uint16_t, Channel> channels;

  void read(Opcode opcode, std::string_view content);
  Message messageFrom(std::string_view content) const;
};

/// The head of a chunk's content.
struct ChunkHead {
  std::uint64_t firstTime = 0, lastTime = 0;  ///< nanoseconds
  std::uint64_t unpacked = 0;                 ///< bytes
  std::uint32_t crc = 0;
};
ChunkHead chunkHeadFrom(Fields& fields);

struct Chunk {
  ChunkHead head;
  std::string records;
  /// Of each channel the content of the MessageIndex record that belongs to it.
  std::map<std::uint16_t, std::string> index;
};

/// Unpacks the content of a chunk's record and checks it against its CRC and its head; definitions
/// in it are added. Throws std::out_of_range, saying what is wrong.
Chunk openChunk(std::string_view content, Definitions& definitions);

/// The next message of `records` from `at` on, which goes behind it; false: there is none.
bool nextMessage(std::string_view records, std::size_t& at, const Definitions& definitions,
                 Message& message);

/// Over what went before and these bytes.
std::uint32_t crcOf(std::string_view bytes, std::uint32_t before = 0);

}  // namespace enfilade::protocol::mcap
