#include "server/hosting/requests/shared_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace enfilade::server {
namespace {

bool connectTo(int socket, const std::string& abstractName) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (abstractName.size() >= sizeof address.sun_path) return false;
  std::ranges::copy(abstractName, address.sun_path + 1);  // an abstract name begins with 0
  const auto length = offsetof(sockaddr_un, sun_path) + 1 + abstractName.size();
  return ::connect(socket, reinterpret_cast<const sockaddr*>(&address),
                   static_cast<socklen_t>(length)) == 0;
}

bool sendDescriptor(int socket, int descriptor, std::uint64_t number) {
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof descriptor)] = {};
  iovec bytes{&number, sizeof number};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  cmsghdr* const header = CMSG_FIRSTHDR(&message);
  header->cmsg_level = SOL_SOCKET;
  header->cmsg_type = SCM_RIGHTS;
  header->cmsg_len = CMSG_LEN(sizeof descriptor);
  std::memcpy(CMSG_DATA(header), &descriptor, sizeof descriptor);
  return ::sendmsg(socket, &message, MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof number);
}

}  // namespace

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

bool SharedMemory::passTo(const std::string& socketName, std::uint64_t number) const {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return false;
  const bool passed = connectTo(socket, socketName) && sendDescriptor(socket, descriptor_, number);
  ::close(socket);
  return passed;
}

}  // namespace enfilade::server
