// The glTF extensions that the import reads, those that it may leave out, and those that it
// refuses. Private to the import.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Collects the names of the extensions that a file uses from the keys of its JSON: exporters
/// forget to list them. Keys below "extras" are the exporter's own. KHR_node_visibility counts only
/// where it hides a node: visible is the default.
class ExtensionNames {
 public:
  /// Call it for each key of the file in order; those of the file's own object have depth 1.
  void seeKey(int depth, const std::string& key);
  /// Call it for each value that is no container, after its key.
  void seeValue(const nlohmann::json& value);
  const std::set<std::string>& names() const { return names_; }

 private:
  std::vector<int> open_;          ///< depths of the keys "extensions" whose objects are being read
  std::optional<int> extras_;      ///< depth of the key "extras" whose value is being read
  std::optional<int> visibility_;  ///< depth of the key KHR_node_visibility
  bool isVisible_ = false;         ///< whether the last key is its "visible"
  std::set<std::string> names_;
};

/// Throws ImportError for a required extension that is not read. One that changes the appearance
/// alone is reported (`ignored_appearance`) if `ignoreAppearance`. Optional ones, listed or not,
/// are reported if they could change shapes (`ignored_extension`).
std::vector<Diagnostic> checkGltfExtensions(const nlohmann::json& gltf, const ExtensionNames& inUse,
                                            const std::filesystem::path& file,
                                            bool ignoreAppearance);

}  // namespace enfilade::scene
