// Creates an output folder and checks that it is writable, before long work begins.
#pragma once

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

namespace enfilade::server {

/// Creates the folder and checks that it is writable. Throws std::runtime_error with its name and
/// the system's reason; `option` is the option that selects another folder.
inline void prepareFolder(const std::filesystem::path& folder, const char* option = "--out") {
  const std::filesystem::path probe = folder / ".writable";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::ofstream(probe).put(' ').flush())
    error = std::error_code(errno, std::generic_category());
  if (error)
    throw std::runtime_error("cannot write to " + folder.string() + ": " + error.message() +
                             "; give another folder with " + option);
  std::filesystem::remove(probe, error);
}

}  // namespace enfilade::server
