// Memory that other processes of the same user can read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace enfilade::server {

/// An anonymous file in memory (memfd). Its size is sealed, so that readers never fault.
class SharedMemory {
 public:
  /// Throws std::system_error.
  explicit SharedMemory(std::size_t bytes);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// Of this process: readers open /proc/PID/fd/DESCRIPTOR.
  int descriptor() const { return descriptor_; }
  std::span<std::uint8_t> bytes() const { return bytes_; }

 private:
  int descriptor_ = -1;
  std::span<std::uint8_t> bytes_;
};

}  // namespace enfilade::server
