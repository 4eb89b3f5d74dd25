// The mesh that replaces a glTF mesh whose data cannot be read. Private to the import.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/gltf/encoding/gltf_binary.hpp"
#include "scene/import/gltf/gltf_rest_pose.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

struct UnreadableMesh {
  const nlohmann::json& primitive;
  const RestPose* pose;  ///< null: none
  std::string fault;     ///< why the primitive cannot be read
};

/// Returns a solid box of the extent that the positions of a primitive state, in its rest pose, so
/// that no avatar walks through it. Null without a valid extent. Reports which. `accessors`: of the
/// file.
nlohmann::json replaceUnreadable(const UnreadableMesh& mesh, const nlohmann::json& accessors,
                                 GltfBuffers& buffers, GltfBinary& binary,
                                 std::vector<Diagnostic>& problems);

}  // namespace enfilade::scene
