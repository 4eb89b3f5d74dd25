// Reads the elements in the order of the header. "vertex" has positions, normals and colours,
// "face" polygons and their colours, "tristrips" strips that -1 ends. All else is skipped.
#include "scene/import/scan/ply_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "scene/import/file/import_options.hpp"
#include "scene/import/scan/ply_header.hpp"
#include "scene/import/scan/polygon.hpp"
#include "scene/import/scan/scan_bytes.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxPlyCoordinate = 1e9;  // file units; a greater one is invalid, like NaN

[[noreturn]] void failPly(const std::string& message) {
  throw ImportError("PLY: " + message + "; export it again");
}

/// Values of a PLY file in any encoding.
class PlyValues {
 public:
  PlyValues(std::string_view body, PlyEncoding encoding)
      : isText_(encoding == PlyEncoding::ascii),
        text_(isText_ ? body : std::string_view()),
        binary_(isText_ ? std::string_view() : body, encoding == PlyEncoding::bigEndian) {}

  double read(PlyType type) { return isText_ ? text_.readNumber() : readBinary(type); }
  std::size_t remaining() const { return isText_ ? text_.remaining() : binary_.remaining(); }
  std::string_view rest() const { return isText_ ? text_.rest() : binary_.rest(); }
  bool failed() const { return isText_ ? text_.failed() : binary_.failed(); }
  /// Bytes that `count` values take at least.
  std::size_t computeMinSize(PlyType type, std::size_t count) const {
    return isText_ ? 2 * count - std::min<std::size_t>(count, 1) : getPlySize(type) * count;
  }

 private:
  double readBinary(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return binary_.read<std::int8_t>();
      case PlyType::uint8:
        return binary_.read<std::uint8_t>();
      case PlyType::int16:
        return binary_.read<std::int16_t>();
      case PlyType::uint16:
        return binary_.read<std::uint16_t>();
      case PlyType::int32:
        return binary_.read<std::int32_t>();
      case PlyType::uint32:
        return binary_.read<std::uint32_t>();
      case PlyType::float32:
        return static_cast<double>(binary_.read<float>());
      case PlyType::float64:
        return binary_.read<double>();
    }
    return 0;
  }

  bool isText_;
  TextCursor text_;
  BinaryCursor binary_;
};

/// Values that the import takes from a vertex, or from a face: colours only.
enum class PlyField : std::uint8_t { x, y, z, nx, ny, nz, red, green, blue, count };
constexpr std::size_t kPlyFields = static_cast<std::size_t>(PlyField::count);
using PlyFieldValues = std::array<double, kPlyFields>;

std::size_t findPlyField(const std::string& name) {
  static constexpr std::array<std::string_view, kPlyFields> kNames{
      "x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"};
  if (name.starts_with("diffuse_")) return findPlyField(name.substr(8));
  constexpr std::string_view kShortColours = "rgb";  // of some scanners
  if (const std::size_t channel = kShortColours.find(name); name.size() == 1 && channel < 3)
    return static_cast<std::size_t>(PlyField::red) + channel;
  return static_cast<std::size_t>(std::find(kNames.begin(), kNames.end(), name) - kNames.begin());
}

/// The value of a colour channel of this type that is full.
double getFullColour(PlyType type) {
  if (type == PlyType::float32 || type == PlyType::float64) return 1;
  return type == PlyType::uint16 ? 65535 : 255;
}

constexpr double kMaxUnitColour = 1.001;  // rounded ones stay ones

/// A colour that was taken for one of floats to 1, in an element whose floats count to 255.
VertexColour countToBytes(const VertexColour& colour) {
  const auto channel = [&](std::size_t i) {
    return static_cast<std::uint8_t>((colour[i] + 127) / 255);
  };
  return {channel(0), channel(1), channel(2), colour[3]};
}

/// The fields of an element.
struct PlyLayout {
  std::vector<std::size_t> fields;         ///< by property: a PlyField, otherwise kPlyFields
  std::array<bool, kPlyFields + 1> has{};  ///< by field
  double fullColour = 255;

