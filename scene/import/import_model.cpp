// The asking side of an import: looks at the file, starts the child, listens to it, and turns every
// way in which it can fail into an ImportError.
#include "scene/import/import_model.hpp"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "scene/import/file_metadata.hpp"
#include "scene/import/worker/model_stream.hpp"
#include "scene/import/worker/process.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 7> kExtensions{".gltf", ".glb", ".obj",   ".dae",
                                                      ".fbx",  ".ifc", ".ifczip"};

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
    const bool absent = !error || error == std::errc::no_such_file_or_directory ||
                        error == std::errc::not_a_directory;
    if (!absent)
      throw ImportError(name + ": cannot be read: " + error.message() +
                        "; check the path and its permissions (open)");
    throw ImportError(name + ": no such file; check the path (open)");
  }
  if (fs::is_directory(status)) {
    throw ImportError(name + ": is a folder; name the model file in it (open)");
  }
  if (!fs::is_regular_file(status)) throw ImportError(name + ": is not a regular file (open)");
  const std::string extension = file.extension().string();
  if (!modelFormatOf(file)) {
    throw ImportError(name + ": unknown extension '" + extension + "'; known are " +
                      knownExtensions() + " (open)");
  }
  if (fs::file_size(file, error) == 0 && !error) {
    throw ImportError(name + ": is empty; export or copy it again (open)");
  }
  if (access(file.c_str(), R_OK) != 0) {
    throw ImportError(name + ": cannot be read: " + std::strerror(errno) +
                      "; check its permissions (open)");
  }
}

void requireSaneOptions(const ImportOptions& options) {
  if (options.metresPerUnit &&
      !(*options.metresPerUnit > 0 && std::isfinite(*options.metresPerUnit))) {
    throw ImportError("metres per unit: must be a positive number");
  }
  if (options.offset && !options.offset->allFinite())
    throw ImportError("offset: must be three finite numbers");
  if (options.up && (*options.up < 'x' || *options.up > 'z')) {
    throw ImportError(std::string("up axis: '") + *options.up + "' is neither x, y nor z");
  }
}

// ---- listening ----------------------------------------------------------------------------------

/// What the import process has told so far.
class Listener {
 public:
  Listener(const fs::path& file, const ImportProgress& progress)
      : file_(file), progress_(progress) {}

  bool take(ImportFrame kind, std::span<const std::byte> body) {
    switch (kind) {
      case ImportFrame::progress:
        return showProgress(body);
      case ImportFrame::error:
        throw ImportError({reinterpret_cast<const char*>(body.data()), body.size()});
      case ImportFrame::model:
        return readModel(body);
      default:
        return false;
    }
  }

  const std::string& stage() const { return stage_; }
  std::optional<Model>& model() { return model_; }

 private:
  bool showProgress(std::span<const std::byte> body) {
    double fraction = 0;
    if (!readProgress(body, stage_, fraction)) return false;
    if (progress_) progress_(stage_, fraction);
    return true;
  }

  bool readModel(std::span<const std::byte> body) {
    try {
      model_ = deserialiseModel(body);
    } catch (const ModelStreamError& error) {
      throw ImportError(file_.string() + ": the import process answered with noise during '" +
                        stage_ + "' (" + error.what() + "); re-export the file as glTF");
    }
    return true;
  }

  const fs::path& file_;
  const ImportProgress& progress_;
  std::string stage_ = "start";
  std::optional<Model> model_;
};

[[noreturn]] void throwFailed(const ImportRequest& request, const std::string& stage,
                              const ImportEnd& end) {
  if (end.how == ImportEnd::How::timeLimit) {
    throw ImportError(request.file + ": not read within " + shortest(request.timeLimit) +
                      " s (stage '" + stage +
                      "'); simplify or split the file, re-export it as glTF, or allow more time");
  }
  std::string hint = "re-export it as glTF";
  if (modelFormatOf(request.file) == ModelFormat::ifc) {
    hint =
        "try another --ifc-reader, re-export it as IFC2x3 or glTF, or check the file with an IFC "
        "validator for references to entities that are missing";
  }
  throw ImportError(request.file + ": the import process " + end.words() + " during '" + stage +
                    "'; " + hint);
}

}  // namespace

std::span<const std::string_view> importableExtensions() {
  return kExtensions;
}

Model importModel(const fs::path& file, const ImportOptions& options,
                  const ImportProgress& progress) {
  requireSaneOptions(options);
  requireReadableModel(file);
  ImportRequest request;
  request.file = file.string();
  request.metresPerUnit = options.metresPerUnit;
  request.up = options.up;
  request.offset = options.offset;
  request.ifcReader = options.ifcReader;
  request.memoryLimit = options.memoryLimit;
  request.timeLimit = options.timeLimit;
  Listener listener(file, progress);
  const ImportEnd end = runImportProcess(
      request,
      [&](ImportFrame kind, std::span<const std::byte> body) { return listener.take(kind, body); },
      [] { return std::numeric_limits<double>::infinity(); });
  if (!listener.model()) throwFailed(request, listener.stage(), end);
  Model model = std::move(*listener.model());
  model.source = file.string();
  return model;
}

std::optional<IfcReader> ifcReaderFrom(const std::string& text) {
  static const std::map<std::string, IfcReader> kReaders{{"auto", IfcReader::automatic},
                                                         {"web-ifc", IfcReader::webIfc},
                                                         {"ifcplusplus", IfcReader::ifcPlusPlus},
                                                         {"assimp", IfcReader::assimp}};
  const auto reader = kReaders.find(text);
  return reader == kReaders.end() ? std::nullopt : std::optional(reader->second);
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
