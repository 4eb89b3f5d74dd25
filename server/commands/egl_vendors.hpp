// The vendor libraries that EGL's loader is told of (libglvnd's ICD files).
#pragma once

#include <string>
#include <vector>

namespace enfilade::server {

struct EglVendor {
  std::string file;     ///< the JSON that names the library
  std::string library;  ///< as it is named there; empty when the file says none
  std::string failure;  ///< why it cannot be used; empty: it loads
};

/// In the order of the loader: $__EGL_VENDOR_LIBRARY_FILENAMES, else the files of
/// $__EGL_VENDOR_LIBRARY_DIRS, else of /etc/glvnd/egl_vendor.d and /usr/share/glvnd/egl_vendor.d.
std::vector<EglVendor> eglVendors();

}  // namespace enfilade::server
