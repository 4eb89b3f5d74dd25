// Follows libglvnd's documentation of its EGL vendor enumeration (src/EGL/icd_enumeration.md).
#include "server/commands/egl_vendors.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "server/commands/child_call.hpp"

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> splitPaths(const char* list) {
  std::vector<std::string> parts;
  std::istringstream text(list ? list : "");
  for (std::string part; std::getline(text, part, ':');)
    if (!part.empty()) parts.push_back(part);
  return parts;
}

std::vector<std::string> listFiles(const std::vector<std::string>& folders) {
  std::vector<std::string> files;
  for (const std::string& folder : folders) {
    std::vector<std::string> folderFiles;
    std::error_code ignored;  // a missing folder has no files
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
      if (entry.path().extension() == ".json") folderFiles.push_back(entry.path().string());
    std::sort(folderFiles.begin(), folderFiles.end());
    files.insert(files.end(), folderFiles.begin(), folderFiles.end());
  }
  return files;
}

EglVendor loadVendor(const std::string& file) {
  EglVendor vendor{file, "", ""};
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  const nlohmann::json::json_pointer path("/ICD/library_path");
  if (json.is_discarded() || !json.contains(path) || !json.at(path).is_string()) {
    vendor.failure = "cannot be read, or has no library";
    return vendor;
  }
  vendor.library = json.at(path).get<std::string>();
  const ChildAnswer answer = callInChild([&](const Send& send) {
    if (dlopen(vendor.library.c_str(), RTLD_LAZY | RTLD_LOCAL)) return;
    const char* reason = dlerror();
    send(reason ? reason : "cannot be loaded");
  });
  vendor.failure = answer.failure.empty() ? answer.text : answer.failure;
  return vendor;
}

}  // namespace

std::vector<EglVendor> listEglVendors() {
  std::vector<std::string> files = splitPaths(std::getenv("__EGL_VENDOR_LIBRARY_FILENAMES"));
  if (files.empty()) {
    std::vector<std::string> folders = splitPaths(std::getenv("__EGL_VENDOR_LIBRARY_DIRS"));
    if (folders.empty()) folders = {"/etc/glvnd/egl_vendor.d", "/usr/share/glvnd/egl_vendor.d"};
    files = listFiles(folders);
  }
  std::vector<EglVendor> vendors;
  std::transform(files.begin(), files.end(), std::back_inserter(vendors), loadVendor);
  return vendors;
}

}  // namespace enfilade::server
