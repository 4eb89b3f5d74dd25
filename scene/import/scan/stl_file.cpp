// A binary file has a header of 80 bytes, a count, and 50 bytes per triangle. Programs disagree on
// whether a text file may begin with anything but "solid", and some binary headers do begin with
// it. So a file whose size fits its count is binary, and any other that begins with "solid" and
// has no zero bytes is text.
#include "scene/import/scan/stl_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "scene/import/file/import_options.hpp"
#include "scene/import/scan/scan_bytes.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kStlHeader = 80, kStlFacet = 50;  // bytes
constexpr unsigned kStlHasColour = 1U << 15;            // of a facet's attribute, in VisCAM
constexpr double kMaxStlCoordinate = 1e9;               // file units; a greater one is invalid

[[noreturn]] void failStl(const std::string& message) {
  throw ImportError("STL: " + message + "; export it again");
}

/// Joins corners of equal position.
class StlWelder {
 public:
  explicit StlWelder(ScanMesh& mesh) : mesh_(mesh) {}

  void addTriangle(const std::array<Vec3, 3>& corners) {
    const bool usable = std::all_of(corners.begin(), corners.end(), [](const Vec3& p) {
      return p.allFinite() && p.cwiseAbs().maxCoeff() <= kMaxStlCoordinate;
    });
    if (!usable) {
      ++mesh_.brokenFaces;
      return;
    }
    for (const Vec3& corner : corners) mesh_.indices.push_back(findVertex(corner));
  }

 private:
  struct Hash {
    std::size_t operator()(const Vec3& p) const {
      std::uint64_t hash = 0;
      for (const double v : {p.x(), p.y(), p.z()})  // -0 equals 0
        hash = (hash ^ std::bit_cast<std::uint64_t>(v + 0.0)) * 0x9e3779b97f4a7c15u + (hash >> 29);
      return static_cast<std::size_t>(hash ^ hash >> 32);
    }
  };

  std::uint32_t findVertex(const Vec3& position) {
    const auto next = static_cast<std::uint32_t>(mesh_.positions.size());
    const auto [at, isNew] = known_.try_emplace(position, next);
    if (isNew) mesh_.positions.push_back(position);
    return at->second;
  }

  ScanMesh& mesh_;
  std::unordered_map<Vec3, std::uint32_t, Hash> known_;
};

std::size_t readStlCount(std::string_view bytes) {
  if (bytes.size() < kStlHeader + 4) return 0;
  return BinaryCursor(bytes.substr(kStlHeader), false).read<std::uint32_t>();
}

std::vector<ScanMesh> parseBinaryStl(std::string_view bytes, std::size_t count) {
  std::vector<ScanMesh> meshes(1);
  meshes[0].indices.reserve(count * 3);
  StlWelder welder(meshes[0]);
  bool coloured = bytes.substr(0, kStlHeader).find("COLOR=") != std::string_view::npos;  // Magics
  BinaryCursor cursor(bytes.substr(kStlHeader + 4), false);
  for (std::size_t i = 0; i < count; ++i) {
    cursor.skip(3 * sizeof(float));  // the normal: often zero or wrong
    std::array<Vec3, 3> corners;
    for (Vec3& corner : corners) {
      for (int axis = 0; axis < 3; ++axis) corner[axis] = static_cast<double>(cursor.read<float>());
    }
    const auto attribute = cursor.read<std::uint16_t>();
    coloured = coloured || (attribute & kStlHasColour) != 0;
    welder.addTriangle(corners);
  }
  if (coloured) meshes[0].unusedColours = "those of its facets: programs disagree on their form";
  meshes[0].trailingBytes = countDataBytes(cursor.rest());
  return meshes;
}

/// Keywords are written in small letters by the format, and in capitals by some programs.
bool isKeyword(std::string_view word, std::string_view keyword) {
  return std::ranges::equal(word, keyword, [](char a, char b) { return (a | 0x20) == b; });
}

/// Reads one facet after the word "facet"; words other than "vertex" are skipped.
std::array<Vec3, 3> parseStlFacet(TextCursor& text, std::size_t index) {
  std::array<Vec3, 3> corners;
  std::size_t found = 0;
  for (std::string_view word = text.readWord(); !isKeyword(word, "endfacet");
       word = text.readWord()) {
    if (word.empty()) failStl("facet " + std::to_string(index) + " is cut off");
    if (!isKeyword(word, "vertex")) continue;
    if (found == 3) failStl("facet " + std::to_string(index) + " has more than three corners");
    for (int axis = 0; axis < 3; ++axis) corners[found][axis] = text.readNumber();
    if (text.failed())
      failStl("facet " + std::to_string(index) + " has a corner that is not a number");
    ++found;
  }
  if (found != 3) failStl("facet " + std::to_string(index) + " has fewer than three corners");
  return corners;
}

std::vector<ScanMesh> parseTextStl(std::string_view bytes) {
  std::vector<ScanMesh> meshes;
  TextCursor text(bytes);
  std::size_t facets = 0;
  for (std::string_view word = text.readWord(); !word.empty(); word = text.readWord()) {
    if (!isKeyword(word, "solid"))
      failStl("'" + std::string(word.substr(0, 40)) + "' where 'solid' belongs");
    ScanMesh& mesh = meshes.emplace_back();
    mesh.name = text.readLine();
    StlWelder welder(mesh);
    for (word = text.readWord(); !isKeyword(word, "endsolid"); word = text.readWord()) {
      if (!isKeyword(word, "facet"))
        failStl(word.empty() ? "cut off after facet " + std::to_string(facets)
                             : "'" + std::string(word.substr(0, 40)) + "' where 'facet' belongs");
      welder.addTriangle(parseStlFacet(text, ++facets));
    }
    text.readLine();  // the solid's name again
  }
  return meshes;
}

/// The bytes after a byte order mark and blanks.
std::string_view findStlText(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  while (!bytes.empty() && isBlank(bytes.front())) bytes.remove_prefix(1);
  return bytes;
}

}  // namespace

std::vector<ScanMesh> parseStl(std::string_view bytes) {
  const std::size_t count = readStlCount(bytes);
  const bool holds =
      bytes.size() >= kStlHeader + 4 && count <= (bytes.size() - kStlHeader - 4) / kStlFacet;
  const bool fits = holds && bytes.size() - kStlHeader - 4 == count * kStlFacet;
  if (fits) return parseBinaryStl(bytes, count);
  const std::string_view text = findStlText(bytes);
  if (isKeyword(text.substr(0, 5), "solid") &&
      text.substr(0, 2 * kStlHeader).find('\0') == std::string_view::npos)
    return parseTextStl(text);
  if (bytes.size() < kStlHeader + 4)
    failStl("neither text, which begins with 'solid', nor binary: " + std::to_string(bytes.size()) +
            " bytes, and a binary file has at least " + std::to_string(kStlHeader + 4));
  if (!holds)
    failStl("cut off: " + std::to_string(count) + " triangles announced, " +
            std::to_string(bytes.size()) + " bytes present");
  return parseBinaryStl(bytes, count);  // some programs append data of their own
}

}  // namespace enfilade::scene
