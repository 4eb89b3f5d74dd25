// From assimp's scene to ours. Runs in the import child only.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/file_metadata.hpp"
#include "scene/import/import_model.hpp"

struct aiNode;
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
  std::optional<Vec3> offset;  ///< the user's, in the place of one that brings it near the origin
  Vec3 shift = Vec3::Zero();   ///< in the file's units and axes: taken off before assimp read it
};

/// A file's text with `shift` taken off its coordinates; empty: it may stay as it is.
struct ShiftedText {
  std::string text;
  Vec3 shift = Vec3::Zero();
};

/// Of an OBJ file whose vertices lie farther than `farAway` (in its units) from its origin.
ShiftedText shiftedObj(const std::filesystem::path& file, double farAway);

constexpr double kFarAway = 1000;  ///< metres: farther from the origin, floats lose the millimetre
constexpr double kCoarse = 1e-4;   ///< metres between neighbouring floats that deserve a word

/// Throws ImportError when nothing solid is left. `input.facts` must be of the same file.
Model convertScene(const aiScene& scene, const std::vector<FileMaterial>& materials,
                   const ConvertInput& input, const ImportProgress& progress);

/// The materials, in their order, and the textures that they use, decoded; `scene` may hold some.
void convertMaterials(const aiScene& scene, const std::vector<FileMaterial>& materials,
                      const ConvertInput& input, Model& model, ProblemLog& problems,
                      const ImportProgress& progress);

/// One mesh for each of assimp's, some of them without triangles.
std::vector<Mesh> convertMeshes(const aiScene& scene, ProblemLog& problems);

/// `mesh` moved by `transform`, which may mirror: outside stays outside.
Mesh transformed(const Mesh& mesh, const Eigen::Affine3d& transform);

/// What a node of the file becomes: placements are metres, Y up, offset not yet removed.
struct ObjectDraft {
  struct Placement {
    std::uint32_t mesh;  ///< into the meshes that come with the drafts
    Eigen::Affine3d worldFromMesh;
  };
  Object object;  ///< without meshes and their transform; worldFromPlacement as the placements
  std::vector<Placement> placements;
};

/// From drafts to the model's objects and meshes: `offset`, or one near the objects' middle, taken
/// off, what lies too far away dropped, one transform an object. Materials are there before. Throws
/// ImportError, naming `file`, when nothing is left.
void finishModel(std::vector<ObjectDraft> drafts, std::vector<Mesh> meshes,
                 const std::filesystem::path& file, const std::optional<Vec3>& offset, Model& model,
                 ProblemLog& problems);

/// Y up from `up`, by a quarter turn about the axis that is neither.
Eigen::Matrix3d yUpFrom(char up);

/// A channel of a colour, 0..1.
float linearFromSrgb(float c);

/// One segment of a path: '/', '%', control characters and what is not UTF-8 are percent-encoded.
std::string encodedName(std::string_view name);

/// Names given out below one parent.
class SiblingNames {
 public:
  /// `name`, or `name#2`, `name#3`, ... where it is taken.
  std::string claim(const std::string& name);

 private:
  std::set<std::string> taken_;
  std::map<std::string, std::size_t> repeats_;
};

/// A node as the glTF file itself knows it, better than assimp does.
struct GltfNode {
  Eigen::Affine3d parentFromNode;
  std::size_t number;  ///< in the file's list of nodes
};
using GltfNodes = std::map<const aiNode*, GltfNode>;

/// What a glTF file says of its nodes, in doubles; those that cannot be found again are left out.
GltfNodes exactGltfNodes(const aiScene& scene, const std::filesystem::path& file,
                         ModelFormat format);

/// The JSON of a glTF or GLB file; empty when it cannot be read.
std::string gltfText(const std::filesystem::path& file, ModelFormat format);

/// Where a node of a glTF file came to stand.
struct NodePlace {
  std::string path;                  ///< of its object, if it has meshes
  Eigen::Affine3d worldFromNode;     ///< as the drafts' placements
  std::optional<std::size_t> above;  ///< the number of its parent
};
using NodePlaces = std::map<std::size_t, NodePlace>;  ///< by the node's number

/// The nodes that carry triangles, in document order. `worldFromRoot` goes before the root's own
/// transform. Where the nodes of `exact` stand is added to `places`.
std::vector<ObjectDraft> collectObjects(const aiScene& scene, ModelFormat format,
                                        const Eigen::Affine3d& worldFromRoot,
                                        const GltfNodes& exact, const std::vector<Mesh>& meshes,
                                        ProblemLog& problems, NodePlaces& places);

/// Adds the bodies and collision shapes that a glTF file tells of its nodes. Returns the objects of
/// which it says that they are no bodies. Throws ImportError.
std::set<std::uint32_t> addGltfBodies(const std::filesystem::path& file, ModelFormat format,
                                      const NodePlaces& places, Model& model);

/// Adds those that names of objects tell by their suffixes and prefixes, but none of `still`.
void addNamedBodies(Model& model, const std::set<std::uint32_t>& still);

}  // namespace enfilade::scene
