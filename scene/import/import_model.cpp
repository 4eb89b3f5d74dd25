// The parent's side of an import: checks the file, starts the worker, receives its messages and
// turns every failure into an ImportError.
#include "scene/import/import_model.hpp"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>

#include "scene/import/file/model_format.hpp"
#include "scene/import/worker/model_stream.hpp"
#include "scene/import/worker/process.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

// ---- before the worker starts -------------------------------------------------------------------

std::string listExtensions() {
  std::string list;
  for (const std::string_view e : listImportableExtensions())
    list += (list.empty() ? "" : ", ") + std::string(e);
  return list;
}

void validateReadable(const fs::path& file) {
  const std::string name = file.string();
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) {
    const bool absent = !error || error == std::errc::no_such_file_or_directory ||
                        error == std::errc::not_a_directory;
    if (!absent)
      throw ImportError(name + ": cannot be read: " + error.message() +
                        "; check the path and its permissions");
    throw ImportError(name + ": no such file; check the path");
  }
  if (fs::is_directory(status)) {
    throw ImportError(name + ": is a folder; name the model file in it");
  }
  if (!fs::is_regular_file(status))
    throw ImportError(name + ": is not a regular file; copy it to one");
  const std::string extension = file.extension().string();
  if (!detectModelFormat(file)) {
    throw ImportError(name + ": unknown extension '" + extension +
                      "'; supported: " + listExtensions());
  }
  if (fs::file_size(file, error) == 0 && !error) {
    throw ImportError(name + ": is empty; export or copy it again");
  }
  if (access(file.c_str(), R_OK) != 0) {
    throw ImportError(name + ": cannot be read: " + std::strerror(errno) +
                      "; check its permissions");
  }
}

void validateOptions(const ImportOptions& options) {
  if (options.metresPerUnit &&
      !(*options.metresPerUnit > 0 && std::isfinite(*options.metresPerUnit))) {
    throw ImportError("metres per unit: must be a positive number");
  }
  if (options.offset && !options.offset->allFinite())
    throw ImportError("offset: must be three finite numbers");
}

// ---- messages -----------------------------------------------------------------------------------

/// Receives the messages of the import process.
class MessageListener {
 public:
  MessageListener(const fs::path& file, const ImportProgress& progress)
      : file_(file), progress_(progress) {}

  bool handle(ImportMessage kind, std::span<const std::byte> body) {
    switch (kind) {
      case ImportMessage::progress:
        return handleProgress(body);
      case ImportMessage::error:
        throw ImportError({reinterpret_cast<const char*>(body.data()), body.size()});
      case ImportMessage::model:
        return handleModel(body);
      default:
        return false;
    }
  }

  const std::string& stage() const { return stage_; }
  std::optional<Model>& model() { return model_; }

 private:
  bool handleProgress(std::span<const std::byte> body) {
    double fraction = 0;
    if (!readProgress(body, stage_, fraction)) return false;
    if (progress_) progress_(stage_, fraction);
    return true;
  }

  bool handleModel(std::span<const std::byte> body) {
    try {
      model_ = deserializeModel(body);
    } catch (const ModelStreamError& error) {
      throw ImportError(file_.string() + ": the import process sent invalid data during '" +
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
                              const ImportExit& outcome) {
  if (outcome.reason == ImportExit::Reason::timeLimit) {
    throw ImportError(request.file + ": not read within " +
                      formatShortest(request.options.timeLimit) + " s (stage '" + stage +
                      "'); simplify or split the file, re-export it as glTF, or allow more time");
  }
  std::string hint = "re-export it as glTF";
  if (detectModelFormat(request.file) == ModelFormat::ifc) {
    hint =
        "try another --ifc-reader, re-export it as IFC2x3 or glTF, or check the file with an IFC "
        "validator for references to entities that are missing";
  }
  throw ImportError(request.file + ": the import process " + outcome.describe() + " during '" +
                    stage + "'; " + hint);
}

}  // namespace

Model importModel(const fs::path& file, const ImportOptions& options,
                  const ImportProgress& progress) {
  validateOptions(options);
  validateReadable(file);
  ImportRequest request;
  request.file = file.string();
  request.options = options;
  MessageListener listener(file, progress);
  const ImportExit outcome = runImportProcess(
      request,
      [&](ImportMessage kind, std::span<const std::byte> body) {
        return listener.handle(kind, body);
      },
      [] { return std::numeric_limits<double>::infinity(); });
  if (!listener.model()) throwFailed(request, listener.stage(), outcome);
  Model model = std::move(*listener.model());
  model.source = file.string();
  return model;
}

}  // namespace enfilade::scene
