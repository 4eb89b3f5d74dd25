#include "scene/import/scan/import_scan.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <unordered_map>
#include <utility>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/assembly/finish_model.hpp"
#include "scene/import/assembly/path_names.hpp"
#include "scene/import/file/read_file.hpp"
#include "scene/import/scan/guess_up_axis.hpp"
#include "scene/import/scan/ply_file.hpp"
#include "scene/import/scan/stl_file.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

std::vector<ScanMesh> parseScan(const std::filesystem::path& file, ModelFormat format) {
  const std::string bytes = readModelFile(file);
  try {
    if (format == ModelFormat::stl) return parseStl(bytes);
    std::vector<ScanMesh> meshes;
    meshes.push_back(parsePly(bytes));
    return meshes;
  } catch (const ImportError& error) {
    throw ImportError(file.string() + ": " + error.what());
  }
}

/// Whole units near the middle of the used vertices if they lie beyond the precision of floats,
/// otherwise zero. Subtracted before a coordinate becomes a float.
Vec3 computeShift(const ScanMesh& mesh, double metresPerUnit) {
  Aabb box;
  for (const std::uint32_t i : mesh.indices) box.include(mesh.positions[i]);
  const Vec3 centre = box.centre();
  if (!centre.allFinite() || !(centre.norm() * metresPerUnit > kMaxPreciseDistance))
    return Vec3::Zero();
  return {std::round(centre.x()), std::round(centre.y()), std::round(centre.z())};
}

bool hasUsableNormals(const ScanMesh& scan) {
  if (scan.normals.empty()) return false;
  for (const std::uint32_t i : scan.indices) {
    const double length = scan.normals[i].cast<double>().norm();
    if (!(length > 1e-6 && length < 1e6)) return false;
  }
  return true;
}

/// Converts the vertices that triangles use: scans often have loose points around the surface.
/// Where triangles of different colours meet, a vertex is split: each colour gets one.
class ScanVertices {
 public:
  ScanVertices(const ScanMesh& scan, const Vec3& shift, Mesh& mesh)
      : scan_(scan),
        shift_(shift),
        mesh_(mesh),
        hasNormals_(hasUsableNormals(scan)),
        first_(scan.positions.size(), kNoVertex) {}

  /// The vertex of a triangle's corner.
  std::uint32_t convert(std::uint32_t corner, std::size_t triangle) {
    const bool byTriangle = !scan_.triangleColours.empty();
    const VertexColour colour = byTriangle              ? scan_.triangleColours[triangle]
                                : scan_.colours.empty() ? VertexColour{}
                                                        : scan_.colours[corner];
    std::uint32_t& first = first_[corner];
    if (first == kNoVertex) return first = add(corner, colour);
    if (!byTriangle || mesh_.colours[first] == colour) return first;
    const std::uint64_t key = std::uint64_t{corner} << 24U | std::uint64_t{colour[0]} << 16U |
                              std::uint64_t{colour[1]} << 8U | colour[2];
    const auto [known, isNew] = split_.try_emplace(key, kNoVertex);
    if (isNew) known->second = add(corner, colour);
    return known->second;
  }

 private:
  static constexpr std::uint32_t kNoVertex = 0xffffffff;

  std::uint32_t add(std::uint32_t corner, const VertexColour& colour) {
    mesh_.positions.push_back((scan_.positions[corner] - shift_).cast<float>());
    if (scan_.hasColours()) mesh_.colours.push_back(colour);
    if (hasNormals_) mesh_.normals.push_back(scan_.normals[corner].normalized());
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  const ScanMesh& scan_;
  const Vec3& shift_;
  Mesh& mesh_;
  bool hasNormals_;
  std::vector<std::uint32_t> first_;                        ///< by vertex of the scan
  std::unordered_map<std::uint64_t, std::uint32_t> split_;  ///< by vertex of the scan and colour
};

Mesh convertScanMesh(const ScanMesh& scan, const Vec3& shift, const std::string& name,
                     std::vector<Diagnostic>& diagnostics) {
  Mesh mesh;
  mesh.name = name;
  mesh.indices.reserve(scan.indices.size());
  ScanVertices vertices(scan, shift, mesh);
  for (std::size_t i = 0; i < scan.indices.size(); ++i)
    mesh.indices.push_back(vertices.convert(scan.indices[i], i / 3));
  std::size_t flat = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.indices[i]].cast<double>();
    const Vec3 b = mesh.positions[mesh.indices[i + 1]].cast<double>() - a;
    const Vec3 c = mesh.positions[mesh.indices[i + 2]].cast<double>() - a;
    flat += b.cross(c).isZero(0.0) ? 1 : 0;
  }
  addDiagnostic(diagnostics, "degenerate_triangle", name, flat);
  addDiagnostic(diagnostics, "broken_triangle_dropped",
                name +
                    ": fewer than three corners, an index out of range or a vertex that is NaN, "
                    "infinite or beyond 1e9",
                scan.brokenFaces);
  return mesh;
}

