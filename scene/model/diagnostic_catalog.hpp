// Catalog of diagnostics: the severity and meaning of each kind, and its remedy.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

enum class Severity : std::uint8_t {
  note,     ///< information, or a repair that changes neither what is drawn nor what is solid
  warning,  ///< the scene is as the file says, but the file is doubtful or drawn differently
  error     ///< content of the file is missing, or its shape may be wrong
};

const char* toString(Severity severity);

struct DiagnosticKind {
  std::string_view name;  ///< Diagnostic::kind
  Severity severity = Severity::warning;
  std::string_view meaning;  ///< for people: the finding and, where possible, the remedy
};

/// The names of all kinds.
std::vector<std::string_view> listDiagnosticKinds();

/// Looks up the kind of `diagnostic`; an unknown kind is a warning without a meaning.
DiagnosticKind findDiagnosticKind(const Diagnostic& diagnostic);

}  // namespace enfilade::scene
