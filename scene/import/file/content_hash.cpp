#include "scene/import/file/content_hash.hpp"

#include <xxhash.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>

namespace enfilade::scene {
namespace {

constexpr std::size_t kChunkSize = 1 << 20;  // bytes per read

ContentHash toContentHash(const XXH128_hash_t& hash) {
  return {hash.high64, hash.low64};
}

}  // namespace

ContentHash computeContentHash(std::span<const std::byte> bytes) {
  return toContentHash(XXH3_128bits(bytes.data(), bytes.size()));
}

ContentHash computeContentHash(std::string_view text) {
  return toContentHash(XXH3_128bits(text.data(), text.size()));
}

std::optional<ContentHash> computeFileHash(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(),
                                                                       &XXH3_freeState);
  if (!in || !state) return std::nullopt;
  XXH3_128bits_reset(state.get());
  const auto chunk = std::make_unique_for_overwrite<char[]>(kChunkSize);
  while (in) {  // to the end of the file
    in.read(chunk.get(), kChunkSize);
    XXH3_128bits_update(state.get(), chunk.get(), static_cast<std::size_t>(in.gcount()));
  }
  if (!in.eof()) return std::nullopt;
  return toContentHash(XXH3_128bits_digest(state.get()));
}

std::string toHex(const ContentHash& hash) {
  std::array<char, 33> text{};
  std::snprintf(text.data(), text.size(), "%016llx%016llx",
                static_cast<unsigned long long>(hash.high),
                static_cast<unsigned long long>(hash.low));
  return text.data();
}

}  // namespace enfilade::scene