/// White under vertex colours, which multiply it.
Material makeScanMaterial(const ScanMesh& scan, const std::string& name,
                          std::vector<Diagnostic>& diagnostics) {
  Material material;
  material.name = name;
  material.doubleSided = true;
  if (!scan.textureFile.empty())
    addDiagnostic(diagnostics, "missing_texture",
                  scan.textureFile + ": textures of PLY are not read");
  if (!scan.unusedColours.empty())
    addDiagnostic(diagnostics, "vertex_colours_ignored", name + ": " + scan.unusedColours);
  if (scan.trailingBytes > 0)
    addDiagnostic(diagnostics, "trailing_data",
                  name + ": " + std::to_string(scan.trailingBytes) +
                      " bytes after what the header announces");
  if (scan.hasColours()) material.baseColour.setOnes();
  return material;
}

std::string formatArea(double area) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", area);
  return text.data();
}

std::string describeLevelAreas(const LevelAreas& areas, UpAxis up) {
  std::string text = toString(up) + " is up: the largest levels across x, y, z have";
  for (const LevelArea& area : areas.axes) text += " " + formatArea(area.largest);
  text += " of " + formatArea(areas.surface) + " square units; --up sets another";
  const bool hangs = areas.axes[static_cast<std::size_t>(up)].hangs;
  return hangs ? text + "; the largest faces down and is high: if the scan is upside down, --up=" +
                     toString(negate(up))
               : text;
}

}  // namespace

Model importScan(const std::filesystem::path& file, ModelFormat format,
                 const ImportOptions& options, const ImportProgress& progress) {
  const std::vector<ScanMesh> scans = parseScan(file, format);
  if (progress) progress("convert", 0);
  Model model;
  model.reader = format == ModelFormat::ply ? "ply" : "stl";
  model.metresPerUnit = options.metresPerUnit.value_or(1);
  if (!options.metresPerUnit)
    addDiagnostic(model.diagnostics, "no_unit",
                  (format == ModelFormat::ply ? "PLY" : "STL") +
                      std::string(" has no unit: taken for metres"));
  const LevelAreas areas = computeLevelAreas(scans);
  const UpAxisGuess guess = guessUpAxis(areas);
  model.upAxis = options.up.value_or(guess.axis);
  if (!options.up)
    addDiagnostic(model.diagnostics, guess.isClear ? "guessed_up_axis" : "unclear_up_axis",
                  describeLevelAreas(areas, model.upAxis));
  Eigen::Affine3d worldFromFile = Eigen::Affine3d::Identity();
  worldFromFile.linear() = makeYUpRotation(model.upAxis) * model.metresPerUnit;

  std::vector<Mesh> meshes;
  std::vector<ImportedNode> nodes;
  SiblingNames names;
  for (const ScanMesh& scan : scans) {
    // A renamed file must keep its paths, so they do not contain its name.
    const std::string name =
        names.makeUnique(scan.name.empty() ? "mesh" : encodePathSegment(scan.name));
    const Vec3 shift = computeShift(scan, model.metresPerUnit);
    model.materials.push_back(makeScanMaterial(scan, name, model.diagnostics));
    meshes.push_back(convertScanMesh(scan, shift, name, model.diagnostics));
    meshes.back().material = static_cast<std::uint32_t>(model.materials.size() - 1);
    if (meshes.back().indices.empty()) continue;
    ImportedNode& node = nodes.emplace_back();
    node.object.path = name;
    node.instances.push_back({static_cast<std::uint32_t>(meshes.size() - 1),
                              worldFromFile * Eigen::Translation3d(shift)});
  }
  if (model.materials.empty()) model.materials.emplace_back();
  finishModel(std::move(nodes), std::move(meshes), file, options.offset, model);
  return model;
}

}  // namespace enfilade::scene
