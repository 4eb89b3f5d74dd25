#include "scene/import/worker/ipc_messages.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace enfilade::scene {
namespace {

void writeToPipe(const void* data, std::size_t size) {
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

void beginMessage(ImportMessage kind, std::uint64_t size) {
  char header[ImportMessageHeader::kSize];
  header[0] = static_cast<char>(kind);
  std::memcpy(header + 1, &size, sizeof size);
  writeToPipe(header, sizeof header);
}

void continueMessage(const void* data, std::size_t size) {
  writeToPipe(data, size);
}

void sendMessage(ImportMessage kind, const void* data, std::size_t size) {
  beginMessage(kind, size);
  continueMessage(data, size);
}

void sendProgress(const std::string& stage, double fraction) {
  std::string message(sizeof fraction, '\0');
  std::memcpy(message.data(), &fraction, sizeof fraction);
  message += stage;
  sendMessage(ImportMessage::progress, message.data(), message.size());
}

void sendError(const std::string& text) {
  sendMessage(ImportMessage::error, text.data(), text.size());
}

}  // namespace enfilade::scene