  explicit PlyLayout(const PlyElement& element) {
    for (const PlyProperty& property : element.properties) {
      fields.push_back(property.countType ? kPlyFields : findPlyField(property.name));
      has[fields.back()] = true;
      if (fields.back() == static_cast<std::size_t>(PlyField::red))
        fullColour = getFullColour(property.type);
    }
  }
  bool hasNormals() const { return has[3] && has[4] && has[5]; }
  bool hasColours() const { return has[6] && has[7] && has[8]; }
  /// Floats count to 1, in some files to 255. Returns whether this is the first colour that says
  /// so: earlier ones were taken for floats to 1.
  bool noticeBytes(const PlyFieldValues& values) {
    if (fullColour != 1 || !hasColours() ||
        !(std::max({values[6], values[7], values[8]}) > kMaxUnitColour))
      return false;
    fullColour = 255;
    return true;
  }
  /// Writers of PLY give sRGB. Their alpha is left out: the surface of a scan is opaque.
  VertexColour makeColour(const PlyFieldValues& values) const {
    const auto channel = [&](std::size_t field) { return toByte(values[field] / fullColour); };
    return {channel(6), channel(7), channel(8), 255};
  }
};

class PlyReader {
 public:
  explicit PlyReader(std::string_view bytes)
      : header_(parsePlyHeader(bytes)), values_(bytes.substr(header_.size), header_.encoding) {}

  ScanMesh read() {
    for (const PlyElement& element : header_.elements) {
      requirePlausible(element);
      if (element.name == "vertex") {
        if (!mesh_.positions.empty()) failPly("has two elements 'vertex'");
        readVertices(element);
      } else {
        readOthers(element);
      }
    }
    if (mesh_.positions.empty()) failPly("contains no vertices");
    addFaces();
    mesh_.textureFile = header_.textureFile;
    mesh_.trailingBytes = countDataBytes(values_.rest());
    return std::move(mesh_);
  }

 private:
  void requirePlausible(const PlyElement& element) const {
    const std::size_t each = element.computeMinSize(header_.encoding);
    if (element.count == 0 || (each > 0 && element.count <= (values_.remaining() + 1) / each))
      return;
    failPly("its header announces " + std::to_string(element.count) + " elements '" + element.name +
            "', but only " + std::to_string(values_.remaining()) + " bytes follow");
  }

  void requireData(const PlyElement& element, std::size_t index) const {
    if (values_.failed())
      failPly("element '" + element.name + "' " + std::to_string(index) +
              " is cut off or not a number");
  }

