// The report of an import: its diagnostics, or its error.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::scene {

/// 0 without a diagnostic of this kind.
inline std::size_t countDiagnostics(const Model& model, const std::string& kind) {
  for (const Diagnostic& problem : model.diagnostics)
    if (problem.kind == kind) return problem.count;
  return 0;
}

/// "" without a diagnostic of this kind.
inline std::string findDiagnosticText(const Model& model, const std::string& kind) {
  for (const Diagnostic& problem : model.diagnostics)
    if (problem.kind == kind) return problem.example;
  return "";
}

/// The first object of an IFC class. Throws std::runtime_error without one.
inline const Object& findObjectOfClass(const Model& model, const std::string& ifcClass) {
  for (const Object& object : model.objects)
    if (object.ifcClass == ifcClass) return object;
  throw std::runtime_error("no " + ifcClass);
}

/// The size of the model's box, metres.
inline void expectSize(const Model& model, const Vec3& size, double tolerance) {
  const Scene scene{Model(model)};
  EXPECT_LT((scene.bounds().size() - size).norm(), tolerance) << scene.bounds().size().transpose();
}

/// `text` with `from` replaced by `to` at its first place; it must be in it.
inline std::string replaceFirst(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from << " is not in the text";
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
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
