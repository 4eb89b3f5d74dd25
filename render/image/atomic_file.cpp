#include "render/image/atomic_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace enfilade::render {
namespace {

[[noreturn]] void throwFileError(const char* call, const std::filesystem::path& file, int error) {
  throw std::runtime_error("cannot write " + file.string() + ": " + call + ": " +
                           std::strerror(error) +
                           "; the folder must exist, be writable and have free space");
}

/// Writes all bytes and closes the descriptor. Returns 0, or errno of the call named in `call`.
int writeAll(int descriptor, const void* data, std::size_t bytes, const char*& call) {
  const auto* next = static_cast<const char*>(data);
  call = "write";
  int error = 0;
  while (bytes > 0 && error == 0) {
    const ssize_t written = ::write(descriptor, next, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      error = written < 0 ? errno : EIO;
    } else {
      next += written;
      bytes -= static_cast<std::size_t>(written);
    }
  }
  if (::close(descriptor) != 0 && error == 0) {
    call = "close";
    error = errno;
  }
  return error;
}

/// Resolves links, because renaming would replace the link itself.
std::filesystem::path resolveLinks(std::filesystem::path file) {
  constexpr int kMaxLinks = 40;  // as the kernel
  std::error_code failure;
  for (int i = 0; i < kMaxLinks; ++i) {
    const std::filesystem::path target = std::filesystem::read_symlink(file, failure);
    if (failure) return file;
    file = file.parent_path() / target;
  }
  throwFileError("readlink", file, ELOOP);
}

/// Whether the file is a device or pipe, which must be written directly and not replaced.
bool isStream(std::filesystem::file_type type) {
  using Type = std::filesystem::file_type;
  return type == Type::character || type == Type::block || type == Type::fifo;
}

void writeToStream(const std::filesystem::path& stream, const void* data, std::size_t bytes) {
  const int descriptor = ::open(stream.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) throwFileError("open", stream, errno);
  const char* call = "";
  if (const int error = writeAll(descriptor, data, bytes, call))
    throwFileError(call, stream, error);
}

}  // namespace

void writeFileAtomically(const std::filesystem::path& requested, const void* data,
                         std::size_t bytes) {
  const std::filesystem::path file = resolveLinks(requested);
  std::error_code unknown;
  if (isStream(std::filesystem::status(file, unknown).type())) {
    writeToStream(file, data, bytes);
    return;
  }
  static std::atomic<unsigned> count{0};
  std::filesystem::path part = file;
  part += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(count++);
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) throwFileError("open", file, errno);
  const char* call = "";
  int error = writeAll(descriptor, data, bytes, call);
  if (error == 0 && ::rename(part.c_str(), file.c_str()) != 0) {
    call = "rename";
    error = errno;
  }
  if (error == 0) return;
  ::unlink(part.c_str());
  throwFileError(call, file, error);
}

}  // namespace enfilade::render
