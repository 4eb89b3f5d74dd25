// The process that reads IFC with ifcplusplus (and its solid modeller carve): they crash and hang
// on some files, so it is one of its own.
#pragma once

#include <string>

namespace enfilade::scene {

/// Sends the shapes of all products of `text`. Throws std::exception when the file cannot be read.
void sendShapesByIfcPlusPlus(std::string text);

}  // namespace enfilade::scene
