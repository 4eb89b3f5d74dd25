#include "server/commands/child_call.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <system_error>

namespace enfilade::server {
namespace {

[[noreturn]] void throwErrno(const char* call) {
  throw std::system_error(errno, std::generic_category(), call);
}

void writeAll(int end, const std::string& text) {
  for (std::size_t written = 0; written < text.size();) {
    const ssize_t count = write(end, text.data() + written, text.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) _exit(EXIT_FAILURE);  // the parent is gone
    written += static_cast<std::size_t>(count);
  }
}

std::string readAll(int end) {
  std::string text;
  std::array<char, 4096> bytes{};
  for (;;) {
    const ssize_t count = read(end, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

int waitFor(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throwErrno("waitpid");
  return status;
}

}  // namespace

ChildAnswer callInChild(const std::function<void(const Send&)>& function) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throwErrno("pipe");
  const pid_t child = fork();
  if (child < 0) {
    const int error = errno;
    close(ends[0]);
    close(ends[1]);
    errno = error;
    throwErrno("fork");
  }
  if (child == 0) {
    close(ends[0]);
    try {
      function([&](const std::string& text) { writeAll(ends[1], text); });
    } catch (const std::exception& error) {
      std::fprintf(stderr, "enfilade: %s\n", error.what());
      _exit(EXIT_FAILURE);
    }
    _exit(EXIT_SUCCESS);  // without the exit handlers of the parent and of drivers
  }
  close(ends[1]);
  ChildAnswer answer{readAll(ends[0]), ""};
  close(ends[0]);
  const int status = waitFor(child);
  if (WIFSIGNALED(status))
    answer.failure = std::string("crashed (") + strsignal(WTERMSIG(status)) + ")";
  else if (WEXITSTATUS(status) != EXIT_SUCCESS)
    answer.failure = "exited with " + std::to_string(WEXITSTATUS(status));
  return answer;
}

}  // namespace enfilade::server
