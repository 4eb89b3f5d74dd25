// Where Node.js and the script with web-ifc are. Both are optional.
#pragma once

#include <string>

namespace enfilade::scene {

struct WebIfcPlace {
  std::string node, script;  ///< paths; empty: not there
  std::string missing;       ///< what is not there and how to get it; empty: all is there
};

/// The script's folder: $ENFILADE_WEB_IFC, else share/enfilade/web_ifc beside the program's bin/,
/// else the source folder that the program was built from. Node is looked for in PATH.
WebIfcPlace findWebIfc();

}  // namespace enfilade::scene
