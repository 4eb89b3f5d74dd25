// The files of the web page, read into memory when the server starts. A request is looked up by its
// path among these files and never reaches the file system.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "server/net/http_file.hpp"

namespace enfilade::server {

/// Files by path of the request, such as "/page/index.html"; "/" is the index. Empty: no page.
using PageFiles = std::map<std::string, HttpFile>;

/// Answer to "/" without a page.
inline constexpr const char* kNoPage =
    "this server has no page: `./dev build` writes it to the folder `page` next to the program; "
    "restart the server after that. The WebSocket of clients is at /";

/// The folder `page` next to the program, or share/enfilade/page of an installation; "": neither.
std::filesystem::path findPageFolder();

/// Reads all regular files of the folder; links are left out. "": no files. Throws
/// std::runtime_error if a file cannot be read, or if they are larger than a page can be.
PageFiles readPageFiles(const std::filesystem::path& folder);

}  // namespace enfilade::server
