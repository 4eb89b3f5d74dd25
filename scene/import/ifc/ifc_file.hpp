// The text of an IFC file, out of its zip archive where it lies in one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace enfilade::scene {

/// `.ifc` as it is, `.ifczip` unpacked in memory; which of both is told by the first bytes. Throws
/// ImportError when it cannot be read, is no archive, holds none or several .ifc files, or would
/// unpack to more than `largest` bytes.
std::string readIfcFile(const std::filesystem::path& file, std::size_t largest);

}  // namespace enfilade::scene
