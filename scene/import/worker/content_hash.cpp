#include "scene/import/worker/content_hash.hpp"

#include <xxhash.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>

namespace enfilade::scene {
namespace {

constexpr std::size_t kChunk = 1 << 20;  // bytes read at once

ContentHash from(const XXH128_hash_t& hash) {
  return {hash.high64, hash.low64};
}

}  // namespace

ContentHash contentHash(std::span<const std::byte> bytes) {
  return from(XXH3_128bits(bytes.data(), bytes.size()));
}

ContentHash contentHash(std::string_view text) {
  return from(XXH3_128bits(text.data(), text.size()));
}

std::optional<ContentHash> contentHashOfFile(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(),
                                                                       &XXH3_freeState);
  if (!in || !state) return std::nullopt;
  XXH3_128bits_reset(state.get());
  const auto chunk = std::make_unique_for_overwrite<char[]>(kChunk);
  while (in) {  // to the file's end
    in.read(chunk.get(), kChunk);
    XXH3_128bits_update(state.get(), chunk.get(), static_cast<std::size_t>(in.gcount()));
  }
  if (!in.eof()) return std::nullopt;
  return from(XXH3_128bits_digest(state.get()));
}

std::string hexOf(const ContentHash& hash) {
  std::array<char, 33> text{};
  std::snprintf(text.data(), text.size(), "%016llx%016llx",
                static_cast<unsigned long long>(hash.high),
                static_cast<unsigned long long>(hash.low));
  return text.data();
}

}  // namespace enfilade::scene