  void readVertices(const PlyElement& element) {
    PlyLayout layout(element);
    if (!layout.has[0] || !layout.has[1] || !layout.has[2])
      failPly("its vertices have no x, y and z");
    mesh_.positions.reserve(element.count);
    if (layout.hasNormals()) mesh_.normals.reserve(element.count);
    if (layout.hasColours()) mesh_.colours.reserve(element.count);
    for (std::size_t i = 0; i < element.count; ++i) {
      PlyFieldValues vertex{};
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (property.countType) {
          skipList(property);
        } else {
          readField(property, layout.fields[p], vertex);
        }
      }
      requireData(element, i);
      if (layout.noticeBytes(vertex))
        for (VertexColour& colour : mesh_.colours) colour = countToBytes(colour);
      addVertex(layout, vertex);
    }
  }

  void addVertex(const PlyLayout& layout, const PlyFieldValues& v) {
    mesh_.positions.emplace_back(v[0], v[1], v[2]);
    if (layout.hasNormals()) mesh_.normals.push_back(Vec3(v[3], v[4], v[5]).cast<float>());
    if (layout.hasColours()) mesh_.colours.push_back(layout.makeColour(v));
  }

  void readField(const PlyProperty& property, std::size_t field, PlyFieldValues& values) {
    const double value = values_.read(property.type);
    if (field < kPlyFields) values[field] = value;
  }

  /// Reads the length of a list; it is no longer than the bytes that follow.
  std::size_t readListLength(const PlyProperty& property) {
    const double length = values_.read(*property.countType);
    if (!(length >= 0 && length <= 1e9)) failPly("a list has an invalid length");
    const auto count = static_cast<std::size_t>(length);
    if (values_.computeMinSize(property.type, count) > values_.remaining())
      failPly("a list of " + std::to_string(count) + " values extends beyond the file");
    return count;
  }

  void skipList(const PlyProperty& property) {
    for (std::size_t left = readListLength(property); left > 0; --left) values_.read(property.type);
  }

  void readOthers(const PlyElement& element) {
    const bool face = element.name == "face", strips = element.name == "tristrips";
    PlyLayout layout(element);
    const bool coloured = (face || strips) && layout.hasColours();
    hasFaceColours_ |= coloured;
    const std::size_t firstOfElement = runs_.size();
    for (std::size_t i = 0; i < element.count; ++i) {
      const std::size_t firstRun = runs_.size();
      PlyFieldValues values{};
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const bool corners = property.name == "vertex_indices" || property.name == "vertex_index";
        if (!property.countType) {
          readField(property, layout.fields[p], values);
        } else if (corners && (face || strips)) {
          readCorners(property, strips);
        } else {
          skipList(property);
        }
      }
      requireData(element, i);
      if (!coloured) continue;
      if (layout.noticeBytes(values))
        for (std::size_t r = firstOfElement; r < firstRun; ++r)
          runs_[r].colour = countToBytes(runs_[r].colour);
      for (std::size_t r = firstRun; r < runs_.size(); ++r)
        runs_[r].colour = layout.makeColour(values);
    }
  }

  /// Keeps the corners until all vertices are known; the file may list faces first.
  void readCorners(const PlyProperty& property, bool strip) {
    const std::size_t count = readListLength(property);
    if (!strip && count > kMaxPolygonCorners)
      failPly("a face has " + std::to_string(count) + " corners; at most 1000 are read");
    std::vector<std::int64_t> run;
    for (std::size_t i = 0; i < count; ++i) {
      const double value = values_.read(property.type);
      run.push_back(std::abs(value) < 1e15 ? static_cast<std::int64_t>(value) : -2);
    }
    if (!strip) return addRun(run, false);
    auto begin = run.begin();
    while (begin != run.end()) {
      const auto end = std::find(begin, run.end(), -1);
      addRun({begin, end}, true);
      begin = end == run.end() ? end : end + 1;
    }
  }

  void addRun(const std::vector<std::int64_t>& run, bool strip) {
    runs_.push_back({corners_.size(), {255, 255, 255, 255}, strip});
    for (const std::int64_t corner : run) {
      const bool possible = corner >= 0 && corner < kNoVertex;
      corners_.push_back(possible ? static_cast<std::uint32_t>(corner) : kNoVertex);
    }
  }

  bool isUsable(std::uint32_t corner) const {
    return corner < mesh_.positions.size() &&
           mesh_.positions[corner].cwiseAbs().maxCoeff() <= kMaxPlyCoordinate &&
           mesh_.positions[corner].allFinite();
  }

  void addFaces() {
    if (hasFaceColours_ && !mesh_.colours.empty())
      mesh_.unusedColours = "those of its faces, because its vertices have colours, too";
    const bool coloured = hasFaceColours_ && mesh_.colours.empty();
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const std::size_t end = i + 1 < runs_.size() ? runs_[i + 1].first : corners_.size();
      const std::span<const std::uint32_t> run(corners_.data() + runs_[i].first,
                                               end - runs_[i].first);
      const bool usable = run.size() >= 3 &&
                          std::all_of(run.begin(), run.end(), [&](auto c) { return isUsable(c); });
      if (!usable) {
        ++mesh_.brokenFaces;
      } else if (runs_[i].strip) {
        addStrip(run);
      } else {
        triangulatePolygon(run, mesh_.positions, mesh_.indices);
      }
      if (coloured) mesh_.triangleColours.resize(mesh_.indices.size() / 3, runs_[i].colour);
    }
  }

  void addStrip(std::span<const std::uint32_t> run) {
    for (std::size_t i = 0; i + 2 < run.size(); ++i) {
      const std::size_t odd = i % 2;
      const std::array<std::uint32_t, 3> t{run[i], run[i + 1 + odd], run[i + 2 - odd]};
      if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) continue;
      mesh_.indices.insert(mesh_.indices.end(), t.begin(), t.end());
    }
  }

  static constexpr std::uint32_t kNoVertex = 0xffffffff;
  struct Run {
    std::size_t first;  ///< index into corners_
    VertexColour colour;
    bool strip;
  };

  PlyHeader header_;
  PlyValues values_;
  ScanMesh mesh_;
  bool hasFaceColours_ = false;
  std::vector<std::uint32_t> corners_;
  std::vector<Run> runs_;
};

}  // namespace

ScanMesh parsePly(std::string_view bytes) {
  ScanMesh mesh = PlyReader(bytes).read();
  if (mesh.indices.empty() && mesh.brokenFaces == 0)
    throw ImportError(
        "PLY: a point cloud without faces, which has no surface to walk on; mesh it first, for "
        "example in MeshLab or CloudCompare");
  return mesh;
}

}  // namespace enfilade::scene
