// The hidden verb: what copies of our own executable do for an import. Each runs in a process of
// its own, so nothing that a reader does can hurt the program that asked.
#include <signal.h>
#include <sys/personality.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <set>
#include <string_view>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/assimp/convert_scene.hpp"
#include "scene/import/ifc/ifc_plus_plus.hpp"
#include "scene/import/ifc/import_ifc.hpp"
#include "scene/import/worker/model_stream.hpp"
#include "scene/import/worker/process.hpp"

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

// ---- the work -----------------------------------------------------------------------------------

/// No core files, no more memory than allowed, no life after the parent's.
void limitThisProcess(const ImportRequest& request, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // it died before the line above
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  // Only the soft limit: Node.js, which may be started from here, reserves address space by the
  // tens of gigabytes and is limited in what it writes to. So do sanitizers.
  const bool node = request.task == ImportTask::webIfc;
  rlimit memory{};
  getrlimit(RLIMIT_AS, &memory);
  const bool limited = request.memoryLimit > 0 && !kSanitized;
  memory.rlim_cur = limited && !node ? request.memoryLimit : memory.rlim_max;
  setrlimit(RLIMIT_AS, &memory);
  const rlimit data{request.memoryLimit, request.memoryLimit};
  if (node && request.memoryLimit > 0) setrlimit(RLIMIT_DATA, &data);
}

/// What ENFILADE_IMPORT_FAULT calls a copy with this task, with the colon.
std::string_view faultPrefix(ImportTask task) {
  switch (task) {
    case ImportTask::model:
      return "";
    case ImportTask::assimp:
      return "assimp:";
    case ImportTask::webIfc:
      return "web-ifc:";
    case ImportTask::ifcPlusPlus:
      return "ifcplusplus:";
  }
  return "";
}

/// Misbehaves as ENFILADE_IMPORT_FAULT says; see import_model.hpp.
void misbehaveIfAsked(ImportTask task) {
  const char* wanted = std::getenv("ENFILADE_IMPORT_FAULT");
  std::string_view fault = wanted == nullptr ? "" : wanted;
  if (!fault.starts_with(faultPrefix(task))) return;
  fault.remove_prefix(faultPrefix(task).size());
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

/// Materials of OBJ files stand in files of their own, which go missing when models are passed on.
void tellMissingMaterials(const std::vector<std::string>& files, std::vector<Problem>& problems) {
  std::set<std::string> missing;
  for (const std::string& file : files) {
    std::error_code error;
    if (file.ends_with(".mtl") && !std::filesystem::exists(file, error)) missing.insert(file);
  }
  if (!missing.empty())
    problems.push_back({"missing_material_file", missing.size(),
                        std::filesystem::path(*missing.begin()).filename().string()});
}

std::string readDescriptor(int descriptor) {
  struct stat status {};
  std::string text;
  if (fstat(descriptor, &status) == 0) text.resize(static_cast<std::size_t>(status.st_size));
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t size =
        pread(descriptor, text.data() + done, text.size() - done, static_cast<off_t>(done));
    if (size <= 0) throw ImportError("the file cannot be read from memory (open)");
    done += static_cast<std::size_t>(size);
  }
  return text;
}

