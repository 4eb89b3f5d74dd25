// The vendor libraries that EGL's loader finds (libglvnd's ICD files).
#pragma once

#include <string>
#include <vector>

namespace enfilade::server {

struct EglVendor {
  std::string file;     ///< the JSON that names the library
  std::string library;  ///< library name in the file; empty if missing
  std::string failure;  ///< reason of the failure; empty: it loads
};

/// Lists vendors in the loader's order: $__EGL_VENDOR_LIBRARY_FILENAMES, else the files of
/// $__EGL_VENDOR_LIBRARY_DIRS, else of /etc/glvnd/egl_vendor.d and /usr/share/glvnd/egl_vendor.d.
std::vector<EglVendor> listEglVendors();

}  // namespace enfilade::server
