#include "scene/import/cache/model_cache_entry.hpp"

#include <cstring>
#include <span>

#include "scene/import/worker/model_stream.hpp"

namespace enfilade::scene {
namespace {

// Little-endian, in this order: magic, key, seconds, number of dependencies, dependencies, the
// model stream to the end, the checksum of all before.
constexpr std::uint64_t kMagic = 0x3145484341434e45;  // "ENCACHE1"
constexpr std::size_t kChecksumSize = 16;             // bytes

class EntryWriter {
 public:
  void append(const void* data, std::size_t size) {
    const auto* from = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), from, from + size);
  }
  void append(std::uint64_t value) { append(&value, sizeof value); }
  void append(double value) { append(&value, sizeof value); }
  void append(const ContentHash& hash) {
    append(hash.high);
    append(hash.low);
  }
  std::vector<std::byte> bytes;
};

class EntryReader {
 public:
  explicit EntryReader(std::span<const std::byte> bytes) : remaining(bytes) {}

  void readBytes(void* to, std::size_t size) {
    if (size > remaining.size()) throw ModelStreamError("cache entry: ends too early");
    std::memcpy(to, remaining.data(), size);
    remaining = remaining.subspan(size);
  }
  std::uint64_t readNumber() {
    std::uint64_t value = 0;
    readBytes(&value, sizeof value);
    return value;
  }
  ContentHash readHash() {
    const std::uint64_t high = readNumber();
    return {high, readNumber()};
  }
  std::string readText() {
    const std::uint64_t size = readNumber();
    if (size > remaining.size()) throw ModelStreamError("cache entry: a text ends too early");
    std::string text(static_cast<std::size_t>(size), '\0');
    if (size > 0) readBytes(text.data(), text.size());
    return text;
  }
  std::span<const std::byte> remaining;
};

}  // namespace

std::vector<std::byte> serializeEntry(const CacheEntry& entry) {
  EntryWriter out;
  out.append(kMagic);
  out.append(entry.key);
  out.append(entry.importSeconds);
  out.append(std::uint64_t{entry.dependencies.size()});
  for (const Dependency& file : entry.dependencies) {
    out.append(std::uint64_t{file.path.size()});
    out.append(file.path.data(), file.path.size());
    out.append(std::uint64_t{file.exists});
    out.append(file.content);
  }
  const std::uint64_t size = measureModelStream(entry.model);
  out.bytes.reserve(out.bytes.size() + size + kChecksumSize);  // it may take most of the memory
  writeModelStream(entry.model, size, [&](std::span<const std::byte> block) {
    out.append(block.data(), block.size());
  });
  out.append(computeContentHash(out.bytes));
  return std::move(out.bytes);
}

CacheEntry deserializeEntry(std::span<const std::byte> bytes) {
  if (bytes.size() < kChecksumSize) throw ModelStreamError("cache entry: too short");
  const auto body = bytes.first(bytes.size() - kChecksumSize);
  if (!(EntryReader(bytes.last(kChecksumSize)).readHash() == computeContentHash(body))) {
    throw ModelStreamError("cache entry: wrong checksum");
  }
  EntryReader in(body);
  if (in.readNumber() != kMagic) throw ModelStreamError("cache entry: unknown format");
  CacheEntry entry;
  entry.key = in.readHash();
  in.readBytes(&entry.importSeconds, sizeof entry.importSeconds);
  const std::uint64_t files = in.readNumber();
  for (std::uint64_t i = 0; i < files; ++i) {  // each takes some of the bytes, or throws
    Dependency file;
    file.path = in.readText();
    file.exists = in.readNumber() != 0;
    file.content = in.readHash();
    entry.dependencies.push_back(std::move(file));
  }
  entry.model = deserializeModel(in.remaining);
  return entry;
}

}  // namespace enfilade::scene
