// Writer of a zip archive with uncompressed members.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace enfilade::tests {

inline std::uint32_t computeCrc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320u : 0u);
  }
  return ~crc;
}

/// Members are pairs of name and content. Layout: PKWARE APPNOTE.TXT, section 4.3.
inline std::string makeStoredZip(const std::vector<std::pair<std::string, std::string>>& members) {
  const auto number = [](std::size_t value, std::size_t bytes) {  // little-endian
    std::string text;
    for (std::size_t i = 0; i < bytes; ++i, value >>= 8) text += static_cast<char>(value & 255);
    return text;
  };
  std::string archive, directory;
  for (const auto& [name, content] : members) {
    // Version, flags, method, time and date; checksum, both sizes, length of the name, no extra
    // field.
    const std::string facts = number(10, 2) + number(0, 8) + number(computeCrc32(content), 4) +
                              number(content.size(), 4) + number(content.size(), 4) +
                              number(name.size(), 2) + number(0, 2);
    directory +=
        "PK\1\2" + number(10, 2) + facts + number(0, 10) + number(archive.size(), 4) + name;
    archive += "PK\3\4" + facts + name + content;
  }
  return archive + directory + "PK\5\6" + number(0, 4) + number(members.size(), 2) +
         number(members.size(), 2) + number(directory.size(), 4) + number(archive.size(), 4) +
         number(0, 2);
}

}  // namespace enfilade::tests
