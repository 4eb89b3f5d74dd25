// What stands in place of a glTF mesh whose data cannot be read. Private to the import.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/gltf/encoding/gltf_binary.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Returns a solid box of the extent that the positions of a primitive state, so that no avatar
/// walks through it; null without a valid extent. Reports which, with `fault` as the reason.
/// `accessors`: of the file.
nlohmann::json replaceUnreadable(const nlohmann::json& primitive, const nlohmann::json& accessors,
                                 const std::string& fault, GltfBinary& binary,
                                 std::vector<Diagnostic>& problems);

}  // namespace enfilade::scene
