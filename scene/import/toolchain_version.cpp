#include "scene/import/toolchain_version.hpp"

#include <elf.h>
#include <link.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <span>
#include <string_view>
#include <vector>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/ifc/ifc_plus_plus.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kMaxNoteBytes = 1 << 16;  // bytes; linkers write some hundreds

/// Finds the linker's build id in the notes of a program segment.
std::optional<ContentHash> findBuildId(std::span<const std::byte> notes) {
  ElfW(Nhdr) note{};
  while (notes.size() >= sizeof note) {  // each note takes some of the bytes
    std::memcpy(&note, notes.data(), sizeof note);
    const std::size_t name = (note.n_namesz + 3u) & ~std::size_t{3};
    const std::size_t content = (note.n_descsz + 3u) & ~std::size_t{3};
    if (name + content > notes.size() - sizeof note) break;
    const auto* text = reinterpret_cast<const char*>(notes.data() + sizeof note);
    if (note.n_type == NT_GNU_BUILD_ID &&
        std::string_view(text, note.n_namesz) == std::string_view("GNU\0", 4)) {
      return computeContentHash(notes.subspan(sizeof note + name, note.n_descsz));
    }
    notes = notes.subspan(sizeof note + name + content);
  }
  return std::nullopt;
}

/// Fills `to` from `offset`; false if the file ends before.
bool readAt(std::ifstream& file, std::uint64_t offset, std::span<std::byte> to) {
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
  return file.good();
}

/// Reads the build id; nullopt if the file is not an ELF file or has none.
std::optional<ContentHash> readBuildId(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  ElfW(Ehdr) header{};
  if (!readAt(file, 0, std::as_writable_bytes(std::span(&header, 1))) ||
      std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
      header.e_phentsize != sizeof(ElfW(Phdr))) {
    return std::nullopt;
  }
  std::vector<ElfW(Phdr)> parts(header.e_phnum);
  if (!readAt(file, header.e_phoff, std::as_writable_bytes(std::span(parts)))) return std::nullopt;
  for (const ElfW(Phdr) & part : parts) {
    if (part.p_type != PT_NOTE || part.p_filesz > kMaxNoteBytes) continue;
    std::vector<std::byte> notes(part.p_filesz);
    if (!readAt(file, part.p_offset, notes)) return std::nullopt;
    if (const auto id = findBuildId(notes)) return id;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ContentHash> computeFileVersion(const std::filesystem::path& file) {
  const auto id = readBuildId(file);
  return id ? id : computeFileHash(file);
}

const std::string& describeReaderVersions() {
  const auto version = [](const std::filesystem::path& file) {
    return toHex(computeFileVersion(file).value_or(ContentHash{}));
  };
  static const std::string text = "program " + version("/proc/self/exe") + " assimp " +
                                  version(findAssimpModule()) + " ifcplusplus " +
                                  version(findIfcPlusPlusModule());
  return text;
}

}  // namespace enfilade::scene
