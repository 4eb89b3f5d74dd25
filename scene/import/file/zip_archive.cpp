#include "scene/import/file/zip_archive.hpp"

#include <minizip/unzip.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <memory>
#include <type_traits>
#include <vector>

#include "scene/import/file/import_options.hpp"
#include "scene/model/ascii.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kReadSize = 1 << 20;  // bytes unpacked at once
constexpr const char* kDamagedDirectory = "its directory is damaged";

struct CloseArchive {
  void operator()(unzFile archive) const { unzClose(archive); }
};
using Archive = std::unique_ptr<std::remove_pointer_t<unzFile>, CloseArchive>;

/// The first is the one that messages name.
using Extensions = std::span<const std::string_view>;

bool isWantedName(std::string name, Extensions extensions) {
  name = toLowerCase(std::move(name));
  // macOS archivers add a metadata file for each file, with the same extension.
  return name.find("__macosx/") == std::string::npos &&
         std::ranges::any_of(extensions, [&](std::string_view e) { return name.ends_with(e); });
}

[[noreturn]] void throwDamaged(const fs::path& file, const std::string& reason) {
  throw ImportError(file.string() + ": cannot be unzipped: " + reason +
                    "; copy or export it again");
}

[[noreturn]] void throwNoMember(const fs::path& file, Extensions extensions, std::size_t others) {
  const std::string extension(extensions.front());
  throw ImportError(file.string() + ": contains no " + extension + " file (" +
                    std::to_string(others) + " others); zip the " + extension + " file itself");
}

[[noreturn]] void throwTooLarge(const fs::path& file, std::size_t maxBytes) {
  throw ImportError(file.string() + ": unpacks to more than the " + std::to_string(maxBytes >> 20) +
                    " MiB allowed; unzip it yourself if you trust it, or raise the memory limit");
}

struct ArchiveMember {
  std::string name;
  std::uint64_t size = 0;  ///< bytes, unpacked
  bool encrypted = false;
};

/// The archive's current member.
ArchiveMember readCurrentMember(unzFile archive, const fs::path& file) {
  unz_file_info64 info{};
  ArchiveMember member;
  const auto read = [&] {
    return unzGetCurrentFileInfo64(archive, &info, member.name.data(), member.name.size(), nullptr,
                                   0, nullptr, 0) == UNZ_OK;
  };
  bool known = read();
  member.name.resize(info.size_filename);
  known = known && read();
  if (!known) throwDamaged(file, kDamagedDirectory);
  member.size = info.uncompressed_size;
  member.encrypted = (info.flag & 1) != 0;  // PKWARE's APPNOTE.TXT, 4.4.4
  return member;
}

/// Makes the archive's only file with one of these extensions its current member.
void seekToOnlyMember(unzFile archive, const fs::path& file, Extensions extensions) {
  std::string names;
  std::size_t count = 0, found = 0;
  bool encrypted = false;
  unz64_file_pos place{};
  int code = unzGoToFirstFile(archive);
  for (; code == UNZ_OK; code = unzGoToNextFile(archive), ++count) {
    const ArchiveMember member = readCurrentMember(archive, file);
    if (!isWantedName(member.name, extensions)) continue;
    if (++found <= 5) names += (names.empty() ? "" : ", ") + member.name;
    encrypted = member.encrypted;
    if (unzGetFilePos64(archive, &place) != UNZ_OK) throwDamaged(file, kDamagedDirectory);
  }
  if (code != UNZ_END_OF_LIST_OF_FILE) throwDamaged(file, kDamagedDirectory);
  if (found == 0) throwNoMember(file, extensions, count);
  if (found > 1) {
    throw ImportError(file.string() + ": has " + std::to_string(found) + " " +
                      std::string(extensions.front()) + " files (" + names +
                      "); unzip it and name one of them");
  }
  if (encrypted) {
    throw ImportError(file.string() + ": is encrypted; unzip it with its password");
  }
  if (unzGoToFilePos64(archive, &place) != UNZ_OK) throwDamaged(file, kDamagedDirectory);
}

std::string unpack(unzFile archive, const fs::path& file, const std::string& extension,
                   std::size_t maxBytes) {
  if (unzOpenCurrentFile(archive) != UNZ_OK) {
    throwDamaged(file, "its " + extension + " file is damaged or uses an unsupported compression");
  }
  std::string text;
  std::vector<char> chunk(kReadSize);
  for (;;) {  // bounded by the size limit
    const int size = unzReadCurrentFile(archive, chunk.data(), kReadSize);
    if (size < 0) throwDamaged(file, "its " + extension + " file is damaged");
    if (size == 0) break;
    text.append(chunk.data(), static_cast<std::size_t>(size));
    if (text.size() > maxBytes) throwTooLarge(file, maxBytes);
  }
  if (unzCloseCurrentFile(archive) != UNZ_OK)
    throwDamaged(file, "its " + extension + " file is damaged");
  return text;
}

bool isEmptyArchive(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string start(4, '\0');
  in.read(start.data(), 4);
  return start == "PK\5\6";
}

Archive openArchive(const fs::path& file) {
  Archive archive(unzOpen64(file.c_str()));
  if (!archive) throwDamaged(file, "it is not a zip archive, or its end is missing");
  return archive;
}

}  // namespace

void limitZipMembers(const fs::path& file, std::size_t maxBytes) {
  if (isEmptyArchive(file)) return;
  const Archive archive = openArchive(file);
  std::uint64_t left = maxBytes;
  int code = unzGoToFirstFile(archive.get());
  for (; code == UNZ_OK; code = unzGoToNextFile(archive.get())) {
    const std::uint64_t size = readCurrentMember(archive.get(), file).size;
    if (size > left) throwTooLarge(file, maxBytes);
    left -= size;
  }
  if (code != UNZ_END_OF_LIST_OF_FILE) throwDamaged(file, kDamagedDirectory);
}

std::string readOnlyZipMember(const fs::path& file, Extensions extensions, std::size_t maxBytes) {
  // An empty archive starts with its end record; minizip would report it as damaged.
  if (isEmptyArchive(file)) throwNoMember(file, extensions, 0);
  const Archive archive = openArchive(file);
  seekToOnlyMember(archive.get(), file, extensions);
  if (readCurrentMember(archive.get(), file).size > maxBytes) throwTooLarge(file, maxBytes);
  return unpack(archive.get(), file, std::string(extensions.front()), maxBytes);
}

}  // namespace enfilade::scene
