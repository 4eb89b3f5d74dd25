#include "server/hosting/requests/shared_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace enfilade::server {

SharedMemory::SharedMemory(std::size_t bytes) {
  const auto fail = [this](const char* what) {
    const std::error_code error(errno, std::generic_category());
    if (descriptor_ >= 0) ::close(descriptor_);
    throw std::system_error(error, what);
  };
  descriptor_ = ::memfd_create("enfilade", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (descriptor_ < 0) fail("memfd_create");
  if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0) fail("ftruncate");
  if (::fcntl(descriptor_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    fail("F_ADD_SEALS");
  void* const mapped = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
  if (mapped == MAP_FAILED) fail("mmap");
  bytes_ = {static_cast<std::uint8_t*>(mapped), bytes};
}

SharedMemory::~SharedMemory() {
  ::munmap(bytes_.data(), bytes_.size());
  ::close(descriptor_);
}

}  // namespace enfilade::server
