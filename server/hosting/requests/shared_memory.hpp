// SharedMemory: an anonymous memory file (memfd) that is passed to another process of this machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace enfilade::server {

/// An anonymous file in memory (memfd). Its size is sealed, so that readers never fault.
class SharedMemory {
 public:
  /// Throws std::system_error.
  explicit SharedMemory(std::size_t bytes);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// Sends the file and `number` to the process that listens on the Unix socket of this abstract
  /// name (unix(7), SCM_RIGHTS). Does not wait. False: no process listens, or its queue is full.
  bool passTo(const std::string& socketName, std::uint64_t number) const;
  std::span<std::uint8_t> bytes() const { return bytes_; }

 private:
  int descriptor_ = -1;
  std::span<std::uint8_t> bytes_;
};

}  // namespace enfilade::server
