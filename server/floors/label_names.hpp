// Makes readable labels of objects for pictures, from their paths.
#pragma once

#include <string>

namespace enfilade::server {

/// The name of the thing that the path of an object names, without GlobalIds and numbers that
/// programs append. It is the last part that is not the word for a piece ("frame", "mesh_3").
std::string makeLabelName(const std::string& path);

/// A name up to the GlobalId that an IFC reader appended.
std::string removeGlobalId(const std::string& name);

}  // namespace enfilade::server
