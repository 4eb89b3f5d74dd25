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
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>
#include <utility>

extern char** environ;

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kReadSize = 1 << 18;  // bytes taken from the pipe at once
constexpr int kFirstOwnDescriptor = 10;     // above those that a copy expects, so that none collide
constexpr double kFarewell = 10;       // seconds between the end of the pipe and of the process
constexpr double kLongestWait = 3600;  // seconds; poll() counts milliseconds in an int

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

/// A process that is waited for in any case, so that no zombie stays behind.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  ~Child() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      wait();
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// The status as waitpid() gives it; -1 when somebody else has taken it. Who has closed the pipe
  /// and is not gone in `patience` seconds is killed.
  int waitFor(double patience) {
    const auto start = Clock::now();
    int status = -1;
    while (std::chrono::duration<double>(Clock::now() - start).count() < patience) {
      const pid_t gone = waitpid(pid_, &status, WNOHANG);
      if (gone == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      } else if (gone == pid_ || errno != EINTR) {
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

constexpr std::size_t kArguments = 14;

/// "x,y,z".
std::string textOf(const Vec3& v) {
  return shortest(v.x()) + ',' + shortest(v.y()) + ',' + shortest(v.z());
}

std::array<std::string, kArguments> argumentsFor(const ImportRequest& request) {
  return {"enfilade",
          kImportVerb,
          std::to_string(getpid()),
          std::to_string(static_cast<int>(request.task)),
          std::to_string(request.memoryLimit),
          shortest(request.timeLimit),
          request.metresPerUnit ? shortest(*request.metresPerUnit) : "-",
          request.up ? std::string(1, *request.up) : "-",
          request.offset ? textOf(*request.offset) : "-",
          std::to_string(static_cast<int>(request.ifcReader)),
          std::to_string(request.firstProduct),
          request.program,
          request.script,
          request.file};
}

template <class T>
T numberFrom(std::string_view text) {
  T value{};
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Vec3 vectorFrom(std::string_view text) {
  Vec3 v;
  for (double& coordinate : v) {
    coordinate = numberFrom<double>(text);
    text.remove_prefix(std::min(text.find(',') + 1, text.size()));
  }
  return v;
}

/// stdout and stderr carry the parent's data and log; what libraries print there is dropped.
void handOver(SpawnSettings& settings, const ImportRequest& request, int writeEnd) {
  posix_spawn_file_actions_adddup2(&settings.files, writeEnd, kImportPipe);
  if (request.ifcFile >= 0) {
    posix_spawn_file_actions_adddup2(&settings.files, request.ifcFile, kIfcFile);
  }
  if (request.ifcWanted >= 0) {
    posix_spawn_file_actions_adddup2(&settings.files, request.ifcWanted, kIfcWanted);
  }
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

pid_t startCopy(const ImportRequest& request, int writeEnd) {
  const std::array<std::string, kArguments> arguments = argumentsFor(request);
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  SpawnSettings settings;
  handOver(settings, request, writeEnd);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, "/proc/self/exe", &settings.files, &settings.attributes,
                                argv.data(), environ);
  if (error != 0) {
    throw ImportError(request.file + ": the import process cannot be started: " +
                      std::strerror(error) + "; is /proc mounted? (start)");
  }
  return pid;
}

/// Both ends of a pipe, out of the way of the descriptors that a copy expects.
std::array<int, 2> openPipe(const ImportRequest& request) {
  std::array<int, 2> ends{};
  const auto fail = [&] {
    throw ImportError(request.file + ": no pipe to the import process: " + std::strerror(errno) +
                      " (start)");
  };
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail();
  const FileDescriptor lowRead(ends[0]), lowWrite(ends[1]);
  FileDescriptor readEnd(fcntl(lowRead.get(), F_DUPFD_CLOEXEC, kFirstOwnDescriptor));
  FileDescriptor writeEnd(fcntl(lowWrite.get(), F_DUPFD_CLOEXEC, kFirstOwnDescriptor));
  if (readEnd.get() < 0 || writeEnd.get() < 0) fail();
  return {readEnd.release(), writeEnd.release()};
}

// ---- listening ----------------------------------------------------------------------------------

bool isFrameKind(std::uint8_t kind) {
  return std::string_view("PEMTGOFD").find(static_cast<char>(kind)) != std::string_view::npos;
}

/// Makes frames of bytes as they come.
class FrameBuffer {
 public:
  /// No frame may be longer than all that its writer may hold in memory.
  explicit FrameBuffer(std::size_t longest) : longest_(longest) {}
  /// False when the bytes make no sense.
  bool take(std::span<const std::byte> bytes, const TakeFrame& takeFrame) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    std::size_t used = 0;
    while (buffer_.size() - used >= ImportFrameHeader::kSize) {
      ImportFrameHeader header{};
      header.kind = static_cast<std::uint8_t>(buffer_[used]);
      std::memcpy(&header.size, buffer_.data() + used + 1, sizeof header.size);
      if (!isFrameKind(header.kind) || header.size > longest_) return false;
      if (header.size > buffer_.size() - used - ImportFrameHeader::kSize) break;
      const std::span body(buffer_.data() + used + ImportFrameHeader::kSize, header.size);
      if (!takeFrame(static_cast<ImportFrame>(header.kind), body)) return false;
      used += ImportFrameHeader::kSize + header.size;
    }
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(used));
    return true;
  }

 private:
  std::size_t longest_;
  std::vector<std::byte> buffer_;
};

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Listens until the process closes the pipe or is to be killed.
ImportEnd::How listen(int readEnd, const ImportRequest& request, const TakeFrame& take,
                      const std::function<double()>& stallLimit) {
  const auto start = Clock::now();
  auto heard = start;
  std::vector<std::byte> chunk(kReadSize);
  FrameBuffer frames(request.memoryLimit > 0 ? request.memoryLimit
                                             : std::numeric_limits<std::size_t>::max());
  for (;;) {  // ends with the time limit at the latest
    const double left = request.timeLimit - secondsSince(start);
    const double patience = stallLimit() - secondsSince(heard);
    if (!(left > 0)) return ImportEnd::How::timeLimit;
    if (!(patience > 0)) return ImportEnd::How::stallLimit;
    const double wait = std::min({left, patience, kLongestWait});
    pollfd waiting{readEnd, POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(wait * 1000) + 1) <= 0) continue;  // or interrupted
    const ssize_t size = read(readEnd, chunk.data(), chunk.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return ImportEnd::How::exited;
    heard = Clock::now();
    if (!frames.take(std::span(chunk).first(static_cast<std::size_t>(size)), take)) {
      return ImportEnd::How::garbled;
    }
  }
}

}  // namespace

std::optional<ImportRequest> importRequestFrom(int argc, char** argv, int& parent) {
  if (argc != static_cast<int>(kArguments)) return std::nullopt;
  ImportRequest request;
  parent = numberFrom<int>(argv[2]);
  request.task = static_cast<ImportTask>(numberFrom<int>(argv[3]));
  request.memoryLimit = numberFrom<std::size_t>(argv[4]);
  request.timeLimit = numberFrom<double>(argv[5]);
  if (std::string_view(argv[6]) != "-") request.metresPerUnit = numberFrom<double>(argv[6]);
  if (std::string_view(argv[7]) != "-") request.up = argv[7][0];
  if (std::string_view(argv[8]) != "-") request.offset = vectorFrom(argv[8]);
  request.ifcReader = static_cast<IfcReader>(numberFrom<int>(argv[9]));
  request.firstProduct = numberFrom<std::uint32_t>(argv[10]);
  request.program = argv[11];
  request.script = argv[12];
  request.file = argv[13];
  return request;
}

std::string ImportEnd::words() const {
  if (how == How::timeLimit) return "took too long";
  if (how == How::stallLimit) return "hung";
  if (how == How::garbled) return "answered with noise";
  if (status != -1 && WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) {
    return "was killed, by hand or by the system for want of memory";
  }
  if (status != -1 && WIFSIGNALED(status)) {
    return std::string("crashed (") + strsignal(WTERMSIG(status)) + ")";
  }
  return "ended without an answer";
}

ImportEnd runImportProcess(const ImportRequest& request, const TakeFrame& take,
                           const std::function<double()>& stallLimit) {
  const std::array<int, 2> ends = openPipe(request);
  const FileDescriptor readEnd(ends[0]);
  FileDescriptor writeEnd(ends[1]);
  Child child(startCopy(request, writeEnd.get()));
  writeEnd.close();
  ImportEnd end;
  end.how = listen(readEnd.get(), request, take, stallLimit);
  if (end.how == ImportEnd::How::exited) end.status = child.waitFor(kFarewell);
  return end;
}

bool readProgress(std::span<const std::byte> body, std::string& stage, double& fraction) {
  if (body.size() < sizeof fraction) return false;
  std::memcpy(&fraction, body.data(), sizeof fraction);
  const auto text = body.subspan(sizeof fraction);
  stage.assign(reinterpret_cast<const char*>(text.data()), text.size());
  fraction = fraction > 0 ? std::min(fraction, 1.0) : 0.0;
  return true;
}

std::string shortest(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace enfilade::scene
