// Sequential reader of MCAP files. It checks every CRC and every index. A truncated file is read up
// to its last complete chunk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "protocol/mcap/chunk.hpp"

namespace enfilade::protocol::mcap {

/// True if the file exists and starts with MCAP's magic bytes.
bool isMcap(const std::filesystem::path& file);

/// Opens a file and skips its magic bytes; `size` receives the file size. Throws RecordingError if
/// the file cannot be read or is not an MCAP file.
std::ifstream openMcap(const std::filesystem::path& file, std::uint64_t& size);

class Reader {
 public:
  /// Throws RecordingError if the file cannot be read or is not an MCAP file.
  explicit Reader(std::filesystem::path file);

  /// Returns the messages in file order; nullopt at the end. Throws RecordingError with the byte
  /// position at the first corruption.
  std::optional<Message> next();

  /// Valid after next() returned nullopt. True if the writer closed the file. Otherwise the file is
  /// truncated, and all complete chunks were read.
  bool closed() const { return closed_; }
  std::uint64_t wholeBytes() const { return wholeBytes_; }  ///< bytes read and validated
  std::uint64_t chunks() const { return chunks_; }          ///< chunks opened so far
  const std::string& library() const { return library_; }

 private:
  struct Record {
    Opcode opcode;
    std::uint64_t start = 0;  ///< position in the file, bytes
    std::string head;         ///< opcode and length, as encoded in the file
    std::string content;
  };
  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const;
  std::optional<Record> readRecord();
  bool loadNextChunk();
  void loadChunk(const Record& record);
  void checkIndex(const Record& record);
  void readSummary(const Record& dataEnd);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, position_ = 0, wholeBytes_ = 0, messages_ = 0, chunks_ = 0;
  std::uint32_t crc_ = 0;
  bool ended_ = false, closed_ = false;
  std::string library_;
  Definitions definitions_;
  std::string chunk_;
  std::size_t chunkOffset_ = 0;
  std::vector<std::string> expectedIndexes_;  ///< index records that must follow the chunk
};

}  // namespace enfilade::protocol::mcap
