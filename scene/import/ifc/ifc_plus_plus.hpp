// The process that reads IFC with ifcplusplus (and its solid modeller carve): they crash and hang
// on some files, so it is one of its own. The library is as slow to link at run time as many a
// scene to load, so it stands behind a module that this process alone opens.
#pragma once

#include <filesystem>
#include <string>

namespace enfilade::scene {

/// Where the module is: named by ENFILADE_IFC_PLUS_PLUS, beside the program, where it is installed,
/// or where it was built.
std::filesystem::path ifcPlusPlusModule();

/// Sends the shapes of all products of `text`. Throws std::exception when the file cannot be read,
/// or the module not opened.
void sendShapesByIfcPlusPlus(std::string text);

/// What the module exports, by the name kSendShapes. Whoever changes this or how shapes pass
/// through the pipe gives it another number, so that no program opens a module that is not its own.
using SendShapes = void(std::string& text);
inline constexpr const char* kSendShapes = "enfiladeSendShapes1";

}  // namespace enfilade::scene
