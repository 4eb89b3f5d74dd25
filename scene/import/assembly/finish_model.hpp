// Converts the imported nodes of a file to the objects of a Model: the last step of an import.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "scene/import/assembly/imported_node.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Converts imported nodes to objects with one transform each and appends their meshes. Drops far
/// objects and subtracts `offset`, or an offset near the median centre of the objects. The model's
/// materials must be complete. Throws ImportError, naming `file`, if no object remains.
void finishModel(std::vector<ImportedNode> importedNodes, std::vector<Mesh> meshes,
                 const std::filesystem::path& file, const std::optional<Vec3>& offset,
                 Model& model);

}  // namespace enfilade::scene
