#include "scene/import/cache/model_cache_entry.hpp"

#include <cstring>

#include "scene/import/worker/model_stream.hpp"

namespace enfilade::scene {
namespace {

// Little-endian, in this order: magic, key, seconds, number of files beside and these, the model
// stream to the end, the checksum of all before it.
constexpr std::uint64_t kMagic = 0x3145484341434e45;  // "ENCACHE1"
constexpr std::size_t kChecksum = 16;                 // bytes

class Appender {
 public:
  void put(const void* data, std::size_t size) {
    const auto* from = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), from, from + size);
  }
  void put(std::uint64_t value) { put(&value, sizeof value); }
  void put(double value) { put(&value, sizeof value); }
  void put(const ContentHash& hash) {
    put(hash.high);
    put(hash.low);
  }
  std::vector<std::byte> bytes;
};

class Taker {
 public:
  explicit Taker(std::span<const std::byte> bytes) : rest(bytes) {}

  void take(void* to, std::size_t size) {
    if (size > rest.size()) throw ModelStreamError("cache entry: ends too early");
    std::memcpy(to, rest.data(), size);
    rest = rest.subspan(size);
  }
  std::uint64_t number() {
    std::uint64_t value = 0;
    take(&value, sizeof value);
    return value;
  }
  ContentHash hash() {
    const std::uint64_t high = number();
    return {high, number()};
  }
  std::string text() {
    const std::uint64_t size = number();
    if (size > rest.size()) throw ModelStreamError("cache entry: a text ends too early");
    std::string text(static_cast<std::size_t>(size), '\0');
    if (size > 0) take(text.data(), text.size());
    return text;
  }
  std::span<const std::byte> rest;
};

}  // namespace

std::vector<std::byte> serialiseEntry(const CacheEntry& entry) {
  Appender out;
  out.put(kMagic);
  out.put(entry.key);
  out.put(entry.importSeconds);
  out.put(std::uint64_t{entry.beside.size()});
  for (const FileBeside& file : entry.beside) {
    out.put(std::uint64_t{file.path.size()});
    out.put(file.path.data(), file.path.size());
    out.put(std::uint64_t{file.there});
    out.put(file.content);
  }
  const std::vector<std::byte> stream = serialiseModel(entry.model);
  out.bytes.reserve(out.bytes.size() + stream.size() + kChecksum);
  out.put(stream.data(), stream.size());
  out.put(contentHash(out.bytes));
  return std::move(out.bytes);
}

CacheEntry deserialiseEntry(std::span<const std::byte> bytes) {
  if (bytes.size() < kChecksum) throw ModelStreamError("cache entry: too short");
  const auto body = bytes.first(bytes.size() - kChecksum);
  if (!(Taker(bytes.last(kChecksum)).hash() == contentHash(body))) {
    throw ModelStreamError("cache entry: the checksum does not hold");
  }
  Taker in(body);
  if (in.number() != kMagic) throw ModelStreamError("cache entry: of another kind");
  CacheEntry entry;
  entry.key = in.hash();
  in.take(&entry.importSeconds, sizeof entry.importSeconds);
  const std::uint64_t files = in.number();
  for (std::uint64_t i = 0; i < files; ++i) {  // each takes some of the bytes, or throws
    FileBeside file;
    file.path = in.text();
    file.there = in.number() != 0;
    file.content = in.hash();
    entry.beside.push_back(std::move(file));
  }
  entry.model = deserialiseModel(in.rest);
  return entry;
}

}  // namespace enfilade::scene
