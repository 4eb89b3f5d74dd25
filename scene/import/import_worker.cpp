#include "scene/import/import_worker.hpp"

#include <malloc.h>
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

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/assimp/convert_scene.hpp"
#include "scene/import/assimp/obj_text.hpp"
#include "scene/import/bodies/gltf_bodies.hpp"
#include "scene/import/file_metadata.hpp"
#include "scene/import/gltf/plain_gltf.hpp"
#include "scene/import/ifc/ifc_plus_plus.hpp"
#include "scene/import/ifc/import_ifc.hpp"
#include "scene/import/scan/import_scan.hpp"
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

/// Limits the process: no core files, bounded memory, and death with the parent.
void limitThisProcess(const ImportRequest& request, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // it died before the call above
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  // Only the soft limit: Node.js may be started from here. It reserves tens of gigabytes of address
  // space, so its written data is limited instead. Sanitizers reserve as much.
  const bool node = request.task == ImportTask::webIfc || request.task == ImportTask::ifcXml;
  rlimit memory{};
  getrlimit(RLIMIT_AS, &memory);
  const bool limited = request.options.memoryLimit > 0 && !kSanitized;
  memory.rlim_cur = limited && !node ? request.options.memoryLimit : memory.rlim_max;
  setrlimit(RLIMIT_AS, &memory);
  const rlimit data{request.options.memoryLimit, request.options.memoryLimit};
  if (node && request.options.memoryLimit > 0) setrlimit(RLIMIT_DATA, &data);
}

/// glibc consolidates all small freed blocks of its fast bins at each large allocation. A file may
/// free millions.
void disableFastBins() {
  mallopt(M_MXFAST, 0);
}

/// Prefix in ENFILADE_IMPORT_FAULT that selects this task, with the colon.
std::string_view getFaultPrefix(ImportTask task) {
  switch (task) {
    case ImportTask::model:
      return "";
    case ImportTask::assimp:
      return "assimp:";
    case ImportTask::webIfc:
      return "web-ifc:";
    case ImportTask::ifcPlusPlus:
      return "ifcplusplus:";
    case ImportTask::ifcXml:
      return "ifcxml:";
  }
  return "";
}

/// Injects the fault of ENFILADE_IMPORT_FAULT; see import_worker.hpp.
void injectFault(ImportTask task) {
  const char* wanted = std::getenv("ENFILADE_IMPORT_FAULT");
  std::string_view fault = wanted == nullptr ? "" : wanted;
  if (!fault.starts_with(getFaultPrefix(task))) return;
  fault.remove_prefix(getFaultPrefix(task).size());
  if (fault == "hang") pause();
  if (fault == "crash") {
    signal(SIGSEGV, SIG_DFL);
    raise(SIGSEGV);
  }
  if (fault == "exit") _exit(0);
  if (fault == "memory") throw std::bad_alloc();
  if (fault == "garbage") {
    const std::string noise(1000, 'x');
    sendMessage(ImportMessage::model, noise.data(), noise.size());
    _exit(0);
  }
}

/// Counts missing material files. OBJ keeps materials in separate files, which are often lost when
/// models are passed on.
void reportMissingMaterials(const std::vector<std::string>& files,
                            std::vector<Diagnostic>& problems) {
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
    if (size <= 0) throw ImportError("the file cannot be read from memory");
    done += static_cast<std::size_t>(size);
  }
  return text;
}

