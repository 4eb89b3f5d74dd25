// Names of objects for people, in pictures.
#pragma once

#include <string>

namespace enfilade::server {

/// The name of the thing that the path of an object names: the last part of the path that is not
/// the word for a piece ("frame", "mesh_3"), without GlobalIds and numbers that programs append.
std::string makeLabelName(const std::string& path);

}  // namespace enfilade::server
