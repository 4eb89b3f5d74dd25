#include "scene/import/ifc/ifc_file.hpp"

#include <minizip/unzip.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <type_traits>
#include <vector>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kReadSize = 1 << 20;  // bytes unpacked at once
constexpr const char* kDamagedDirectory = "its directory is damaged";

struct CloseArchive {
  void operator()(unzFile archive) const { unzClose(archive); }
};
using Archive = std::unique_ptr<std::remove_pointer_t<unzFile>, CloseArchive>;

bool beginsWith(const fs::path& file, const std::string& magic) {
  std::ifstream in(file, std::ios::binary);
  std::string start(magic.size(), '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == magic;
}

std::string readWhole(const fs::path& file, std::size_t largest) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ImportError(file.string() + ": cannot be opened for reading (open)");
  const std::size_t size = static_cast<std::size_t>(file_size(file));
  if (size > largest) {
    throw ImportError(file.string() + ": is larger than the " + std::to_string(largest >> 20) +
                      " MiB that are allowed; split it or raise the memory limit (open)");
  }
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

bool isIfcName(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  // What archivers on macOS add beside each file is none.
  return name.ends_with(".ifc") && name.find("__macosx/") == std::string::npos;
}

[[noreturn]] void throwDamaged(const fs::path& file, const std::string& why) {
  throw ImportError(file.string() + ": cannot be unzipped: " + why +
                    "; copy or export it again (unzip)");
}

[[noreturn]] void throwNoIfc(const fs::path& file, std::size_t others) {
  throw ImportError(file.string() + ": holds no .ifc file (" + std::to_string(others) +
                    " others); zip the .ifc file itself (unzip)");
}

struct Member {
  std::string name;
  bool encrypted = false;
};

/// The one that the archive stands at.
Member currentMember(unzFile archive, const fs::path& file) {
  unz_file_info64 info{};
  Member member;
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

/// Leaves the archive standing at the only .ifc file in it.
void goToOnlyIfcMember(unzFile archive, const fs::path& file) {
  std::string names;
  std::size_t count = 0, found = 0;
  bool encrypted = false;
  unz64_file_pos place{};
  int code = unzGoToFirstFile(archive);
  for (; code == UNZ_OK; code = unzGoToNextFile(archive), ++count) {
    const Member member = currentMember(archive, file);
    if (!isIfcName(member.name)) continue;
    if (++found <= 5) names += (names.empty() ? "" : ", ") + member.name;
    encrypted = member.encrypted;
    if (unzGetFilePos64(archive, &place) != UNZ_OK) throwDamaged(file, kDamagedDirectory);
  }
  if (code != UNZ_END_OF_LIST_OF_FILE) throwDamaged(file, kDamagedDirectory);
  if (found == 0) throwNoIfc(file, count);
  if (found > 1) {
    throw ImportError(file.string() + ": holds " + std::to_string(found) + " .ifc files (" + names +
                      "); unzip it and name one of them (unzip)");
  }
  if (encrypted) {
    throw ImportError(file.string() + ": is encrypted; unzip it with its password (unzip)");
  }
  if (unzGoToFilePos64(archive, &place) != UNZ_OK) throwDamaged(file, kDamagedDirectory);
}

std::string unpack(unzFile archive, const fs::path& file, std::size_t largest) {
  if (unzOpenCurrentFile(archive) != UNZ_OK) {
    throwDamaged(file, "its .ifc file is damaged or compressed in a way that is not known here");
  }
  std::string text;
  std::vector<char> chunk(kReadSize);
  for (;;) {  // ends at the limit at the latest
    const int size = unzReadCurrentFile(archive, chunk.data(), kReadSize);
    if (size < 0) throwDamaged(file, "its .ifc file is damaged");
    if (size == 0) break;
    text.append(chunk.data(), static_cast<std::size_t>(size));
    if (text.size() > largest) {
      throw ImportError(file.string() + ": unpacks to more than the " +
                        std::to_string(largest >> 20) +
                        " MiB that are allowed; unzip it yourself if you trust it, or raise the "
                        "memory limit (unzip)");
    }
  }
  if (unzCloseCurrentFile(archive) != UNZ_OK) throwDamaged(file, "its .ifc file is damaged");
  return text;
}

}  // namespace

std::string readIfcFile(const fs::path& file, std::size_t largest) {
  if (beginsWith(file, "ISO-10303-21")) return readWhole(file, largest);
  const bool named = file.extension() == ".ifczip" || file.extension() == ".IFCZIP";
  if (!named && !beginsWith(file, "PK\3\4")) return readWhole(file, largest);
  // The end of an archive where its first file would be: minizip takes it for damaged.
  if (beginsWith(file, "PK\5\6")) throwNoIfc(file, 0);
  const Archive archive(unzOpen64(file.c_str()));
  if (!archive) throwDamaged(file, "it is no zip archive, or its end is missing");
  goToOnlyIfcMember(archive.get(), file);
  return unpack(archive.get(), file, largest);
}

}  // namespace enfilade::scene