[[noreturn]] void throwReadFailure(const ConvertInput& input, const std::string& reason) {
  if (reason.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
  if (input.format == ModelFormat::ifc)
    throw ImportError(reason);  // other readers may have tried too
  throw ImportError(input.file.string() + ": cannot be read: " + reason +
                    "; check the file in the program that wrote it, or re-export it as glTF");
}

bool isGltf(ModelFormat format) {
  return format == ModelFormat::gltf || format == ModelFormat::glb;
}

/// Passes a glTF file through the pre-pass. `rewrite`: also if its data seem plain. Returns whether
/// it was rewritten; then `dependencies` gets the files of its data.
bool prepareGltf(ConvertInput& input, AssimpInput& file, bool rewrite,
                 std::vector<std::string>& dependencies) {
  PlainGltf plain = makePlainGltf(
      input.file, input.format, {input.options.gltfScene, rewrite, input.options.ignoreAppearance});
  input.metadata.triangles = plain.triangles;
  input.metadata.scenes = std::move(plain.scenes);
  input.metadata.scene = plain.scene;
  input.metadata.problems = std::move(plain.problems);
  // The text may have hundreds of megabytes.
  input.gltfJson = mayHaveGltfBodies(plain.json) ? std::move(plain.json) : std::string();
  plain.json = {};
  GltfMeshFile meshes = takeMeshFile(plain, input.file, input.format);
  file.text = std::move(meshes.start);
  file.restAt = meshes.restAt;
  file.restBytes = meshes.restBytes;
  input.gltfNodes = std::move(plain.tree);
  input.gltfMeshes = std::move(plain.meshes);
  // assimp recognises GLB files by their extension.
  if (plain.isRewritten && input.format == ModelFormat::gltf) file.file += ".glb";
  dependencies = std::move(plain.dependencies);
  return plain.isRewritten;
}

Model importByAssimp(const ImportRequest& request) {
  ConvertInput input;
  input.file = request.file;
  input.format = detectModelFormat(request.file).value();  // checked by the parent
  input.options = request.options;
  AssimpInput file;
  file.file = request.file;
  file.isIfc = request.task == ImportTask::assimp;
  std::vector<std::string> dependencies;
  bool isRewritten = false;
  if (file.isIfc) {
    file.text = readDescriptor(kIfcFile);
    input.metadata = readIfcFileMetadata(file.text);
  } else {
    input.metadata =
        readFileMetadata(request.file, input.format, computeMaxTextBytes(request.options));
    if (input.format == ModelFormat::collada)
      file.text = repairCollada(request.file, input.metadata);
    // assimp unzips .zae by itself; a repaired document is no longer in its archive.
    if (!file.text.empty() && input.format == ModelFormat::collada) file.file += ".dae";
    if (input.format == ModelFormat::obj) {
      const double unit = request.options.metresPerUnit.value_or(input.metadata.metresPerUnit);
      RebasedText rebased = rebaseObj(request.file, kMaxPreciseDistance / unit);
      file.text = std::move(rebased.text);
      input.shift = rebased.shift;
    }
    if (isGltf(input.format)) isRewritten = prepareGltf(input, file, false, dependencies);
  }
  sendProgress("parse", 0);
  AssimpOutput read = readWithAssimp(file);
  if (read.scene == nullptr && isGltf(input.format) && !isRewritten) {
    // One damaged mesh fails the whole file; the pre-pass replaces it.
    prepareGltf(input, file, true, dependencies);
    read = readWithAssimp(file);
  }
  if (read.scene == nullptr) throwReadFailure(input, read.failure);
  input.joined = read.joined;
  Model model = convertScene(*read.scene, read.materials, input, sendProgress);
  reportMissingMaterials(read.dependencies, model.diagnostics);
  dependencies.insert(dependencies.end(), read.dependencies.begin(), read.dependencies.end());
  model.dependencies.insert(model.dependencies.end(), dependencies.begin(), dependencies.end());
  model.dependencies.push_back(read.library);
  return model;
}

Model importByFormat(const ImportRequest& request) {
  const ModelFormat format = detectModelFormat(request.file).value();
  if (request.options.georeference && format != ModelFormat::ifc)
    throw ImportError(request.file +
                      ": --georeference needs an IFC file: no other format has a map");
  if (!request.options.gltfScene.empty() && !isGltf(format))
    throw ImportError(request.file +
                      ": --gltf-scene needs a glTF file: no other format has scenes");
  switch (format) {
    case ModelFormat::ifc:
      return importIfc(request, sendProgress);
    case ModelFormat::ply:
    case ModelFormat::stl:
      return importScan(request.file, format, request.options, sendProgress);
    case ModelFormat::gltf:
    case ModelFormat::glb:
    case ModelFormat::obj:
    case ModelFormat::collada:
    case ModelFormat::fbx:
      break;
  }
  return importByAssimp(request);
}

void sendModel(const Model& model) {
  sendProgress("send", 0);
  const std::uint64_t size = measureModelStream(model);
  beginMessage(ImportMessage::model, size);
  writeModelStream(model, size, [](std::span<const std::byte> block) {
    continueMessage(block.data(), block.size());
  });
}

/// Restarts this program in the same process without address randomisation, because ifcplusplus'
/// results depend on it. If that is not allowed, results vary.
void disableAslr(char** argv) {
  const int now = personality(0xffffffff);
  if (now < 0 || (now & ADDR_NO_RANDOMIZE) != 0) return;
  if (personality(static_cast<unsigned long>(now | ADDR_NO_RANDOMIZE)) < 0) return;
  if ((personality(0xffffffff) & ADDR_NO_RANDOMIZE) != 0) execv("/proc/self/exe", argv);
}

/// Replaces this process with Node.js. Returns only by an exception.
void execNode(const ImportRequest& request) {
  const std::size_t megabytes = std::max<std::size_t>(request.options.memoryLimit >> 21, 256);
  const std::string heap = "--max-old-space-size=" + std::to_string(megabytes);
  const std::string first = std::to_string(request.firstProduct);
  unsetenv("NODE_OPTIONS");
  execl(request.program.c_str(), request.program.c_str(), heap.c_str(), request.script.c_str(),
        first.c_str(), nullptr);
  throw ImportError(request.program + " cannot be started: " + std::strerror(errno));
}

void runTask(const ImportRequest& request) {
  sendProgress("open", 0);
  injectFault(request.task);
  switch (request.task) {
    case ImportTask::model:
      return sendModel(importByFormat(request));
    case ImportTask::assimp:
      return sendModel(importByAssimp(request));
    case ImportTask::webIfc:
    case ImportTask::ifcXml:
      return execNode(request);
    case ImportTask::ifcPlusPlus:
      return sendMeshesWithIfcPlusPlus(readDescriptor(kIfcFile));
  }
}

}  // namespace

std::optional<int> runImportWorker(int argc, char** argv) {
  if (argc < 2 || std::string_view(argv[1]) != kImportVerb) return std::nullopt;
  int parent = 0;
  const std::optional<ImportRequest> request = parseImportRequest(argc, argv, parent);
  if (!request) return 2;
  limitThisProcess(*request, parent);
  disableFastBins();
  if (request->task == ImportTask::ifcPlusPlus) disableAslr(argv);
  int code = 1;
  try {
    runTask(*request);
    code = 0;
  } catch (const std::bad_alloc&) {
    sendError(request->file + ": needs more than the " +
              std::to_string(request->options.memoryLimit >> 20) +
              " MiB of memory that an import may take; split the file or raise the limit");
  } catch (const std::exception& error) {
    // IFC readers omit the file's name; their parent adds it.
    const std::string text = error.what();
    const bool named = request->task != ImportTask::model || text.starts_with(request->file);
    sendError(named ? text : request->file + ": " + text);
  }
  _exit(code);
}

}  // namespace enfilade::scene
