// Catalog of diagnostics: the meaning of each kind, and its remedy.
#pragma once

#include <string_view>

#include "scene/model/model.hpp"

namespace enfilade::scene {

struct DiagnosticKind {
  std::string_view name;     ///< Diagnostic::kind
  bool isNote = false;       ///< information only: nothing is wrong
  std::string_view meaning;  ///< for people: the finding and, where possible, the remedy
};

/// Looks up the kind of `diagnostic`; for an unknown kind the meaning is empty.
DiagnosticKind findDiagnosticKind(const Diagnostic& diagnostic);

}  // namespace enfilade::scene
