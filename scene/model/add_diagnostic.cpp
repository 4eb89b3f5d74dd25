#include "scene/model/add_diagnostic.hpp"

#include <algorithm>

namespace enfilade::scene {

void addDiagnostic(std::vector<Diagnostic>& diagnostics, const std::string& kind,
                   const std::string& example, std::size_t count) {
  if (count == 0) return;
  const auto known = std::find_if(diagnostics.begin(), diagnostics.end(),
                                  [&](const Diagnostic& one) { return one.kind == kind; });
  if (known == diagnostics.end()) {
    diagnostics.push_back({kind, count, example});
  } else {
    known->count += count;
  }
}

}  // namespace enfilade::scene
