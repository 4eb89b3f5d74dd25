#include "server/net/page_files.hpp"

#include <fmt/core.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "scene/model/hasher.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {
namespace fs = std::filesystem;

namespace {

/// Far above the page's size: another folder was named by mistake.
constexpr std::uintmax_t kMaxPageBytes = std::uintmax_t{64} << 20;

HttpFile readPageFile(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream)
    throw std::runtime_error(path.string() +
                             ": cannot be read: check its permissions, or run ./dev build");
  scene::Hasher hasher;
  hasher.add(std::string_view(text));
  HttpFile file;
  file.bytes = std::make_shared<const std::vector<std::uint8_t>>(text.begin(), text.end());
  file.contentType = findContentType(path.filename().string());
  file.tag = fmt::format("{:016x}", hasher.value());
  file.isPage = true;
  return file;
}

}  // namespace

fs::path findPageFolder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path folder = program.parent_path();
  for (const fs::path& candidate :
       {folder / "page", folder.parent_path() / "share" / "enfilade" / "page"})
    if (fs::is_regular_file(candidate / "index.html", error) &&
        fs::is_regular_file(candidate / "enfilade.js", error))
      return candidate;
  return {};
}

PageFiles readPageFiles(const fs::path& folder) {
  PageFiles files;
  if (folder.empty()) return files;
  std::uintmax_t bytes = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.symlink_status().type() != fs::file_type::regular) continue;
    bytes += entry.file_size();
    if (bytes > kMaxPageBytes)
      throw std::runtime_error(folder.string() +
                               ": larger than a page can be (64 MiB): remove other files");
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    files["/page/" + name] = readPageFile(entry.path());
  }
  const auto index = files.find("/page/index.html");
  if (index != files.end()) files["/"] = index->second;
  logInfo("page: {} files from {}", files.size(), folder.string());
  return files;
}

}  // namespace enfilade::server
