// Writes MCAP files that lose nothing but the open chunk when the process dies: chunks packed by
// zstd with a CRC each, an index after each chunk, and a summary when the file is closed.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/mcap/records.hpp"

namespace enfilade::protocol::mcap {

struct WriterOptions {
  std::string library;  ///< who writes: name and version
  /// A chunk goes to the file when it holds this much, or this long after its first message.
  std::size_t chunkBytes = std::size_t{256} << 10;
  std::chrono::milliseconds chunkAge{500};
  bool replace = true;  ///< begins a file anew that is there; else that is an error
};

/// What messages of a channel are. Schemas of the same name are stored once.
struct ChannelSpec {
  std::string topic, messageEncoding;
  std::string schemaName, schemaEncoding, schema;
};

class Writer {
 public:
  /// Begins the file. Throws RecordingError.
  Writer(std::filesystem::path file, WriterOptions options);
  ~Writer();  ///< closes; what cannot be written then is lost in silence
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// The channel's number, for write().
  std::uint16_t addChannel(const ChannelSpec& spec);
  /// `time` in nanoseconds. Throws RecordingError when the file does not take a chunk (the disk is
  /// full): the file then ends with the last whole chunk, and nothing more is written to it.
  void write(std::uint16_t channel, std::uint64_t time, std::string_view message);
  /// Sends the open chunk to the file. Throws as write().
  void flush();
  /// Writes the summary and waits until the disk has it all; nothing may be written afterwards.
  /// Throws as write().
  void close();

  std::uint64_t bytesWritten() const { return position_; }

 private:
  struct ChunkPlace {
    std::uint64_t firstTime = 0, lastTime = 0, start = 0, length = 0;
    std::uint64_t indexLength = 0, packed = 0, unpacked = 0;
    std::map<std::uint16_t, std::uint64_t> indexOffsets;
  };
  struct Entry {
    std::uint64_t time, offset;
  };

  void append(std::string_view bytes);
  std::string packedChunk(ChunkPlace& place) const;
  std::string summary() const;

  std::filesystem::path file_;
  WriterOptions options_;
  int descriptor_ = -1;
  bool open_ = false;
  std::uint64_t position_ = 0;
  std::uint32_t dataCrc_ = 0;
  std::string definitions_;  ///< all schema and channel records, for the summary
  std::map<std::string, std::uint16_t> schemas_;
  std::vector<std::uint32_t> sequences_;  ///< of each channel; numbers begin at 1
  std::vector<std::uint64_t> counts_;     ///< of each channel
  std::string chunk_;                     ///< records of the open chunk
  std::map<std::uint16_t, std::vector<Entry>> index_;
  std::uint64_t firstTime_ = 0, lastTime_ = 0;
  std::chrono::steady_clock::time_point chunkBegan_;
  std::vector<ChunkPlace> chunks_;
};

}  // namespace enfilade::protocol::mcap
