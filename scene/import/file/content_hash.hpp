// 128-bit content hashes of bytes and files. They do not resist deliberate collisions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// A 128-bit content hash (XXH3).
struct ContentHash {
  std::uint64_t high = 0, low = 0;
  bool operator==(const ContentHash&) const = default;
};

ContentHash computeContentHash(std::span<const std::byte> bytes);
ContentHash computeContentHash(std::string_view text);

/// Hashes a whole file; nullopt if it is not a readable regular file.
std::optional<ContentHash> computeFileHash(const std::filesystem::path& file);

/// Formats a hash as 32 lower-case hexadecimal digits.
std::string toHex(const ContentHash& hash);

}  // namespace enfilade::scene
