// The hidden verb: reads one file with assimp and writes what it found into a pipe. It runs in a
// process of its own, so nothing that assimp does can hurt the program that asked.
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>

#include "scene/import_convert.hpp"
#include "scene/import_frames.hpp"
#include "scene/model_stream.hpp"

namespace enfilade::scene {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
#else
constexpr bool kSanitized = false;
#endif

// ---- towards the parent -------------------------------------------------------------------------

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

int sendError(const std::string& text) {
  sendFrame(ImportFrame::error, text.data(), text.size());
  return 1;
}

/// Passes assimp's progress on, at most a hundred times.
class ForwardProgress : public Assimp::ProgressHandler {
 public:
  bool Update(float fraction) override {
    const int percent = static_cast<int>(100 * fraction);
    if (percent > last_ && percent <= 100) sendProgress("parse", fraction);
    if (percent > last_) last_ = percent;
    return true;
  }

 private:
  int last_ = 0;
};

// ---- the work -----------------------------------------------------------------------------------

struct Request {
  std::string file;
  std::optional<double> metresPerUnit;
  std::optional<char> up;
  rlim_t memoryLimit = RLIM_INFINITY;
  pid_t parent = 0;
};

template <class T>
T numberFrom(std::string_view text) {
  T value{};
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// Arguments after the verb: parent's process id, memory limit, unit or -, up or -, file.
std::optional<Request> requestFrom(int argc, char** argv) {
  if (argc != 7) return std::nullopt;
  Request request;
  request.parent = numberFrom<pid_t>(argv[2]);
  request.memoryLimit = numberFrom<rlim_t>(argv[3]);
  if (std::string_view(argv[4]) != "-") request.metresPerUnit = numberFrom<double>(argv[4]);
  if (std::string_view(argv[5]) != "-") request.up = argv[5][0];
  request.file = argv[6];
  return request;
}

/// No core files, no more memory than allowed, no life after the parent's.
void limitThisProcess(const Request& request) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != request.parent) _exit(1);  // it died before the line above
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  const rlimit memory{request.memoryLimit, request.memoryLimit};
  // Sanitizers reserve terabytes of address space.
  if (!kSanitized && request.memoryLimit > 0) setrlimit(RLIMIT_AS, &memory);
}

/// Misbehaves as ENFILADE_IMPORT_FAULT says; see import_model.hpp.
void misbehaveIfAsked() {
  const char* wanted = std::getenv("ENFILADE_IMPORT_FAULT");
  const std::string_view fault = wanted == nullptr ? "" : wanted;
  if (fault == "hang") pause();
  if (fault == "crash") {
    signal(SIGSEGV, SIG_DFL);
    raise(SIGSEGV);
  }
  if (fault == "exit") _exit(0);
  if (fault == "memory") throw std::bad_alloc();
  if (fault == "garbage") {
    const std::string noise(1000, 'x');
    sendFrame(ImportFrame::model, noise.data(), noise.size());
    _exit(0);
  }
}

/// Takes down which files assimp opens and looks for.
class WatchedFiles : public Assimp::DefaultIOSystem {
 public:
  explicit WatchedFiles(std::vector<std::string>& names) : names_(names) {}

  bool Exists(const char* file) const override {
    names_.emplace_back(file);
    return DefaultIOSystem::Exists(file);
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    names_.emplace_back(file);
    return DefaultIOSystem::Open(file, mode);
  }

 private:
  std::vector<std::string>& names_;
};

const aiScene& parse(Assimp::Importer& importer, const Request& request,
                     std::vector<std::string>& files) {
  importer.SetIOHandler(new WatchedFiles(files));  // the importer deletes it, and what follows
  importer.SetProgressHandler(new ForwardProgress);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  const aiScene* scene =
      importer.ReadFile(request.file, aiProcess_Triangulate | aiProcess_JoinIdenticalVertices);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    const std::string why = importer.GetErrorString();
    if (why.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
    throw ImportError(request.file + ": cannot be read: " + why +
                      "; check the file in the program that wrote it, or re-export it as glTF "
                      "(parse)");
  }
  return *scene;
}

int answer(const Request& request) {
  sendProgress("open", 0);
  misbehaveIfAsked();
  ConvertInput input;
  input.file = request.file;
  input.format = modelFormatOf(request.file).value();  // the parent has looked
  input.facts = readFileFacts(request.file, input.format);
  input.metresPerUnit = request.metresPerUnit;
  input.up = request.up;

  sendProgress("parse", 0);
  auto* importer = new Assimp::Importer;  // left to _exit: tearing a large scene down takes time
  std::vector<std::string> files;
  const aiScene& scene = parse(*importer, request, files);
  Model model = convertScene(scene, input, sendProgress);
  model.filesBeside.insert(model.filesBeside.end(), files.begin(), files.end());
  sendProgress("send", 0);
  const std::vector<std::byte> stream = serialiseModel(model);
  sendFrame(ImportFrame::model, stream.data(), stream.size());
  return 0;
}

}  // namespace

std::optional<int> runImportChild(int argc, char** argv) {
  if (argc < 2 || std::string_view(argv[1]) != kImportVerb) return std::nullopt;
  const std::optional<Request> request = requestFrom(argc, argv);
  if (!request) return 2;
  limitThisProcess(*request);
  int code = 1;
  try {
    code = answer(*request);
  } catch (const std::bad_alloc&) {
    code = sendError(request->file + ": needs more than the " +
                     std::to_string(request->memoryLimit >> 20) +
                     " MiB of memory that an import may take; split the file or raise the limit");
  } catch (const std::exception& error) {
    code = sendError(error.what());
  }
  _exit(code);
}

}  // namespace enfilade::scene
