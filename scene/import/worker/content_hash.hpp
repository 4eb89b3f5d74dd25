// 128-bit hashes of bytes and files, to recognise them again. Not against people who want two files
// to look the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace enfilade::scene {

struct ContentHash {
  std::uint64_t high = 0, low = 0;
  bool operator==(const ContentHash&) const = default;
};

ContentHash contentHash(std::span<const std::byte> bytes);
ContentHash contentHash(std::string_view text);

/// Of a whole file; nullopt where there is no regular file that can be read.
std::optional<ContentHash> contentHashOfFile(const std::filesystem::path& file);

/// 32 lower-case hexadecimal digits.
std::string hexOf(const ContentHash& hash);

}  // namespace enfilade::scene
