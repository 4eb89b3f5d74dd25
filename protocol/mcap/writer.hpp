// Writer of MCAP files. Each chunk is compressed with zstd, has a CRC and is followed by its
// indexes; close() adds a summary. If the process dies, only the open chunk is lost.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/mcap/records.hpp"

namespace enfilade::protocol::mcap {

struct WriterOptions {
  std::string library;  ///< name and version of the writing program
  /// A chunk is written when it reaches this size, or this long after its first message.
  std::size_t chunkBytes = std::size_t{256} << 10;
  std::chrono::milliseconds chunkAge{500};
  bool replace = true;  ///< overwrite an existing file; otherwise it is an error
};

/// Topic and schema of a channel. Schemas with the same name are stored once.
struct ChannelSpec {
  std::string topic, messageEncoding;
  std::string schemaName, schemaEncoding, schema;
};

class Writer {
 public:
  /// Creates the file. Throws RecordingError.
  Writer(std::filesystem::path file, WriterOptions options);
  ~Writer();  ///< closes; ignores write errors
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Adds a channel and returns its number for write().
  std::uint16_t addChannel(const ChannelSpec& spec);
  /// Writes a message; `time` in nanoseconds. Throws RecordingError if a chunk cannot be written
  /// (disk full). The file then ends with the last complete chunk and accepts no more data.
  void write(std::uint16_t channel, std::uint64_t time, std::string_view message);
  /// Writes the open chunk to the file. Throws as write().
  void flush();
  /// Writes the summary and syncs the file to the disk. No writes are allowed afterwards. Throws as
  /// write().
  void close();

  std::uint64_t bytesWritten() const { return position_; }

 private:
  struct ChunkIndex {
    std::uint64_t firstTime = 0, lastTime = 0, start = 0, length = 0;
    std::uint64_t indexLength = 0, compressedSize = 0, uncompressedSize = 0;
    std::map<std::uint16_t, std::uint64_t> indexOffsets;
  };
  struct Entry {
    std::uint64_t time, offset;
  };

  void append(std::string_view bytes);
  std::string compressChunk(ChunkIndex& index) const;
  std::string summary() const;

  std::filesystem::path file_;
  WriterOptions options_;
  int descriptor_ = -1;
  bool open_ = false;
  std::uint64_t position_ = 0;
  std::uint32_t dataCrc_ = 0;
  std::string definitions_;  ///< all schema and channel records, for the summary
  std::map<std::string, std::uint16_t> schemas_;
  std::vector<std::uint32_t> sequences_;  ///< per channel; channel numbers start at 1
  std::vector<std::uint64_t> counts_;     ///< per channel
  std::string chunk_;                     ///< records of the open chunk
  std::map<std::uint16_t, std::vector<Entry>> index_;
  std::uint64_t firstTime_ = 0, lastTime_ = 0;
  std::chrono::steady_clock::time_point chunkStart_;
  std::vector<ChunkIndex> chunks_;
};

}  // namespace enfilade::protocol::mcap
