// The report of an import: its diagnostics, or its error.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {

/// 0 without a diagnostic of this kind.
inline std::size_t countDiagnostics(const Model& model, const std::string& kind) {
  for (const Diagnostic& problem : model.diagnostics)
    if (problem.kind == kind) return problem.count;
  return 0;
}

/// "" without a diagnostic of this kind.
inline std::string diagnosticText(const Model& model, const std::string& kind) {
  for (const Diagnostic& problem : model.diagnostics)
    if (problem.kind == kind) return problem.example;
  return "";
}

/// The first object of an IFC class. Throws std::runtime_error without one.
inline const Object& objectOfClass(const Model& model, const std::string& ifcClass) {
  for (const Object& object : model.objects)
    if (object.ifcClass == ifcClass) return object;
  throw std::runtime_error("no " + ifcClass);
}

/// The error message of importing `file`; "" if the import succeeds.
inline std::string catchFailure(const std::filesystem::path& file,
                                const ImportOptions& options = {}) {
  try {
    importModel(file, options);
  } catch (const ImportError& error) {
    return error.what();
  }
  return "";
}

}  // namespace enfilade::scene
