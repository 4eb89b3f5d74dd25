// Counts diagnostics by kind.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Adds `count` to the diagnostic of this kind; the first call with a count above 0 appends it with
/// its example.
void addDiagnostic(std::vector<Diagnostic>& diagnostics, const std::string& kind,
                   const std::string& example, std::size_t count = 1);

}  // namespace enfilade::scene
