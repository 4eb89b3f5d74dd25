#include "scene/import/worker/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <thread>
#include <utility>
#include <vector>

#include "scene/base/elapsed.hpp"

extern char** environ;

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kPipeReadSize = 1 << 18;  // bytes per read from the pipe, at least
constexpr int kPipeSize = 1 << 20;              // bytes; the writer waits less often than at 64 KiB
constexpr double kExitTimeout = 10;    // seconds between the end of the pipe and of the process
constexpr double kMaxPollWait = 3600;  // seconds; poll() counts milliseconds in an int

// ---- owners -------------------------------------------------------------------------------------

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() { close(); }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
};

/// A child process that is always waited for, so that no zombie remains.
class WorkerProcess {
 public:
  explicit WorkerProcess(pid_t pid) : pid_(pid) {}
  ~WorkerProcess() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      wait();
    }
  }
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// Returns the status as waitpid() does; -1 if another caller has taken it. Kills a process that
  /// has not exited after `timeout` seconds.
  int waitFor(double timeout) {
    const auto start = Clock::now();
    int status = -1;
    while (std::chrono::duration<double>(Clock::now() - start).count() < timeout) {
      const pid_t exitedPid = waitpid(pid_, &status, WNOHANG);
      if (exitedPid == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      } else if (exitedPid == pid_ || errno != EINTR) {
        pid_ = -1;
        return status;
      }
    }
    kill(pid_, SIGKILL);
    return wait();
  }
  int wait() {
    int status = -1;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_;
};

struct SpawnSettings {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  SpawnSettings() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
};

// ---- starting -----------------------------------------------------------------------------------

constexpr std::size_t kArgumentCount = 17;

/// Formats as "x,y,z".
std::string formatVec3(const Vec3& v) {
  return formatShortest(v.x()) + ',' + formatShortest(v.y()) + ',' + formatShortest(v.z());
}

std::array<std::string, kArgumentCount> makeArguments(const ImportRequest& request) {
  return {"enfilade",
          kImportVerb,
          std::to_string(getpid()),
          std::to_string(static_cast<int>(request.task)),
          std::to_string(request.options.memoryLimit),
          formatShortest(request.options.timeLimit),
          request.options.metresPerUnit ? formatShortest(*request.options.metresPerUnit) : "-",
          request.options.up ? toString(*request.options.up) : "-",
          request.options.offset ? formatVec3(*request.options.offset) : "-",
          std::to_string(static_cast<int>(request.options.ifcReader)),
          request.options.georeference ? "map" : "-",
          request.options.gltfScene,
          request.options.ignoreAppearance ? "ignore" : "-",
          std::to_string(request.firstProduct),
          request.program,
          request.script,
          request.file};
}

template <class T>
T parseArgument(std::string_view text) {
  T value{};
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Vec3 parseVec3(std::string_view text) {
  Vec3 v;
  for (double& coordinate : v) {
    coordinate = parseArgument<double>(text);
    text.remove_prefix(std::min(text.find(',') + 1, text.size()));
  }
  return v;
}

/// Sets the worker's descriptors and signals. stdout and stderr carry the parent's data and log, so
/// output of libraries is dropped.
void configureDescriptors(SpawnSettings& settings, const ImportRequest& request, int writeEnd) {
  posix_spawn_file_actions_adddup2(&settings.files, writeEnd, kImportPipe);
  if (request.ifcFile >= 0) {
    posix_spawn_file_actions_adddup2(&settings.files, request.ifcFile, kIfcFile);
  }
  if (request.ifcProductIds >= 0) {
    posix_spawn_file_actions_adddup2(&settings.files, request.ifcProductIds, kIfcProductIds);
  }
  if (request.ifcReady >= 0)
    posix_spawn_file_actions_adddup2(&settings.files, request.ifcReady, kIfcReady);
  posix_spawn_file_actions_addopen(&settings.files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&settings.files, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&settings.files, 2, "/dev/null", O_WRONLY, 0);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&settings.attributes, &signals);
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&settings.attributes, &signals);
  posix_spawnattr_setflags(&settings.attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
}

