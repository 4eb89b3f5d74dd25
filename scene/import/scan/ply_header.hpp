// The header of a PLY file (Turk 1994): elements with properties. Private to the import.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::scene {

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class PlyEncoding : std::uint8_t { ascii, littleEndian, bigEndian };

/// Bytes of one value in a binary file.
std::size_t getPlySize(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;
  std::optional<PlyType> countType;  ///< of a list: the type of its length
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  /// Bytes that one of them takes at least. In text, a value takes a digit and a separator.
  std::size_t computeMinSize(PlyEncoding encoding) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::string textureFile;  ///< of a comment "TextureFile"; empty: none
  std::size_t size = 0;     ///< bytes, with the end of its last line
};

/// Parses the header at the start of `bytes`. Throws ImportError without the file's name.
PlyHeader parsePlyHeader(std::string_view bytes);

}  // namespace enfilade::scene
