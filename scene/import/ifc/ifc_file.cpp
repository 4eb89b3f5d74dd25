#include "scene/import/ifc/ifc_file.hpp"

#include <minizip/unzip.h>

#include <fstream>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "scene/import/file/ascii.hpp"
#include "scene/import/file/import_options.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kReadSize = 1 << 20;  // bytes unpacked at once
constexpr const char* kDamagedDirectory = "its directory is damaged";

struct CloseArchive {
  void operator()(unzFile archive) const { unzClose(archive); }
};
using Archive = std::unique_ptr<std::remove_pointer_t<unzFile>, CloseArchive>;

bool startsWith(const fs::path& file, const std::string& magic) {
  std::ifstream in(file, std::ios::binary);
  std::string start(magic.size(), '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == magic;
}

std::string readWholeFile(const fs::path& file, std::size_t maxBytes) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ImportError(file.string() + ": cannot be opened for reading (open)");
  const std::size_t size = static_cast<std::size_t>(file_size(file));
  if (size > maxBytes) {
    throw ImportError(file.string() + ": is larger than the " + std::to_string(maxBytes >> 20) +
                      " MiB allowed; split it or raise the memory limit (open)");
  }
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

bool isIfcName(std::string name) {
  name = toLowerCase(std::move(name));
  // macOS archivers add a metadata file for each file; it is not IFC.
  return name.ends_with(".ifc") && name.find("__macosx/") == std::string::npos;
}

[[noreturn]] void throwDamaged(const fs::path& file, const std::string& reason) {
  throw ImportError(file.string() + ": cannot be unzipped: " + reason +
                    "; copy or export it again (unzip)");
}

[[noreturn]] void throwNoIfc(const fs::path& file, std::size_t others) {
  throw ImportError(file.string() + ": contains no .ifc file (" + std::to_string(others) +
                    " others); zip the .ifc file itself (unzip)");
}

struct ArchiveMember {
  std::string name;
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
  member.encrypted = (info.flag & 1) != 0;  // PKWARE's APPNOTE.TXT, 4.4.4
  return member;
}

/// Makes the archive's only .ifc file its current member.
void seekToOnlyIfcMember(unzFile archive, const fs::path& file) {
  std::string names;
  std::size_t count = 0, found = 0;
  bool encrypted = false;
  unz64_file_pos place{};
  int code = unzGoToFirstFile(archive);
  for (; code == UNZ_OK; code = unzGoToNextFile(archive), ++count) {
    const ArchiveMember member = readCurrentMember(archive, file);
    if (!isIfcName(member.name)) continue;
    if (++found <= 5) names += (names.empty() ? "" : ", ") + member.name;
    encrypted = member.encrypted;
    if (unzGetFilePos64(archive, &place) != UNZ_OK) throwDamaged(file, kDamagedDirectory);
  }
  if (code != UNZ_END_OF_LIST_OF_FILE) throwDamaged(file, kDamagedDirectory);
  if (found == 0) throwNoIfc(file, count);
  if (found > 1) {
    throw ImportError(file.string() + ": has " + std::to_string(found) + " .ifc files (" + names +
                      "); unzip it and name one of them (unzip)");
  }
  if (encrypted) {
    throw ImportError(file.string() + ": is encrypted; unzip it with its password (unzip)");
  }
  if (unzGoToFilePos64(archive, &place) != UNZ_OK) throwDamaged(file, kDamagedDirectory);
}

std::string unpack(unzFile archive, const fs::path& file, std::size_t maxBytes) {
  if (unzOpenCurrentFile(archive) != UNZ_OK) {
    throwDamaged(file, "its .ifc file is damaged or uses an unsupported compression");
  }
  std::string text;
  std::vector<char> chunk(kReadSize);
  for (;;) {  // bounded by the size limit
    const int size = unzReadCurrentFile(archive, chunk.data(), kReadSize);
    if (size < 0) throwDamaged(file, "its .ifc file is damaged");
    if (size == 0) break;
    text.append(chunk.data(), static_cast<std::size_t>(size));
    if (text.size() > maxBytes) {
      throw ImportError(file.string() + ": unpacks to more than the " +
                        std::to_string(maxBytes >> 20) +
                        " MiB allowed; unzip it yourself if you trust it, or raise the "
                        "memory limit (unzip)");
    }
  }
  if (unzCloseCurrentFile(archive) != UNZ_OK) throwDamaged(file, "its .ifc file is damaged");
  return text;
}

}  // namespace

std::string readIfcFile(const fs::path& file, std::size_t maxBytes) {
  if (startsWith(file, "ISO-10303-21")) return readWholeFile(file, maxBytes);
  const bool named = file.extension() == ".ifczip" || file.extension() == ".IFCZIP";
  if (!named && !startsWith(file, "PK\3\4")) return readWholeFile(file, maxBytes);
  // An empty archive starts with its end record; minizip would report it as damaged.
  if (startsWith(file, "PK\5\6")) throwNoIfc(file, 0);
  const Archive archive(unzOpen64(file.c_str()));
  if (!archive) throwDamaged(file, "it is not a zip archive, or its end is missing");
  seekToOnlyIfcMember(archive.get(), file);
  return unpack(archive.get(), file, maxBytes);
}

}  // namespace enfilade::scene
