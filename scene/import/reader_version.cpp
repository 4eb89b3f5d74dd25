#include "scene/import/reader_version.hpp"

#include <assimp/version.h>
#include <elf.h>
#include <link.h>

#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "scene/import/content_hash.hpp"
#include "scene/import/ifc/ifc_plus_plus.hpp"

namespace enfilade::scene {
namespace {

/// The linker's build id in the notes of a program segment, or "".
std::string buildIdIn(std::span<const std::byte> notes) {
  ElfW(Nhdr) note{};
  while (notes.size() >= sizeof note) {  // each note takes some of the bytes
    std::memcpy(&note, notes.data(), sizeof note);
    const std::size_t name = (note.n_namesz + 3u) & ~std::size_t{3};
    const std::size_t content = (note.n_descsz + 3u) & ~std::size_t{3};
    if (name + content > notes.size() - sizeof note) break;
    const auto* text = reinterpret_cast<const char*>(notes.data() + sizeof note);
    if (note.n_type == NT_GNU_BUILD_ID &&
        std::string_view(text, note.n_namesz) == std::string_view("GNU\0", 4)) {
      return hexOf(contentHash(notes.subspan(sizeof note + name, note.n_descsz)));
    }
    notes = notes.subspan(sizeof note + name + content);
  }
  return "";
}

/// Called for the program itself first, then for its libraries.
int takeBuildId(dl_phdr_info* info, std::size_t, void* into) {
  for (const ElfW(Phdr) & part : std::span(info->dlpi_phdr, info->dlpi_phnum)) {
    if (part.p_type != PT_NOTE) continue;
    // The loader tells addresses as numbers.
    const auto* begin = reinterpret_cast<const std::byte*>(info->dlpi_addr + part.p_vaddr);
    const std::string id = buildIdIn({begin, part.p_memsz});
    if (!id.empty()) *static_cast<std::string*>(into) = id;
  }
  return 1;
}

/// The build id; where the linker writes none, the hash of the program's file.
std::string programVersion() {
  std::string id;
  dl_iterate_phdr(&takeBuildId, &id);
  if (!id.empty()) return id;
  return hexOf(contentHashOfFile("/proc/self/exe").value_or(ContentHash{}));
}

/// Of what is opened for ifcplusplus.
std::string moduleVersion() {
  return hexOf(contentHashOfFile(ifcPlusPlusModule()).value_or(ContentHash{}));
}

}  // namespace

const std::string& readerVersions() {
  static const std::string text =
      "assimp " + std::to_string(aiGetVersionMajor()) + "." + std::to_string(aiGetVersionMinor()) +
      "." + std::to_string(aiGetVersionPatch()) + "." + std::to_string(aiGetVersionRevision()) +
      " program " + programVersion() + " module " + moduleVersion();
  return text;
}

}  // namespace enfilade::scene
