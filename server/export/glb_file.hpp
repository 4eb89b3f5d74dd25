// Assembles a binary glTF 2.0 file: JSON and one buffer.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace enfilade::server {

using GlbJson = nlohmann::ordered_json;

/// The contents of a buffer view.
enum class GlbTarget : std::uint8_t { vertices, indices, other };

class GlbFile {
 public:
  GlbFile();

  /// The root of the JSON. addAccessor.. and addImage() append to its lists.
  GlbJson root;

  /// Adds numbers as SCALAR, VEC3 and so on. Returns the accessor's index.
  std::size_t addFloats(std::span<const float> numbers, const char* type, GlbTarget target);
  /// Like addFloats() with VEC3, and with the bounds that glTF requires of positions.
  std::size_t addPositions(std::span<const float> numbers);
  /// Adds colours of vertices: VEC4, 65535 is 1. Returns the accessor's index.
  std::size_t addColours(std::span<const std::uint16_t> numbers);
  /// Adds indices of a primitive with this number of vertices, in 16 bits if they suffice.
  std::size_t addIndices(std::span<const std::uint32_t> indices, std::size_t vertexCount);
  /// Adds an encoded image. Returns its index.
  std::size_t addImage(std::span<const std::uint8_t> bytes, const char* mimeType,
                       const std::string& name);
  /// Appends to a list of the root, such as "nodes". Returns the index.
  std::size_t add(const char* list, GlbJson value);

  /// The file's bytes. Throws std::runtime_error above 4 GiB, the limit of the format.
  std::vector<std::uint8_t> finish();

 private:
  std::size_t addView(const void* data, std::size_t bytes, GlbTarget target);

  std::vector<std::uint8_t> buffer_;
};

}  // namespace enfilade::server
