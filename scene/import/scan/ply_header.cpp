#include "scene/import/scan/ply_header.hpp"

#include <array>
#include <charconv>

#include "scene/import/file/import_options.hpp"
#include "scene/import/scan/scan_bytes.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kMaxPlyHeader = 1 << 20;  // bytes; real ones have some hundreds
constexpr std::size_t kMaxPlyProperties = 1000;

[[noreturn]] void failHeader(const std::string& message) {
  throw ImportError("PLY header: " + message + "; export it again");
}

std::optional<PlyType> parsePlyType(std::string_view name) {
  struct Name {
    std::string_view old, sized;
  };
  // In the order of PlyType.
  static constexpr std::array<Name, 8> kNames{{{"char", "int8"},
                                               {"uchar", "uint8"},
                                               {"short", "int16"},
                                               {"ushort", "uint16"},
                                               {"int", "int32"},
                                               {"uint", "uint32"},
                                               {"float", "float32"},
                                               {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i].old || name == kNames[i].sized) return static_cast<PlyType>(i);
  return std::nullopt;
}

PlyType requirePlyType(std::string_view name) {
  const auto type = parsePlyType(name);
  if (!type) failHeader("unknown type '" + std::string(name.substr(0, 40)) + "'");
  return *type;
}

PlyEncoding parsePlyEncoding(std::string_view name) {
  if (name == "ascii") return PlyEncoding::ascii;
  if (name == "binary_little_endian") return PlyEncoding::littleEndian;
  if (name == "binary_big_endian") return PlyEncoding::bigEndian;
  failHeader("unknown format '" + std::string(name.substr(0, 40)) + "'");
}

PlyElement parsePlyElement(TextCursor& words) {
  PlyElement element;
  element.name = words.readWord();
  const std::string_view count = words.readWord();
  const auto [end, error] =
      std::from_chars(count.data(), count.data() + count.size(), element.count);
  if (error != std::errc() || end != count.data() + count.size())
    failHeader("element " + element.name + " has no valid count");
  return element;
}

PlyProperty parsePlyProperty(TextCursor& words) {
  PlyProperty property;
  std::string_view type = words.readWord();
  if (type == "list") {
    property.countType = requirePlyType(words.readWord());
    type = words.readWord();
  }
  property.type = requirePlyType(type);
  property.name = words.readWord();
  return property;
}

/// '\n', also behind '\r'; '\r' alone in files of old programs.
char findLineEnd(std::string_view text) {
  const std::size_t first = text.find_first_of("\r\n");
  const bool alone = first < text.size() && text[first] == '\r' && text.substr(first, 2) != "\r\n";
  return alone ? '\r' : '\n';
}

}  // namespace

std::size_t getPlySize(PlyType type) {
  static constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::size_t PlyElement::computeMinSize(PlyEncoding encoding) const {
  std::size_t size = 0;
  for (const PlyProperty& property : properties)
    size +=
        encoding == PlyEncoding::ascii ? 2 : getPlySize(property.countType.value_or(property.type));
  return size;
}

PlyHeader parsePlyHeader(std::string_view bytes) {
  const std::string_view start = bytes.substr(0, kMaxPlyHeader);
  TextCursor lines(start);
  const char lineEnd = findLineEnd(start);
  if (lines.readLine(lineEnd) != "ply") failHeader("the file does not begin with 'ply'");
  PlyHeader header;
  bool hasFormat = false;
  while (lines.remaining() > 0) {
    const std::string_view line = lines.readLine(lineEnd);
    TextCursor words(line);
    const std::string_view kind = words.readWord();
    if (kind == "format") {
      header.encoding = parsePlyEncoding(words.readWord());
      hasFormat = true;
    } else if (kind == "element") {
      header.elements.push_back(parsePlyElement(words));
    } else if (kind == "property") {
      if (header.elements.empty()) failHeader("a property comes before all elements");
      header.elements.back().properties.push_back(parsePlyProperty(words));
      if (header.elements.back().properties.size() > kMaxPlyProperties)
        failHeader("an element has more than 1000 properties");
    } else if (kind == "comment" && words.readWord() == "TextureFile") {
      header.textureFile = words.readWord();
    } else if (kind == "end_header") {
      if (!hasFormat) failHeader("no format line");
      header.size = start.size() - lines.remaining();
      return header;
    }
  }
  failHeader("no end_header line");
}

}  // namespace enfilade::scene
