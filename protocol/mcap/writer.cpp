#include "protocol/mcap/writer.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "protocol/mcap/chunk.hpp"

namespace enfilade::protocol::mcap {
namespace {

constexpr int kCompressionLevel = 1;  // zstd level: fast, because the tick waits for it

template <class Map, class Put>
std::string encodeMap(const Map& entries, const Put& put) {
  std::string bytes;
  for (const auto& entry : entries) put(bytes, entry);
  std::string list;
  putString(list, bytes);
  return list;
}

}  // namespace

Writer::Writer(std::filesystem::path file, WriterOptions options)
    : file_(std::move(file)), options_(std::move(options)), sequences_(1), counts_(1) {
  const int existing = options_.replace ? O_TRUNC : O_EXCL;
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | existing, 0644);
  if (descriptor_ < 0 && errno == EEXIST)
    throw RecordingError(file_.string() + ": exists already: move it, or give another file name");
  if (descriptor_ < 0)
    throw RecordingError(file_.string() + ": cannot be written: " + std::strerror(errno));
  open_ = true;
  std::string head(kMagic), header;
  putString(header, "");  // no profile: every channel has its schema
  putString(header, options_.library);
  putRecord(head, Opcode::header, header);
  append(head);
}

Writer::~Writer() {
  try {
    close();
  } catch (const RecordingError&) {
    // A destructor cannot throw: call close() to get errors.
  }
  if (descriptor_ >= 0) ::close(descriptor_);
}

/// Writes all bytes or, if the disk is full, none.
void Writer::append(std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int error = written < 0 ? errno : ENOSPC;
      open_ = false;
      const bool truncated = ::ftruncate(descriptor_, static_cast<off_t>(position_)) == 0;
      throw RecordingError(file_.string() + ": " + std::strerror(error) + "; it ends at byte " +
                           std::to_string(position_) +
                           (truncated ? "" : ", followed by an incomplete record") +
                           ", and the data before that can be read");
    }
    done += static_cast<std::size_t>(written);
  }
  position_ += bytes.size();
  dataCrc_ = computeCrc(bytes, dataCrc_);
}

std::uint16_t Writer::addChannel(const ChannelSpec& spec) {
  std::string records;
  std::uint16_t& schema = schemas_[spec.schemaName];
  if (schema == 0) {
    schema = static_cast<std::uint16_t>(schemas_.size());
    std::string content;
    putNumber(content, schema);
    putString(content, spec.schemaName);
    putString(content, spec.schemaEncoding);
    putString(content, spec.schema);
    putRecord(records, Opcode::schema, content);
  }
  const auto channel = static_cast<std::uint16_t>(counts_.size());
  std::string content;
  putNumber(content, channel);
  putNumber(content, schema);
  putString(content, spec.topic);
  putString(content, spec.messageEncoding);
  putString(content, {});  // no metadata
  putRecord(records, Opcode::channel, content);
  sequences_.push_back(0);
  counts_.push_back(0);
  definitions_ += records;
  chunk_ += records;
  return channel;
}

void Writer::write(std::uint16_t channel, std::uint64_t time, std::string_view message) {
  if (!open_) return;
  const auto now = std::chrono::steady_clock::now();
  if (index_.empty()) {
    firstTime_ = lastTime_ = time;
    chunkStart_ = now;
  }
  firstTime_ = std::min(firstTime_, time);
  lastTime_ = std::max(lastTime_, time);
  index_[channel].push_back({time, chunk_.size()});
  putNumber(chunk_, static_cast<std::uint8_t>(Opcode::message));
  putNumber(chunk_, std::uint64_t{22} + message.size());
  putNumber(chunk_, channel);
  putNumber(chunk_, ++sequences_[channel]);
  putNumber(chunk_, time);
  putNumber(chunk_, time);  // publish time = log time
  chunk_.append(message);
  ++counts_[channel];
  if (chunk_.size() >= options_.chunkBytes || now - chunkStart_ >= options_.chunkAge) flush();
}

