// Import worker: the part of an import that runs in copies of this executable. Each reader has its
// own process and cannot harm the program that requested the import.
#pragma once

#include <optional>

namespace enfilade::scene {

/// Entry point of the import worker. Every program that imports calls this first in main().
/// importModel() restarts the program with hidden arguments, and that worker reads the file.
/// Returns the worker's exit code, or nullopt if the arguments are not the hidden ones.
///
/// For tests, the environment variable ENFILADE_IMPORT_FAULT injects a fault into the worker. The
/// fault is `hang`, `crash`, `exit` (without an answer), `memory` (exceeds the limit) or `garbage`
/// (an invalid answer). A prefix as in `web-ifc:hang` selects the worker of one IFC reader:
/// web-ifc, ifcplusplus or assimp.
std::optional<int> runImportWorker(int argc, char** argv);

}  // namespace enfilade::scene
