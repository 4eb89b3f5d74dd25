// Random access to MCAP files. Chunk positions come from the summary or, if the writer was killed,
// from a scan of all record headers. A chunk is decompressed on demand and checked as in Reader:
// its CRC, its times and its indexes. Other chunks are not read.
#pragma once

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "protocol/mcap/chunk.hpp"

namespace enfilade::protocol::mcap {

struct ChunkIndex {
  std::uint64_t start = 0, length = 0;        ///< position and size of its record, bytes
  std::uint64_t indexLength = 0;              ///< bytes of the index records after it
  std::uint64_t firstTime = 0, lastTime = 0;  ///< nanoseconds
  std::set<std::uint16_t> channels;           ///< channels of its messages
};

/// Reads chunks by number. All functions throw RecordingError with the byte position.
class IndexedReader {
 public:
  explicit IndexedReader(std::filesystem::path file);

  const std::vector<ChunkIndex>& chunks() const { return chunks_; }  ///< in file order
  /// True if the writer closed the file. Otherwise all complete chunks were found.
  bool closed() const { return closed_; }
  const std::filesystem::path& file() const { return file_; }

  /// Returns the channel number of a topic; 0: unknown so far. Channels of the summary or of the
  /// first chunk are known after construction.
  std::uint16_t findChannel(const std::string& topic) const;

  /// Opens `chunk` at its first message.
  void open(std::size_t chunk);
  /// Reads the next message of the open chunk, valid until another chunk is opened; false at the
  /// end.
  bool next(Message& message);

 private:
  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const;
  std::string bytesAt(std::uint64_t at, std::uint64_t length);
  bool readSummary();
  void readSummaryRecords(std::string_view records);
  void scan();
  void dropTornChunk();
  Chunk loadChunk(const ChunkIndex& index);
  std::string indexBytes(const ChunkIndex& index);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  bool closed_ = false;
  Definitions definitions_;
  std::vector<ChunkIndex> chunks_;
  std::string records_;  ///< of the open chunk
  std::size_t offset_ = 0;
  std::size_t openChunk_ = ~std::size_t{0};
};

}  // namespace enfilade::protocol::mcap
