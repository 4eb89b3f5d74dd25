// Who makes a Model of a file, to tell whether an earlier one would be made again today.
#pragma once

#include <string>

namespace enfilade::scene {

/// The versions of the libraries that read models, and this program as it was linked: whoever
/// changes a line of the importer has another program.
const std::string& readerVersions();

}  // namespace enfilade::scene
