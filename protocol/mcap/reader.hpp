// Reads MCAP files from front to back and believes nothing: every CRC is checked, every index is
// compared with what it is about. A file that was cut off is read up to its last whole chunk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/mcap/chunk.hpp"

namespace enfilade::protocol::mcap {

/// Whether the file is there and begins as MCAP files do.
bool isMcap(const std::filesystem::path& file);

/// Stands behind the magic bytes; `size`: of the file. Throws RecordingError when the file cannot
/// be read or is no MCAP file.
std::ifstream openMcap(const std::filesystem::path& file, std::uint64_t& size);

class Reader {
 public:
  /// Throws RecordingError when the file cannot be read or is no MCAP file.
  explicit Reader(std::filesystem::path file);

  /// The messages in the order of the file; nullopt when there are no more. Throws RecordingError,
  /// naming the byte, at the first thing that is not as it was written.
  std::optional<Message> next();

  /// Once next() gave nullopt: whether the file was closed by its writer. If not, it ends in the
  /// middle, as when the writer was killed, and all that is whole was read.
  bool closed() const { return closed_; }
  std::uint64_t wholeBytes() const { return whole_; }  ///< read and found whole
  std::uint64_t chunks() const { return chunks_; }     ///< opened so far
  const std::string& library() const { return library_; }

 private:
  struct Record {
    Opcode opcode;
    std::uint64_t start = 0;  ///< in the file
    std::string head;         ///< opcode and length as they stand in the file
    std::string content;
  };
  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const;
  std::optional<Record> readRecord();
  bool readMore();
  void takeChunk(const Record& record);
  void checkIndex(const Record& record);
  void readSummary(const Record& dataEnd);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, position_ = 0, whole_ = 0, messages_ = 0, chunks_ = 0;
  std::uint32_t crc_ = 0;
  bool ended_ = false, closed_ = false;
  std::string library_;
  Definitions definitions_;
  std::string chunk_;
  std::size_t inChunk_ = 0;
  std::vector<std::string> expected_;  ///< indexes that must follow the chunk
};

}  // namespace enfilade::protocol::mcap
