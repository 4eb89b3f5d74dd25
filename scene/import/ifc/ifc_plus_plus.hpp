// Reads IFC with ifcplusplus and its solid modeller carve. They crash or hang on some files, so
// they run in their own process. Linking the library at run time is slow, so only that process
// opens the module that contains it.
#pragma once

#include <filesystem>
#include <string>

namespace enfilade::scene {

/// Path of the module: $ENFILADE_IFC_PLUS_PLUS, otherwise next to the program, in the install
/// folder or in the build folder.
std::filesystem::path findIfcPlusPlusModule();

/// Sends the meshes of all products of `text`. Throws std::exception if the file cannot be read or
/// the module cannot be opened.
void sendMeshesWithIfcPlusPlus(std::string text);

/// The module's exported function; its symbol is kSendMeshesSymbol. Increase the number in the
/// symbol whenever this signature or the wire format changes: a program then rejects old modules.
using SendMeshesFunction = void(std::string& text);
inline constexpr const char* kSendMeshesSymbol = "enfiladeSendMeshes2";

}  // namespace enfilade::scene
