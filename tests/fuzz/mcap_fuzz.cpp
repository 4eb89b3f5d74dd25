// Fuzz target of MCAP files. If the first byte is even, the rest is a file. Otherwise it is the
// records of a chunk, wrapped into a file with a correct CRC, since hardly any mutation gets past
// one.
#include <string>
#include <vector>

#include "protocol/mcap/indexed_reader.hpp"
#include "protocol/mcap/reader.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace enfilade::fuzz {
namespace {

using namespace protocol::mcap;

/// Content that a reader returned, and whether it reached the end of a properly closed file.
struct Read {
  std::vector<std::string> messages;
  bool whole = false;
};

std::string formatMessage(const Message& message) {
  return message.channel->topic + '\n' + std::to_string(message.time) + '\n' +
         std::string(message.data);
}

Read readFrontToBack(const std::filesystem::path& file) {
  Read read;
  try {
    Reader reader(file);
    while (const auto message = reader.next()) read.messages.push_back(formatMessage(*message));
    read.whole = reader.closed();
  } catch (const RecordingError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
  return read;
}

Read readByIndex(const std::filesystem::path& file) {
  Read read;
  try {
    IndexedReader reader(file);
    for (std::size_t chunk = 0; chunk < reader.chunks().size(); ++chunk) {
      reader.open(chunk);
      Message message;
      while (reader.next(message)) read.messages.push_back(formatMessage(message));
    }
    read.whole = reader.closed();
  } catch (const RecordingError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
  return read;
}

/// A file that was cut off after its first chunk, which is not compressed.
std::vector<std::uint8_t> makeFileAround(std::string_view records) {
  std::string head, chunk, file(kMagic);
  putString(head, "");
  putString(head, "fuzz");
  putNumber(chunk, std::uint64_t{0});
  putNumber(chunk, ~std::uint64_t{0} >> 1);
  putNumber(chunk, static_cast<std::uint64_t>(records.size()));
  putNumber(chunk, computeCrc(records));
  putString(chunk, "");
  putNumber(chunk, static_cast<std::uint64_t>(records.size()));
  chunk.append(records);
  putRecord(file, Opcode::header, head);
  putRecord(file, Opcode::chunk, chunk);
  return {file.begin(), file.end()};
}

}  // namespace

void tryBytes(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const bool wrapped = bytes[0] & 1;
  bytes = bytes.subspan(1);
  const std::string_view records(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const MemoryFile file(wrapped ? makeFileAround(records)
                                : std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
  const Read whole = readFrontToBack(file.getPath()), sought = readByIndex(file.getPath());
  if (whole.whole && sought.whole)
    require(whole.messages == sought.messages, "both readers give the same messages");
}

}  // namespace enfilade::fuzz
