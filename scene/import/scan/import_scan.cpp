#include "scene/import/scan/import_scan.hpp"

#include <cmath>
#include <fstream>
#include <utility>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/assembly/finish_model.hpp"
#include "scene/import/assembly/path_names.hpp"
#include "scene/import/scan/ply_file.hpp"
#include "scene/import/scan/stl_file.hpp"
#include "scene/import/scan/up_axis.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

std::string readScanFile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ImportError(file.string() + ": cannot be opened for reading (open)");
  std::string bytes(static_cast<std::size_t>(file_size(file)), '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

std::vector<ScanMesh> parseScan(const std::filesystem::path& file, ModelFormat format) {
  const std::string bytes = readScanFile(file);
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
Mesh convertScanMesh(const ScanMesh& scan, const Vec3& shift, const std::string& name,
                     std::vector<Diagnostic>& diagnostics) {
  constexpr std::uint32_t kUnused = 0xffffffff;
  std::vector<std::uint32_t> newIndex(scan.positions.size(), kUnused);
  const bool normals = hasUsableNormals(scan);
  Mesh mesh;
  mesh.name = name;
  mesh.indices.reserve(scan.indices.size());
  for (const std::uint32_t old : scan.indices) {
    if (newIndex[old] == kUnused) {
      newIndex[old] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back((scan.positions[old] - shift).cast<float>());
      if (!scan.colours.empty()) mesh.colours.push_back(scan.colours[old]);
      if (normals) mesh.normals.push_back(scan.normals[old].normalized());
    }
    mesh.indices.push_back(newIndex[old]);
  }
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
  if (scan.hasFaceColours)
    addDiagnostic(diagnostics, "vertex_colours_ignored", name + ": colours of its faces");
  if (!scan.colours.empty()) material.baseColour.setOnes();
  return material;
}

std::string describeLevelAreas(const LevelAreas& areas, char up) {
  std::string text = std::string(1, up) + " is up: the largest levels across x, y, z have";
  for (const double area : areas) text += " " + std::to_string(std::llround(area));
  return text + " square units; --up sets another";
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