[[noreturn]] void throwUnread(const ConvertInput& input, const std::string& why) {
  if (why.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
  if (input.format == ModelFormat::ifc) throw ImportError(why);  // others may have tried too
  throw ImportError(input.file.string() + ": cannot be read: " + why +
                    "; check the file in the program that wrote it, or re-export it as glTF "
                    "(parse)");
}

Model modelByAssimp(const ImportRequest& request) {
  ConvertInput input;
  input.file = request.file;
  input.format = modelFormatOf(request.file).value();  // the parent has looked
  input.metresPerUnit = request.metresPerUnit;
  input.up = request.up;
  input.offset = request.offset;
  FileToRead file{request.file, "", request.task == ImportTask::assimp};
  if (file.isIfc) {
    file.text = readDescriptor(kIfcFile);
    input.facts = ifcFileFacts(file.text);
  } else {
    input.facts = readFileFacts(request.file, input.format);
    if (input.format == ModelFormat::collada) file.text = mendedCollada(request.file, input.facts);
    if (input.format == ModelFormat::obj) {
      const double unit = request.metresPerUnit.value_or(input.facts.metresPerUnit);
      ShiftedText shifted = shiftedObj(request.file, kFarAway / unit);
      file.text = std::move(shifted.text);
      input.shift = shifted.shift;
    }
  }
  sendProgress("parse", 0);
  const FileRead read = readByAssimp(file);
  if (read.scene == nullptr) throwUnread(input, read.failure);
  Model model = convertScene(*read.scene, read.materials, input, sendProgress);
  tellMissingMaterials(read.files, model.problems);
  model.filesBeside.insert(model.filesBeside.end(), read.files.begin(), read.files.end());
  model.filesBeside.push_back(read.library);
  return model;
}

void sendModel(const Model& model) {
  sendProgress("send", 0);
  const std::vector<std::byte> stream = serialiseModel(model);
  sendFrame(ImportFrame::model, stream.data(), stream.size());
}

/// Starts this program once more, in the same process, without randomised addresses: ifcplusplus'
/// results vary with them. Where that is not allowed, they vary.
void steadyAddresses(char** argv) {
  const int now = personality(0xffffffff);
  if (now < 0 || (now & ADDR_NO_RANDOMIZE) != 0) return;
  if (personality(static_cast<unsigned long>(now | ADDR_NO_RANDOMIZE)) < 0) return;
  if ((personality(0xffffffff) & ADDR_NO_RANDOMIZE) != 0) execv("/proc/self/exe", argv);
}

/// Returns only when it cannot be done.
void becomeNode(const ImportRequest& request) {
  const std::size_t megabytes = std::max<std::size_t>(request.memoryLimit >> 21, 256);
  const std::string heap = "--max-old-space-size=" + std::to_string(megabytes);
  const std::string first = std::to_string(request.firstProduct);
  unsetenv("NODE_OPTIONS");
  execl(request.program.c_str(), request.program.c_str(), heap.c_str(), request.script.c_str(),
        first.c_str(), nullptr);
  throw ImportError(request.program + " cannot be started: " + std::strerror(errno));
}

void answer(const ImportRequest& request) {
  sendProgress("open", 0);
  misbehaveIfAsked(request.task);
  switch (request.task) {
    case ImportTask::model:
      if (modelFormatOf(request.file) == ModelFormat::ifc) {
        return sendModel(importIfc(request, sendProgress));
      }
      return sendModel(modelByAssimp(request));
    case ImportTask::assimp:
      return sendModel(modelByAssimp(request));
    case ImportTask::webIfc:
      return becomeNode(request);
    case ImportTask::ifcPlusPlus:
      return sendShapesByIfcPlusPlus(readDescriptor(kIfcFile));
  }
}

}  // namespace

std::optional<int> runImportChild(int argc, char** argv) {
  if (argc < 2 || std::string_view(argv[1]) != kImportVerb) return std::nullopt;
  int parent = 0;
  const std::optional<ImportRequest> request = importRequestFrom(argc, argv, parent);
  if (!request) return 2;
  limitThisProcess(*request, parent);
  if (request->task == ImportTask::ifcPlusPlus) steadyAddresses(argv);
  int code = 1;
  try {
    answer(*request);
    code = 0;
  } catch (const std::bad_alloc&) {
    sendError(request->file + ": needs more than the " +
              std::to_string(request->memoryLimit >> 20) +
              " MiB of memory that an import may take; split the file or raise the limit");
  } catch (const std::exception& error) {
    // Readers of IFC leave the name to who asked them.
    const std::string text = error.what();
    const bool named = request->task != ImportTask::model || text.starts_with(request->file);
    sendError(named ? text : request->file + ": " + text);
  }
  _exit(code);
}

}  // namespace enfilade::scene