pid_t spawnWorker(const ImportRequest& request, int writeEnd) {
  const std::array<std::string, kArgumentCount> arguments = makeArguments(request);
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  SpawnSettings settings;
  configureDescriptors(settings, request, writeEnd);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, "/proc/self/exe", &settings.files, &settings.attributes,
                                argv.data(), environ);
  if (error != 0) {
    throw ImportError(request.file + ": the import process cannot be started: " +
                      std::strerror(error) + "; is /proc mounted?");
  }
  return pid;
}

/// Opens a pipe whose descriptors do not collide with those of a worker.
std::array<int, 2> openPipe(const ImportRequest& request) {
  std::array<int, 2> ends{};
  const auto fail = [&] {
    throw ImportError(request.file + ": no pipe to the import process: " + std::strerror(errno));
  };
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail();
  const FileDescriptor lowRead(ends[0]), lowWrite(ends[1]);
  fcntl(lowRead.get(), F_SETPIPE_SZ, kPipeSize);  // refused where users have few pages for pipes
  FileDescriptor readEnd(fcntl(lowRead.get(), F_DUPFD_CLOEXEC, kFirstParentDescriptor));
  FileDescriptor writeEnd(fcntl(lowWrite.get(), F_DUPFD_CLOEXEC, kFirstParentDescriptor));
  if (readEnd.get() < 0 || writeEnd.get() < 0) fail();
  return {readEnd.release(), writeEnd.release()};
}

// ---- receiving ----------------------------------------------------------------------------------

bool isMessageKind(std::uint8_t kind) {
  return std::string_view("PEMTGOFDXW").find(static_cast<char>(kind)) != std::string_view::npos;
}

/// Assembles messages from bytes. Its memory grows by realloc(), which moves the pages of large
/// blocks instead of copying them.
class MessageBuffer {
 public:
  /// A message may not exceed the memory that its writer may use.
  explicit MessageBuffer(std::size_t maxMessageSize) : maxMessageSize_(maxMessageSize) {}
  ~MessageBuffer() { std::free(bytes_); }
  MessageBuffer(const MessageBuffer&) = delete;
  MessageBuffer& operator=(const MessageBuffer&) = delete;

  /// Room for the next bytes. Its size is at least kPipeReadSize.
  std::span<std::byte> reserve() {
    if (begin_ > 0 && (begin_ == end_ || capacity_ - end_ < kPipeReadSize)) {
      std::memmove(bytes_, bytes_ + begin_, end_ - begin_);
      end_ -= std::exchange(begin_, 0);
    }
    if (capacity_ - end_ < kPipeReadSize) {
      const std::size_t capacity = std::max(2 * capacity_, end_ + kPipeReadSize);
      void* const grown = std::realloc(bytes_, capacity);
      if (grown == nullptr) throw std::bad_alloc();
      bytes_ = static_cast<std::byte*>(grown);
      capacity_ = capacity;
    }
    return {bytes_ + end_, capacity_ - end_};
  }
  /// Takes `count` bytes that lie in the room. Returns false if they are invalid.
  bool append(std::size_t count, const MessageHandler& handler) {
    end_ += count;
    while (end_ - begin_ >= ImportMessageHeader::kSize) {
      ImportMessageHeader header{};
      const std::byte* const message = bytes_ + begin_;
      header.kind = static_cast<std::uint8_t>(*message);
      std::memcpy(&header.size, message + 1, sizeof header.size);
      if (!isMessageKind(header.kind) || header.size > maxMessageSize_) return false;
      if (header.size > end_ - begin_ - ImportMessageHeader::kSize) break;
      const std::span body(message + ImportMessageHeader::kSize, header.size);
      if (!handler(static_cast<ImportMessage>(header.kind), body)) return false;
      begin_ += ImportMessageHeader::kSize + header.size;
    }
    return true;
  }

 private:
  std::size_t maxMessageSize_;
  std::byte* bytes_ = nullptr;  // those from begin_ to end_ are not handled yet
  std::size_t begin_ = 0, end_ = 0, capacity_ = 0;
};

