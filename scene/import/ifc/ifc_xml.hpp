// Converts ifcXML of IFC4 to STEP text, in a process of Node.js.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "scene/import/worker/process.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether the text of a file is XML, in UTF-8 or UTF-16.
bool isXml(std::string_view text);

/// Limits of a conversion.
struct IfcXmlLimits {
  std::size_t maxBytes = 0;  ///< of the STEP text
  double timeLimit = 0;      ///< seconds
};

/// Returns the STEP text of an ifcXML document, and adds what it does not contain to `diagnostics`
/// (`xml_not_read`, `xml_value_ignored`, `xml_reference_missing`). Throws ImportError with the
/// line: damaged XML, a document type, another dialect than that of IFC4. Throws ImportError
/// without Node.js and its packages.
std::string convertIfcXml(const ImportRequest& request, const std::string& xml,
                          const IfcXmlLimits& limits, const ImportProgress& progress,
                          std::vector<Diagnostic>& diagnostics);

}  // namespace enfilade::scene
