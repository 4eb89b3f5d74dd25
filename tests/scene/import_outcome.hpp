// What an import reports: its diagnostics, or its error.
#pragma once

#include <filesystem>
#include <string>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {

/// 0 without a diagnostic of this kind.
inline std::size_t countOf(const Model& model, const std::string& kind) {
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

/// The error message of importing `file`; "" if the import succeeds.
inline std::string failureOf(const std::filesystem::path& file, const ImportOptions& options = {}) {
  try {
    importModel(file, options);
  } catch (const ImportError& error) {
    return error.what();
  }
  return "";
}

}  // namespace enfilade::scene
