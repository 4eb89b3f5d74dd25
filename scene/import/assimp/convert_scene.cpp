#include "scene/import/assimp/convert_scene.hpp"

#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <map>
#include <set>
#include <span>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/assembly/finish_model.hpp"
#include "scene/import/assimp/materials.hpp"
#include "scene/import/assimp/meshes.hpp"
#include "scene/import/assimp/nodes.hpp"
#include "scene/import/bodies/gltf_bodies.hpp"
#include "scene/import/bodies/name_suffixes.hpp"
#include "scene/import/gltf/collect_gltf_nodes.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

/// The transform that assimp applied above the root's own, reproduced bit by bit in its floats.
Eigen::Matrix3d computeAssimpFromFile(const FileMetadata& metadata, ModelFormat format) {
  Eigen::Matrix3d rotation = makeYUpRotation(metadata.assimpUp);
  if (format == ModelFormat::ifc) {
    aiMatrix4x4 m;
    aiMatrix4x4::RotationX(-AI_MATH_HALF_PI_F, m);
    rotation << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  }
  return rotation * static_cast<double>(static_cast<float>(metadata.assimpScale));
}

/// Reports triangles that assimp dropped silently because their vertex indices are out of range.
void reportMissingTriangles(const aiScene& scene, const ConvertInput& input,
                            std::vector<Diagnostic>& diagnostics) {
  std::size_t read = 0;
  for (const aiMesh* mesh : std::span(scene.mMeshes, scene.mNumMeshes)) {
    for (const aiFace& face : std::span(mesh->mFaces, mesh->mNumFaces))
      read += face.mNumIndices == 3 ? 1 : 0;
  }
  if (!input.metadata.triangles || read >= *input.metadata.triangles) return;
  addDiagnostic(diagnostics, "broken_triangle_dropped", "a vertex index is out of range",
                *input.metadata.triangles - read);
}

/// Vertex colours multiply the material, and a material without a colour is grey here, as assimp's
/// own default is. Meshes with vertex colours get a white one in its place.
void whitenUncolouredMaterials(const std::vector<FileMaterial>& materials,
                               std::vector<Mesh>& meshes, Model& model) {
  std::map<std::uint32_t, std::uint32_t> whitened;  // by material
  for (Mesh& mesh : meshes) {
    if (mesh.colours.empty() || mesh.material >= materials.size()) continue;
    const FileMaterial& stated = materials[mesh.material];
    if (stated.baseColour && stated.name != AI_DEFAULT_MATERIAL_NAME) continue;
    const auto [known, isNew] =
        whitened.try_emplace(mesh.material, static_cast<std::uint32_t>(model.materials.size()));
    if (isNew) {
      Material white = model.materials[mesh.material];
      white.baseColour.head<3>().setOnes();
      model.materials.push_back(std::move(white));
    }
    mesh.material = known->second;
  }
}

/// Finds the meshes of a glTF file in the scene that assimp read from its GltfMeshFile.
std::vector<std::span<const unsigned>> matchMeshes(const aiScene& scene,
                                                   const ConvertInput& input) {
  const std::span nodes(scene.mRootNode->mChildren, scene.mRootNode->mNumChildren);
  const std::vector<std::size_t>& meshes = input.gltfMeshes;
  if (nodes.size() != meshes.size())
    throw ImportError(input.file.string() + ": assimp read " + std::to_string(nodes.size()) +
                      " of its " + std::to_string(meshes.size()) + " meshes; export it again");
  std::vector<std::span<const unsigned>> parts;
  if (!meshes.empty()) parts.resize(*std::ranges::max_element(meshes) + 1);
  for (std::size_t i = 0; i < meshes.size(); ++i)
    parts[meshes[i]] = std::span(nodes[i]->mMeshes, nodes[i]->mNumMeshes);
  return parts;
}

}  // namespace

Model convertScene(const aiScene& scene, const std::vector<FileMaterial>& materials,
                   const ConvertInput& input, const ImportProgress& progress) {
  Model model;
  model.reader = "assimp";
  for (const Diagnostic& diagnostic : input.metadata.problems) {
    // A unit that the user gave is not a guess.
    const bool aboutUnit = diagnostic.kind == "no_unit" || diagnostic.kind == "unit_assumed";
    if (aboutUnit && input.options.metresPerUnit) continue;
    addDiagnostic(model.diagnostics, diagnostic.kind, diagnostic.example, diagnostic.count);
  }
  model.metresPerUnit = input.options.metresPerUnit.value_or(input.metadata.metresPerUnit);
  model.upAxis = input.options.up.value_or(input.metadata.up);
  model.fileScenes = input.metadata.scenes;
  model.fileScene = input.metadata.scene;
  convertMaterials(scene, materials, input.file, input.format, model, progress);

  if (progress) progress("convert", 0);
  const bool gltf = input.format == ModelFormat::gltf || input.format == ModelFormat::glb;
  std::vector<Mesh> meshes = convertMeshes(scene, gltf, !input.joined, model.diagnostics);
  whitenUncolouredMaterials(materials, meshes, model);
  reportMissingTriangles(scene, input, model.diagnostics);
  Eigen::Affine3d worldFromRoot = Eigen::Affine3d::Identity();
  worldFromRoot.linear() = makeYUpRotation(model.upAxis) * model.metresPerUnit *
                           computeAssimpFromFile(input.metadata, input.format).inverse();
  worldFromRoot.translate(input.shift);
  NodeTransforms transforms;
  const bool bodies = !input.gltfJson.empty();
  std::vector<ImportedNode> importedNodes =
      gltf ? collectGltfNodes(input.gltfNodes, {meshes, matchMeshes(scene, input)}, worldFromRoot,
                              model.diagnostics, bodies ? &transforms : nullptr)
           : collectObjects(scene, input.format, worldFromRoot, meshes, model.diagnostics);
  if (progress) progress("convert", 0.5);

  finishModel(std::move(importedNodes), std::move(meshes), input.file, input.options.offset, model);
  std::set<std::uint32_t> staticObjects;
  if (bodies) staticObjects = addGltfBodies(input.file, input.gltfJson, transforms, model);
  if (input.format != ModelFormat::ifc) addNamedBodies(model, staticObjects);
  return model;
}

}  // namespace enfilade::scene
