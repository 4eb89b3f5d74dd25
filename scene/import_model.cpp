// The asking side of an import: looks at the file, starts the child, listens to it, and turns every
// way in which it can fail into an ImportError.
#include "scene/import_model.hpp"

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
#include <map>

#include "scene/import_file_facts.hpp"
#include "scene/import_frames.hpp"
#include "scene/model_stream.hpp"

extern char** environ;

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::array<std::string_view, 6> kExtensions{".gltf", ".glb", ".obj",
                                                      ".dae",  ".fbx", ".ifc"};
constexpr std::size_t kReadSize = 1 << 18;  // bytes taken from the pipe at once

// ---- before anything starts ---------------------------------------------------------------------

std::string knownExtensions() {
  std::string list;
  for (const std::string_view e : kExtensions) list += (list.empty() ? "" : ", ") + std::string(e);
  return list;
}

void requireReadableModel(const fs::path& file) {
  const std::string name = file.string();
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) {
    throw ImportError(name + ": no such file; check the path (open)");
  }
  if (fs::is_directory(status)) {
    throw ImportError(name + ": is a folder; name the model file in it (open)");
  }
  if (!fs::is_regular_file(status)) throw ImportError(name + ": is not a regular file (open)");
  std::string extension = file.extension().string();
  if (extension == ".ifczip" || extension == ".IFCZIP") {
    throw ImportError(name + ": unzip it first and name the .ifc file that is in it (open)");
  }
  if (!modelFormatOf(file)) {
    throw ImportError(name + ": unknown extension '" + extension + "'; known are " +
                      knownExtensions() + " (open)");
  }
  if (fs::file_size(file, error) == 0 && !error) {
    throw ImportError(name + ": is empty; export or copy it again (open)");
  }
  if (access(file.c_str(), R_OK) != 0) {
    throw ImportError(name + ": cannot be read: " + std::strerror(errno) + " (open)");
  }
}

void requireSaneOptions(const ImportOptions& options) {
  if (options.metresPerUnit &&
      !(*options.metresPerUnit > 0 && std::isfinite(*options.metresPerUnit))) {
    throw ImportError("metres per unit: must be a positive number");
  }
  if (options.up && (*options.up < 'x' || *options.up > 'z')) {
    throw ImportError(std::string("up axis: '") + *options.up + "' is neither x, y nor z");
  }
}

// ---- owners -------------------------------------------------------------------------------------

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() { close(); }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }
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

  /// The status as waitpid() gives it; -1 when somebody else has taken it.
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

std::string shortest(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

pid_t startChild(const fs::path& file, const ImportOptions& options, int writeEnd) {
  const std::array<std::string, 7> arguments{
      "enfilade",
      kImportVerb,
      std::to_string(getpid()),
      std::to_string(options.memoryLimit),
      options.metresPerUnit ? shortest(*options.metresPerUnit) : "-",
      options.up ? std::string(1, *options.up) : "-",
      file.string()};
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);

  SpawnSettings settings;
  // stdout and stderr carry the parent's data and log; what libraries print there is dropped.
  posix_spawn_file_actions_adddup2(&settings.files, writeEnd, kImportPipe);
  posix_spawn_file_actions_addopen(&settings.files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&settings.files, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&settings.files, 2, "/dev/null", O_WRONLY, 0);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&settings.attributes, &signals);
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&settings.attributes, &signals);
  posix_spawnattr_setflags(&settings.attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, "/proc/self/exe", &settings.files, &settings.attributes,
                                argv.data(), environ);
  if (error != 0) {
    throw ImportError(file.string() + ": the import process cannot be started: " +
                      std::strerror(error) + "; is /proc mounted? (start)");
  }
  return pid;
}

// ---- listening ----------------------------------------------------------------------------------

/// Takes the child's bytes as they come and makes frames of them.
class Listener {
 public:
  Listener(const fs::path& file, const ImportProgress& progress)
      : file_(file), progress_(progress) {}

