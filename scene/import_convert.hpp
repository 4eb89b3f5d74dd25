// From assimp's scene to ours. Runs in the import child only.
#pragma once

#include <filesystem>

#include "scene/import_file_facts.hpp"
#include "scene/import_model.hpp"

struct aiScene;

namespace enfilade::scene {

/// Counts problems by kind and keeps the first example of each.
class ProblemLog {
 public:
  void add(const std::string& kind, const std::string& example, std::size_t count = 1);
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

struct ConvertInput {
  std::filesystem::path file;
  ModelFormat format = ModelFormat::gltf;
  FileFacts facts;
  std::optional<double> metresPerUnit;  ///< the user's, which replaces the file's
  std::optional<char> up;
};

/// Throws ImportError when nothing solid is left. `input.facts` must be of the same file.
Model convertScene(const aiScene& scene, const ConvertInput& input, const ImportProgress& progress);

/// Materials in assimp's order and the textures that they use, decoded.
void convertMaterials(const aiScene& scene, const ConvertInput& input, Model& model,
                      ProblemLog& problems, const ImportProgress& progress);

/// One mesh for each of assimp's, some of them without triangles.
std::vector<Mesh> convertMeshes(const aiScene& scene, ProblemLog& problems);

/// `mesh` moved by `transform`, which may mirror: outside stays outside.
Mesh transformed(const Mesh& mesh, const Eigen::Affine3d& transform);

/// What a node of the file becomes: placements are metres, Y up, offset not yet removed.
struct ObjectDraft {
  struct Placement {
    std::uint32_t mesh;  ///< assimp's index
    Eigen::Affine3d worldFromMesh;
  };
  std::string path, globalId, ifcClass;
  std::vector<Placement> placements;
};

/// The nodes that carry triangles, in document order. `worldFromRoot` goes before the root's own
/// transform.
std::vector<ObjectDraft> collectObjects(const aiScene& scene, ModelFormat format,
                                        const Eigen::Affine3d& worldFromRoot,
                                        const std::vector<Mesh>& meshes, ProblemLog& problems);

}  // namespace enfilade::scene
