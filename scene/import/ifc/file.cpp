#include "scene/import/ifc/file.hpp"

#include <zip.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <vector>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kReadSize = 1 << 20;  // bytes unpacked at once

struct CloseArchive {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct CloseMember {
  void operator()(zip_file_t* member) const { zip_fclose(member); }
};
using Archive = std::unique_ptr<zip_t, CloseArchive>;
using Member = std::unique_ptr<zip_file_t, CloseMember>;

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

/// The index of the only .ifc file in the archive.
zip_uint64_t onlyIfcMember(zip_t& archive, const fs::path& file) {
  std::vector<zip_uint64_t> found;
  std::string names;
  const zip_int64_t count = zip_get_num_entries(&archive, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* name = zip_get_name(&archive, index, 0);
    if (name == nullptr || !isIfcName(name)) continue;
    found.push_back(index);
    if (found.size() <= 5) names += (names.empty() ? "" : ", ") + std::string(name);
  }
  if (found.empty()) {
    throw ImportError(file.string() + ": holds no .ifc file (" + std::to_string(count) +
                      " others); zip the .ifc file itself (unzip)");
  }
  if (found.size() > 1) {
    throw ImportError(file.string() + ": holds " + std::to_string(found.size()) + " .ifc files (" +
                      names + "); unzip it and name one of them (unzip)");
  }
  return found.front();
}

[[noreturn]] void throwDamaged(const fs::path& file, const std::string& why) {
  throw ImportError(file.string() + ": cannot be unzipped: " + why +
                    "; copy or export it again (unzip)");
}

std::string unpack(zip_t& archive, zip_uint64_t index, const fs::path& file, std::size_t largest) {
  const Member member(zip_fopen_index(&archive, index, 0));
  if (!member) throwDamaged(file, zip_strerror(&archive));
  std::string text;
  std::vector<char> chunk(kReadSize);
  for (;;) {  // ends at the limit at the latest
    const zip_int64_t size = zip_fread(member.get(), chunk.data(), chunk.size());
    if (size < 0) throwDamaged(file, zip_file_strerror(member.get()));
    if (size == 0) return text;
    text.append(chunk.data(), static_cast<std::size_t>(size));
    if (text.size() > largest) {
      throw ImportError(file.string() + ": unpacks to more than the " +
                        std::to_string(largest >> 20) +
                        " MiB that are allowed; unzip it yourself if you trust it, or raise the "
                        "memory limit (unzip)");
    }
  }
}

}  // namespace

std::string readIfcFile(const fs::path& file, std::size_t largest) {
  if (beginsWith(file, "ISO-10303-21")) return readWhole(file, largest);
  const bool named = file.extension() == ".ifczip" || file.extension() == ".IFCZIP";
  if (!named && !beginsWith(file, "PK\3\4")) return readWhole(file, largest);
  int code = 0;
  const Archive archive(zip_open(file.c_str(), ZIP_RDONLY, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    throwDamaged(file, why);
  }
  return unpack(*archive, onlyIfcMember(*archive, file), file, largest);
}

}  // namespace enfilade::scene
