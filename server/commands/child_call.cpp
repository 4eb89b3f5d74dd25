#include "server/commands/child_call.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <system_error>

namespace enfilade::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kThrew = 199;  // exit status of a child whose function threw

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

/// Reads until the child closes its end. Returns false if it is still open at `deadline`.
bool readAll(int end, Clock::time_point deadline, std::string& text) {
  std::array<char, 4096> bytes{};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd ready{end, POLLIN, 0};
    const int found = left.count() > 0 ? poll(&ready, 1, static_cast<int>(left.count())) : 0;
    if (found < 0 && errno == EINTR) continue;
    if (found == 0) return false;
    const ssize_t count = read(end, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return true;
    text.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

int waitFor(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throwErrno("waitpid");
  return status;
}

[[noreturn]] void runChild(int end, const std::function<void(const Send&)>& function) {
  try {
    function([end](const std::string& text) { writeAll(end, text); });
  } catch (const std::exception& error) {
    writeAll(end, error.what());
    _exit(kThrew);
  }
  _exit(EXIT_SUCCESS);  // without the exit handlers of the parent and of drivers
}

std::string describeEnd(int status) {
  if (WIFSIGNALED(status)) return std::string("crashed (") + strsignal(WTERMSIG(status)) + ")";
  if (WEXITSTATUS(status) == kThrew) return "failed";
  if (WEXITSTATUS(status) == EXIT_SUCCESS) return "";
  return "exited with " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

ChildAnswer callInChild(const std::function<void(const Send&)>& function,
                        std::chrono::seconds limit) {
  // A parent of this process may have ignored the signal; the status of children is then lost.
  std::signal(SIGCHLD, SIG_DFL);
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throwErrno("pipe2");
  const pid_t child = fork();
  if (child == 0) runChild(ends[1], function);
  const int error = errno;
  close(ends[1]);
  ChildAnswer answer;
  bool isOnTime = true;
  if (child > 0) isOnTime = readAll(ends[0], Clock::now() + limit, answer.text);
  close(ends[0]);
  if (child < 0) throw std::system_error(error, std::generic_category(), "fork");
  if (!isOnTime) kill(child, SIGKILL);
  const int status = waitFor(child);
  answer.failure = isOnTime ? describeEnd(status)
                            : "did not answer within " + std::to_string(limit.count()) + " s";
  return answer;
}

}  // namespace enfilade::server