/// Makes the record of the open chunk; `index` receives its sizes.
std::string Writer::compressChunk(ChunkIndex& index) const {
  std::string packed(ZSTD_compressBound(chunk_.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), kCompressionLevel);
  if (ZSTD_isError(size)) throw RecordingError(file_.string() + ": " + ZSTD_getErrorName(size));
  packed.resize(size);
  std::string content;
  putNumber(content, index.firstTime);
  putNumber(content, index.lastTime);
  putNumber(content, static_cast<std::uint64_t>(chunk_.size()));
  putNumber(content, computeCrc(chunk_));
  putString(content, "zstd");
  putNumber(content, static_cast<std::uint64_t>(packed.size()));
  content += packed;
  index.compressedSize = packed.size();
  index.uncompressedSize = chunk_.size();
  std::string record;
  putRecord(record, Opcode::chunk, content);
  index.length = record.size();
  return record;
}

void Writer::flush() {
  if (!open_ || chunk_.empty()) return;
  ChunkIndex index;
  index.firstTime = firstTime_;
  index.lastTime = lastTime_;
  index.start = position_;
  std::string bytes = compressChunk(index);
  for (const auto& [channel, entries] : index_) {
    index.indexOffsets[channel] = position_ + bytes.size();
    std::string content;
    putNumber(content, channel);
    content += encodeMap(entries, [](std::string& into, const Entry& entry) {
      putNumber(into, entry.time);
      putNumber(into, entry.offset);
    });
    putRecord(bytes, Opcode::messageIndex, content);
  }
  index.indexLength = bytes.size() - index.length;
  append(bytes);
  chunks_.push_back(std::move(index));
  chunk_.clear();
  index_.clear();
}

/// Makes the summary: schemas, channels, statistics and chunk indexes.
std::string Writer::summary() const {
  std::string records = definitions_;
  std::uint64_t messages = 0;
  for (const std::uint64_t count : counts_) messages += count;
  std::uint64_t first = 0, last = 0;
  for (const ChunkIndex& chunk : chunks_) {
    first = &chunk == &chunks_.front() ? chunk.firstTime : std::min(first, chunk.firstTime);
    last = std::max(last, chunk.lastTime);
  }
  std::string content;
  putNumber(content, messages);
  putNumber(content, static_cast<std::uint16_t>(schemas_.size()));
  putNumber(content, static_cast<std::uint32_t>(counts_.size() - 1));
  putNumber(content, std::uint32_t{0});  // attachments
  putNumber(content, std::uint32_t{0});  // metadata
  putNumber(content, static_cast<std::uint32_t>(chunks_.size()));
  putNumber(content, first);
  putNumber(content, last);
  std::string perChannel;
  for (std::size_t channel = 1; channel < counts_.size(); ++channel) {
    putNumber(perChannel, static_cast<std::uint16_t>(channel));
    putNumber(perChannel, counts_[channel]);
  }
  putString(content, perChannel);
  putRecord(records, Opcode::statistics, content);
  for (const ChunkIndex& chunk : chunks_) {
    content.clear();
    for (const std::uint64_t number : {chunk.firstTime, chunk.lastTime, chunk.start, chunk.length})
      putNumber(content, number);
    content += encodeMap(chunk.indexOffsets, [](std::string& into, const auto& offset) {
      putNumber(into, offset.first);
      putNumber(into, offset.second);
    });
    putNumber(content, chunk.indexLength);
    putString(content, "zstd");
    putNumber(content, chunk.compressedSize);
    putNumber(content, chunk.uncompressedSize);
    putRecord(records, Opcode::chunkIndex, content);
  }
  return records;
}

void Writer::close() {
  if (!open_) return;
  flush();
  std::string content;
  putNumber(content, dataCrc_);
  std::string bytes;
  putRecord(bytes, Opcode::dataEnd, content);
  const std::uint64_t summaryStart = position_ + bytes.size();
  std::string checked = summary();
  // The summary CRC also covers the footer's opcode, length and offsets.
  putNumber(checked, static_cast<std::uint8_t>(Opcode::footer));
  putNumber(checked, std::uint64_t{20});
  putNumber(checked, summaryStart);
  putNumber(checked, std::uint64_t{0});  // no summary offsets
  bytes += checked;
  putNumber(bytes, computeCrc(checked));
  bytes += kMagic;
  append(bytes);
  open_ = false;
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS)
    throw RecordingError(file_.string() + ": " + std::strerror(errno) +
                         "; the file on the disk may be incomplete");
}

}  // namespace enfilade::protocol::mcap