/// Receives messages until the worker closes the pipe or must be killed.
ImportExit::Reason receiveMessages(int readEnd, const ImportRequest& request,
                                   const MessageHandler& handler,
                                   const std::function<double()>& stallLimit) {
  const auto start = Clock::now();
  auto lastMessage = start;
  MessageBuffer messages(request.options.memoryLimit > 0 ? request.options.memoryLimit
                                                         : std::numeric_limits<std::size_t>::max());
  for (;;) {  // ends with the time limit at the latest
    const double left = request.options.timeLimit - measureSecondsSince(start);
    const double stallTime = stallLimit() - measureSecondsSince(lastMessage);
    if (!(left > 0)) return ImportExit::Reason::timeLimit;
    if (!(stallTime > 0)) return ImportExit::Reason::stallLimit;
    const double wait = std::min({left, stallTime, kMaxPollWait});
    pollfd waiting{readEnd, POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(wait * 1000) + 1) <= 0) continue;  // or interrupted
    const std::span<std::byte> room = messages.reserve();
    const ssize_t size = read(readEnd, room.data(), room.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return ImportExit::Reason::exited;
    lastMessage = Clock::now();
    if (!messages.append(static_cast<std::size_t>(size), handler))
      return ImportExit::Reason::malformed;
  }
}

}  // namespace

std::optional<ImportRequest> parseImportRequest(int argc, char** argv, int& parent) {
  if (argc != static_cast<int>(kArgumentCount)) return std::nullopt;
  ImportRequest request;
  parent = parseArgument<int>(argv[2]);
  request.task = static_cast<ImportTask>(parseArgument<int>(argv[3]));
  request.options.memoryLimit = parseArgument<std::size_t>(argv[4]);
  request.options.timeLimit = parseArgument<double>(argv[5]);
  if (std::string_view(argv[6]) != "-")
    request.options.metresPerUnit = parseArgument<double>(argv[6]);
  request.options.up = parseUpAxis(argv[7]);
  if (std::string_view(argv[8]) != "-") request.options.offset = parseVec3(argv[8]);
  request.options.ifcReader = static_cast<IfcReader>(parseArgument<int>(argv[9]));
  request.options.georeference = std::string_view(argv[10]) == "map";
  request.options.gltfScene = argv[11];
  request.options.ignoreAppearance = std::string_view(argv[12]) == "ignore";
  request.firstProduct = parseArgument<std::uint32_t>(argv[13]);
  request.program = argv[14];
  request.script = argv[15];
  request.file = argv[16];
  return request;
}

std::string ImportExit::describe() const {
  if (reason == Reason::timeLimit) return "timed out";
  if (reason == Reason::stallLimit) return "hung";
  if (reason == Reason::malformed) return "sent invalid data";
  if (status != -1 && WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) {
    return "was killed, by a user or by the system for lack of memory";
  }
  if (status != -1 && WIFSIGNALED(status)) {
    return std::string("crashed (") + strsignal(WTERMSIG(status)) + ")";
  }
  return "ended without an answer";
}

ImportExit runImportProcess(const ImportRequest& request, const MessageHandler& handler,
                            const std::function<double()>& stallLimit) {
  const std::array<int, 2> ends = openPipe(request);
  const FileDescriptor readEnd(ends[0]);
  FileDescriptor writeEnd(ends[1]);
  WorkerProcess worker(spawnWorker(request, writeEnd.get()));
  writeEnd.close();
  ImportExit outcome;
  outcome.reason = receiveMessages(readEnd.get(), request, handler, stallLimit);
  if (outcome.reason == ImportExit::Reason::exited) outcome.status = worker.waitFor(kExitTimeout);
  return outcome;
}

bool readProgress(std::span<const std::byte> body, std::string& stage, double& fraction) {
  if (body.size() < sizeof fraction) return false;
  std::memcpy(&fraction, body.data(), sizeof fraction);
  const auto text = body.subspan(sizeof fraction);
  stage.assign(reinterpret_cast<const char*>(text.data()), text.size());
  fraction = fraction > 0 ? std::min(fraction, 1.0) : 0.0;
  return true;
}

std::string formatShortest(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace enfilade::scene
