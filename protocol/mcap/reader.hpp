// Reads MCAP files from front to back and believes nothing: every CRC is checked, every index is
// compared with what it is about. A file that was cut off is read up to its last whole chunk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/mcap/records.hpp"

namespace enfilade::protocol::mcap {

struct Channel {
  std::string topic, messageEncoding, schemaName;
};

/// Lives until the next call of Reader::next().
struct Message {
  const Channel* channel = nullptr;
  std::uint32_t sequence = 0;
  std::uint64_t time = 0;  ///< nanoseconds
  std::string_view data;
};

/// Whether the file is there and begins as MCAP files do.
bool isMcap(const std::filesystem::path& file);

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
  struct Expected {
    std::uint16_t channel;
    std::string index;  ///< the MessageIndex record's content
  };

  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const;
  std::optional<Record> readRecord();
  bool readMore();
  void openChunk(const Record& record);
  void readDefinition(Opcode opcode, std::string_view content);
  void checkIndex(const Record& record);
  void readSummary(const Record& dataEnd);
  Message messageFrom(std::string_view content) const;

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, position_ = 0, whole_ = 0, messages_ = 0, chunks_ = 0;
  std::uint32_t crc_ = 0;
  bool ended_ = false, closed_ = false;
  std::string library_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::string chunk_;
  std::size_t inChunk_ = 0;
  std::uint64_t chunkStart_ = 0;
  std::vector<Expected> expected_;  ///< indexes that must follow the chunk
};

}  // namespace enfilade::protocol::mcap
