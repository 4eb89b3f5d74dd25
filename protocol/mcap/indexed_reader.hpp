// Reads an MCAP file here and there: the places of its chunks come from the summary, or, when a
// writer that was killed left none, from the heads of the records, front to back. A chunk is
// unpacked when it is asked for, and checked as Reader does: its CRC, its times, and the indexes
// after it. What is not asked for is not looked at.
#pragma once

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "protocol/mcap/chunk.hpp"

namespace enfilade::protocol::mcap {

struct ChunkPlace {
  std::uint64_t start = 0, length = 0;        ///< of its record, bytes of the file
  std::uint64_t indexLength = 0;              ///< bytes of the index records after it
  std::uint64_t firstTime = 0, lastTime = 0;  ///< nanoseconds
  std::set<std::uint16_t> channels;           ///< of its messages
};

/// All functions throw RecordingError, naming the byte.
class IndexedReader {
 public:
  explicit IndexedReader(std::filesystem::path file);

  const std::vector<ChunkPlace>& chunks() const { return chunks_; }  ///< in the order of the file
  /// Whether the writer closed the file. If not, all whole chunks were found.
  bool closed() const { return closed_; }
  const std::filesystem::path& file() const { return file_; }

  /// The number of a channel of this topic; 0: none was met yet. Those that the summary tells, or
  /// the first chunk, are known from the beginning.
  std::uint16_t channelOf(const std::string& topic) const;

  /// Makes `chunk` the open one, at its first message.
  void open(std::size_t chunk);
  /// The next message of the open chunk; it lives until another one is opened. False: no more.
  bool next(Message& message);

 private:
  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const;
  std::string bytesAt(std::uint64_t at, std::uint64_t length);
  bool readSummary();
  void readSummaryRecords(std::string_view records);
  void scan();
  void dropTornChunk();
  Chunk unpack(const ChunkPlace& place);
  std::string indexBytes(const ChunkPlace& place);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  bool closed_ = false;
  Definitions definitions_;
  std::vector<ChunkPlace> chunks_;
  std::string records_;  ///< of the open chunk
  std::size_t at_ = 0;
  std::size_t open_ = ~std::size_t{0};
};

}  // namespace enfilade::protocol::mcap
