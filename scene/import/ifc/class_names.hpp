// Product classes of IFC2x3, IFC4 and IFC4x3 in the standard's spelling; files use capitals only.
#pragma once

#include <string>
#include <string_view>

namespace enfilade::scene {

/// Converts "IFCWALLSTANDARDCASE" to "IfcWallStandardCase".
std::string formatIfcClassName(std::string_view type);

}  // namespace enfilade::scene
