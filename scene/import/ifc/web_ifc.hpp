// Locates Node.js and the web-ifc script. Both are optional.
#pragma once

#include <string>

namespace enfilade::scene {

/// Paths of Node.js and the script.
struct WebIfcLocation {
  std::string node, script;  ///< empty: not found
  std::string missing;       ///< the missing component and how to install it; empty: complete
};

/// Searches for Node.js in PATH. The script's folder is $ENFILADE_WEB_IFC, otherwise
/// share/enfilade/web_ifc next to the program's bin/, otherwise the source folder of the build.
WebIfcLocation findWebIfc();

}  // namespace enfilade::scene
