// Reads the JSON of a glTF or GLB file, with limits on its nesting, and accesses its members.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// Levels of nodes that importers follow; more means a broken or malicious file.
inline constexpr int kMaxNodeDepth = 2000;

/// Throws ImportError for nodes that are nested deeper. `file`: its name and ": ", or "".
[[noreturn]] void refuseDeepNodes(const std::string& file);

/// Levels of JSON that importers follow: copies and dumps of more would need much stack.
inline constexpr int kMaxJsonDepth = 512;

inline constexpr std::size_t kNoIndex = ~std::size_t{0};  ///< in place of a member that is missing

/// The JSON text of a glTF or GLB file. Throws ImportError if a GLB file is too short for it.
std::string readGltfJson(const std::filesystem::path& file, ModelFormat format);

inline constexpr std::size_t kGlbHeader = 20;      // bytes: of the file and of its first chunk
inline constexpr std::size_t kGlbChunkHeader = 8;  // bytes: length and type

/// The second chunk of a GLB file, its first buffer.
struct GlbBinary {
  std::size_t chunkAt = 0;  ///< offset of its header in the file
  std::size_t size = 0;     ///< bytes after the header; 0 if it is missing or cut off
};
GlbBinary findGlbBinary(const std::filesystem::path& file);

/// Whether the text contains the words. Several times as fast as std::string::find if the text has
/// many characters like the first of them, as JSON has quotes.
bool mentions(const std::string& text, std::string_view words);

/// Returns the member of an object; null if the member is missing, or if `json` is null or no
/// object.
const nlohmann::json* findMember(const nlohmann::json* json, const char* key);
/// Returns a member that is an array; an empty array in place of anything else.
const nlohmann::json& getArray(const nlohmann::json& json, const char* key);
/// Returns the entry of an array at an index; null if `index` is null, no number or too large.
const nlohmann::json* findEntry(const nlohmann::json& array, const nlohmann::json* index);
/// Returns a member that is a number of an entry; nullopt for anything else.
std::optional<std::size_t> readIndexMember(const nlohmann::json* json, const char* key);

}  // namespace enfilade::scene
