// After libglvnd's documentation of its EGL vendor enumeration (src/EGL/icd_enumeration.md).
#include "server/commands/egl_vendors.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> parted(const char* list) {
  std::vector<std::string> parts;
  std::istringstream text(list ? list : "");
  for (std::string part; std::getline(text, part, ':');)
    if (!part.empty()) parts.push_back(part);
  return parts;
}

std::vector<std::string> filesOf(const std::vector<std::string>& folders) {
  std::vector<std::string> files;
  for (const std::string& folder : folders) {
    std::vector<std::string> here;
    std::error_code ignored;  // a folder that is not there has no files
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
      if (entry.path().extension() == ".json") here.push_back(entry.path().string());
    std::sort(here.begin(), here.end());
    files.insert(files.end(), here.begin(), here.end());
  }
  return files;
}

EglVendor vendorOf(const std::string& file) {
  EglVendor vendor{file, "", ""};
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  const nlohmann::json::json_pointer path("/ICD/library_path");
  if (json.is_discarded() || !json.contains(path) || !json.at(path).is_string()) {
    vendor.failure = "cannot be read, or names no library";
    return vendor;
  }
  vendor.library = json.at(path).get<std::string>();
  // Stays loaded, as it would be when EGL is used.
  if (!dlopen(vendor.library.c_str(), RTLD_LAZY | RTLD_LOCAL)) {
    const char* why = dlerror();
    vendor.failure = why ? why : "cannot be loaded";
  }
  return vendor;
}

}  // namespace

std::vector<EglVendor> eglVendors() {
  std::vector<std::string> files = parted(std::getenv("__EGL_VENDOR_LIBRARY_FILENAMES"));
  if (files.empty()) {
    std::vector<std::string> folders = parted(std::getenv("__EGL_VENDOR_LIBRARY_DIRS"));
    if (folders.empty()) folders = {"/etc/glvnd/egl_vendor.d", "/usr/share/glvnd/egl_vendor.d"};
    files = filesOf(folders);
  }
  std::vector<EglVendor> vendors;
  std::transform(files.begin(), files.end(), std::back_inserter(vendors), vendorOf);
  return vendors;
}

}  // namespace enfilade::server
