#include "scene/import/worker/ipc_messages.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace enfilade::scene {
namespace {

void writeAll(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(kImportPipe, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) _exit(1);  // the parent is gone
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

}  // namespace

void sendFrame(ImportFrame kind, const void* data, std::size_t size) {
  const std::uint64_t length = size;
  char header[ImportFrameHeader::kSize];
  header[0] = static_cast<char>(kind);
  std::memcpy(header + 1, &length, sizeof length);
  writeAll(header, sizeof header);
  writeAll(data, size);
}

void sendProgress(const std::string& stage, double fraction) {
  std::string frame(sizeof fraction, '\0');
  std::memcpy(frame.data(), &fraction, sizeof fraction);
  frame += stage;
  sendFrame(ImportFrame::progress, frame.data(), frame.size());
}

void sendError(const std::string& text) {
  sendFrame(ImportFrame::error, text.data(), text.size());
}

}  // namespace enfilade::scene