  void take(const std::byte* data, std::size_t size) {
    buffer_.insert(buffer_.end(), data, data + size);
    while (buffer_.size() >= ImportFrameHeader::kSize) {
      ImportFrameHeader header{};
      header.kind = static_cast<std::uint8_t>(buffer_[0]);
      std::memcpy(&header.size, buffer_.data() + 1, sizeof header.size);
      if (header.size > buffer_.size() - ImportFrameHeader::kSize) return;
      handle(header, std::span(buffer_).subspan(ImportFrameHeader::kSize, header.size));
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(
                                                           ImportFrameHeader::kSize + header.size));
    }
  }

  const std::string& stage() const { return stage_; }
  std::optional<Model>& model() { return model_; }

 private:
  void handle(const ImportFrameHeader& header, std::span<const std::byte> body) {
    const std::string text(
        reinterpret_cast<const char*>(body.data()),
        header.kind == static_cast<std::uint8_t>(ImportFrame::model) ? 0 : body.size());
    switch (static_cast<ImportFrame>(header.kind)) {
      case ImportFrame::progress:
        return showProgress(text);
      case ImportFrame::error:
        throw ImportError(text);
      case ImportFrame::model:
        return readModel(body);
    }
    throw ImportError(file_.string() + ": the import process answered with noise during '" +
                      stage_ + "'; re-export the file as glTF");
  }

  void showProgress(const std::string& text) {
    double fraction = 0;
    if (text.size() < sizeof fraction) return;
    std::memcpy(&fraction, text.data(), sizeof fraction);
    stage_ = text.substr(sizeof fraction);
    if (progress_) progress_(stage_, std::clamp(fraction, 0.0, 1.0));
  }

  void readModel(std::span<const std::byte> body) {
    try {
      model_ = deserialiseModel(body);
    } catch (const ModelStreamError& error) {
      throw ImportError(file_.string() + ": the import process answered with noise during '" +
                        stage_ + "' (" + error.what() + "); re-export the file as glTF");
    }
  }

  const fs::path& file_;
  const ImportProgress& progress_;
  std::vector<std::byte> buffer_;
  std::string stage_ = "start";
  std::optional<Model> model_;
};

/// Listens until the child closes the pipe. Throws when the time is over.
void listen(int readEnd, const fs::path& file, double timeLimit, Listener& listener) {
  const auto start = Clock::now();
  std::vector<std::byte> chunk(kReadSize);
  for (;;) {
    const double left = timeLimit - std::chrono::duration<double>(Clock::now() - start).count();
    if (!(left > 0)) {
      throw ImportError(file.string() + ": not read within " + shortest(timeLimit) + " s (stage '" +
                        listener.stage() +
                        "'); simplify or split the file, re-export it as glTF, or allow more "
                        "time");
    }
    pollfd waiting{readEnd, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::min(left, 3600.0) * 1000) + 1);
    if (ready <= 0) continue;  // interrupted, or the time is over
    const ssize_t size = read(readEnd, chunk.data(), chunk.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return;
    listener.take(chunk.data(), static_cast<std::size_t>(size));
  }
}

[[noreturn]] void throwDied(const fs::path& file, const std::string& stage, int status) {
  std::string how = "ended without an answer";
  if (status != -1 && WIFSIGNALED(status)) {
    how = std::string("crashed (") + strsignal(WTERMSIG(status)) + ")";
  }
  std::string hint = "re-export it as glTF";
  if (modelFormatOf(file) == ModelFormat::ifc) {
    hint =
        "the reader knows IFC2x3 best: re-export it as IFC2x3 or glTF, or check the file "
        "with an IFC validator for references to entities that are missing";
  }
  throw ImportError(file.string() + ": the import process " + how + " during '" + stage + "'; " +
                    hint);
}

}  // namespace

std::span<const std::string_view> importableExtensions() {
  return kExtensions;
}

Model importModel(const fs::path& file, const ImportOptions& options,
                  const ImportProgress& progress) {
  requireSaneOptions(options);
  requireReadableModel(file);
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw ImportError(file.string() + ": no pipe to the import process: " + std::strerror(errno) +
                      " (start)");
  }
  const FileDescriptor readEnd(ends[0]);
  FileDescriptor writeEnd(ends[1]);
  Child child(startChild(file, options, writeEnd.get()));
  writeEnd.close();

  Listener listener(file, progress);
  listen(readEnd.get(), file, options.timeLimit, listener);
  const int status = child.wait();
  if (!listener.model()) throwDied(file, listener.stage(), status);
  Model model = std::move(*listener.model());
  model.source = file.string();
  return model;
}

std::optional<double> metresPerUnitFrom(const std::string& text) {
  static const std::map<std::string, double> kUnits{
      {"m", 1}, {"mm", 0.001}, {"cm", 0.01}, {"ft", 0.3048}, {"in", 0.0254}};
  if (const auto unit = kUnits.find(text); unit != kUnits.end()) return unit->second;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (!whole || !(value > 0) || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace enfilade::scene
