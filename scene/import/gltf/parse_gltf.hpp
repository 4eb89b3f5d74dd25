// Parses the JSON of a glTF file for all checks of the pre-pass and for its nodes. Private to the
// import.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/gltf/encoding/duplicate_keys.hpp"
#include "scene/import/gltf/encoding/gltf_nodes.hpp"
#include "scene/import/gltf/gltf_extensions.hpp"

namespace enfilade::scene {

/// Throws ImportError with the file's name, a fault such as "is damaged" and a remedy.
[[noreturn]] void failJson(const std::filesystem::path& file, const std::string& fault);

/// The parts of a file's JSON that are kept.
struct ParsedGltf {
  nlohmann::json sections;  ///< an object of those that the pre-pass needs, without the nodes
  ExtensionNames extensions;
  DuplicateKeys duplicates;
  std::vector<PlainNode> nodes;  ///< there may be a million, so their JSON is not kept
  bool hasWrongNodes = false;    ///< the nodes are no list; an object in glTF 1.0
};

/// Throws ImportError for JSON that is damaged, is no object, has a number that is too large, or is
/// nested deeper than kMaxJsonDepth.
ParsedGltf parseGltf(const std::string& text, const std::filesystem::path& file);

}  // namespace enfilade::scene
