#include "scene/import/assimp/convert_scene.hpp"

#include <assimp/scene.h>

#include <algorithm>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kGreatest = 1e7;     // metres from the scene's centre: no world takes more
constexpr double kWildFactor = 10;    // times that again: a corner of it must be wrong
constexpr double kStrayFactor = 30;   // times the median reach; a town's outskirts are at about 5
constexpr double kMostStrays = 0.05;  // of all objects; more are no strays but a second site

/// What assimp put before the root's own transform, to the bit of its floats.
Eigen::Matrix3d assimpFromFile(const FileFacts& facts, ModelFormat format) {
  Eigen::Matrix3d turn = yUpFrom(facts.assimpTurnsUp);
  if (format == ModelFormat::ifc) {
    aiMatrix4x4 m;
    aiMatrix4x4::RotationX(-AI_MATH_HALF_PI_F, m);
    turn << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  }
  return turn * static_cast<double>(static_cast<float>(facts.assimpScale));
}

Box boxOf(const Mesh& mesh) {
  Box box;
  for (const std::uint32_t i : mesh.indices) box.include(mesh.positions[i].cast<double>());
  return box;
}

Box movedBox(const Box& box, const Eigen::Affine3d& transform) {
  Box result;
  for (int corner = 0; corner < 8; ++corner) {
    result.include(transform * Vec3((corner & 1) != 0 ? box.max.x() : box.min.x(),
                                    (corner & 2) != 0 ? box.max.y() : box.min.y(),
                                    (corner & 4) != 0 ? box.max.z() : box.min.z()));
  }
  return result;
}

Box boxOf(const ObjectDraft& draft, const std::vector<Box>& meshBoxes) {
  Box box;
  for (const auto& p : draft.placements) box.include(movedBox(meshBoxes[p.mesh], p.worldFromMesh));
  return box;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Vec3 medianCentre(const std::vector<Box>& boxes) {
  Vec3 centre = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Box& box : boxes) values.push_back(box.centre()[axis]);
    centre[axis] = median(values);
  }
  return centre;
}

/// Zero, or whole metres near the median of the objects' centres.
Vec3 sceneOffset(const std::vector<Box>& objectBoxes) {
  const Vec3 centre = medianCentre(objectBoxes);
  if (!centre.allFinite() || centre.norm() <= kFarAway) return Vec3::Zero();
  return {std::round(centre.x()), std::round(centre.y()), std::round(centre.z())};
}

/// Meshes whose own coordinates are large are moved to their origin, in doubles, and their
/// placements moved back, so that no renderer has to subtract large floats.
void recentreMeshes(std::vector<ObjectDraft>& drafts, std::vector<Mesh>& meshes,
                    std::vector<Box>& meshBoxes, ProblemLog& problems) {
  std::vector<Vec3> shifts(meshes.size(), Vec3::Zero());
  for (const ObjectDraft& draft : drafts) {
    for (const auto& p : draft.placements) {
      const Vec3 centre = meshBoxes[p.mesh].centre();
      const double distance = (p.worldFromMesh.linear() * centre).norm();
      if (!(distance > kFarAway)) continue;
      if (shifts[p.mesh].isZero(0) && distance * 0x1p-23 > kCoarse) {
        problems.add("coarse_coordinates", meshes[p.mesh].name + ": steps of " +
                                               std::to_string(distance * 0x1p-23) +
                                               " m; export it near its origin, placed by its node");
      }
      shifts[p.mesh] = {std::round(centre.x()), std::round(centre.y()), std::round(centre.z())};
    }
  }
  for (ObjectDraft& draft : drafts) {
    for (auto& p : draft.placements) p.worldFromMesh.translate(shifts[p.mesh]);
  }
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (shifts[i].isZero(0)) continue;
    const Eigen::Affine3d back(Eigen::Translation3d(-shifts[i]));
    meshes[i] = transformed(meshes[i], back);
    meshBoxes[i] = boxOf(meshes[i]);
  }
}

/// Draws from assimp's meshes those that the model needs, each once, and copies moved.
class MeshTable {
 public:
  MeshTable(std::vector<Mesh>& from, Model& model)
      : from_(from), model_(model), index_(from.size(), kUnused) {}

  std::uint32_t shared(std::uint32_t mesh) {
    if (index_[mesh] == kUnused) index_[mesh] = add(from_[mesh]);
    return index_[mesh];
  }
  std::uint32_t moved(std::uint32_t mesh, const Eigen::Affine3d& transform) {
    return add(transformed(from_[mesh], transform));
  }

 private:
  static constexpr std::uint32_t kUnused = 0xffffffff;
  std::uint32_t add(Mesh mesh) {
    if (mesh.material >= model_.materials.size()) mesh.material = 0;
    model_.meshes.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(model_.meshes.size() - 1);
  }

  std::vector<Mesh>& from_;
  Model& model_;
  std::vector<std::uint32_t> index_;
};

/// The frame that an object's meshes share: that of its first part, unless that one is flat and
/// the others cannot be brought into it.
Eigen::Affine3d sharedFrame(const ObjectDraft& draft, const Vec3& offset) {
  const Eigen::Affine3d& first = draft.placements.front().worldFromMesh;
  const bool oneFrame =
      std::all_of(draft.placements.begin(), draft.placements.end(),
                  [&](const auto& p) { return p.worldFromMesh.matrix() == first.matrix(); });
  if (oneFrame || first.linear().determinant() != 0) return first;
  return Eigen::Affine3d(Eigen::Translation3d(offset));
}

/// One transform an object: parts that lie otherwise are moved into the shared frame.
Object finishObject(const ObjectDraft& draft, const Vec3& offset, MeshTable& meshes) {
  Object object = draft.object;
  const Eigen::Affine3d frame = sharedFrame(draft, offset);
  for (const auto& p : draft.placements) {
    if (p.worldFromMesh.matrix() == frame.matrix()) {
      object.meshes.push_back(meshes.shared(p.mesh));
    } else {
      const Eigen::Affine3d frameFromMesh = frame.inverse(Eigen::Affine) * p.worldFromMesh;
      object.meshes.push_back(meshes.moved(p.mesh, frameFromMesh));
    }
  }
  object.worldFromMesh = Eigen::Translation3d(-offset) * frame;
  if (object.worldFromPlacement) object.worldFromPlacement->pretranslate(-offset);
  return object;
}

/// How far from `centre` a box begins, and how far its farthest corner is.
struct Reach {
  double nearest, farthest;
};

Reach reachOf(const Box& box, const Vec3& centre) {
  const Vec3 low = box.min - centre, high = box.max - centre;
  return {low.cwiseMax(-high).cwiseMax(Vec3::Zero()).norm(),
          low.cwiseAbs().cwiseMax(high.cwiseAbs()).norm()};
}

/// Drops what no world could hold, and strays: objects that begin farther from the scene's centre
/// than kStrayFactor times the median object reaches (and a kilometre), if they are few. A stray
/// would stretch the scene's bounds over nothing.
void dropFarObjects(std::vector<ObjectDraft>& drafts, std::vector<Box>& boxes,
                    ProblemLog& problems) {
  if (drafts.empty()) return;
  const Vec3 centre = medianCentre(boxes);
  std::vector<double> reaches;
  for (const Box& box : boxes) reaches.push_back(reachOf(box, centre).farthest);
  const double limit = std::max(kFarAway, kStrayFactor * median(reaches));
  const auto isStray = [&](const Box& box) { return !(reachOf(box, centre).nearest <= limit); };
  const auto strays = static_cast<double>(std::count_if(boxes.begin(), boxes.end(), isStray));
  // Of two things that lie far apart, none is the stray.
  const bool few =
      boxes.size() > 2 && strays <= std::max(1.0, kMostStrays * static_cast<double>(boxes.size()));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const Reach reach = reachOf(boxes[i], centre);
    if (!(reach.farthest <= kGreatest) || (few && isStray(boxes[i]))) {
      problems.add("far_object_dropped", drafts[i].object.path + ": " +
                                             std::to_string(std::llround(reach.nearest)) +
                                             " m from the middle of the others");
      continue;
    }
    if (isStray(boxes[i])) problems.add("far_object", drafts[i].object.path);
    if (!isStray(boxes[i]) && reach.farthest > kWildFactor * limit) {
      problems.add("far_reaching_object", drafts[i].object.path + ": as far as " +
                                              std::to_string(std::llround(reach.farthest)) + " m");
    }
    if (kept != i) {
      drafts[kept] = std::move(drafts[i]);
      boxes[kept] = boxes[i];
    }
    ++kept;
  }
  drafts.resize(kept);
  boxes.resize(kept);
}

void countOddPlacements(const std::vector<ObjectDraft>& drafts, ProblemLog& problems) {
  for (const ObjectDraft& draft : drafts) {
    const double determinant = draft.placements.front().worldFromMesh.linear().determinant();
    if (determinant < 0) problems.add("mirrored_object", draft.object.path);
    if (determinant == 0) problems.add("flat_object", draft.object.path);
  }
}

}  // namespace

Eigen::Matrix3d yUpFrom(char up) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (up == 'z') turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  if (up == 'x') turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return turn;
}

void ProblemLog::add(const std::string& kind, const std::string& example, std::size_t count) {
  if (count == 0) return;
  for (Problem& problem : problems_) {
    if (problem.kind != kind) continue;
    problem.count += count;
    return;
  }
  problems_.push_back({kind, count, example});
}

/// assimp leaves out triangles of vertices that are not there, in silence.
void tellLostTriangles(const aiScene& scene, const FileFacts& facts, ProblemLog& problems) {
  std::size_t read = 0;
  for (const aiMesh* mesh : std::span(scene.mMeshes, scene.mNumMeshes)) {
    for (const aiFace& face : std::span(mesh->mFaces, mesh->mNumFaces))
      read += face.mNumIndices == 3 ? 1 : 0;
  }
  if (facts.triangles && read < *facts.triangles)
    problems.add("broken_triangle_dropped", "indices of vertices that are not there",
                 *facts.triangles - read);
}

Model convertScene(const aiScene& scene, const std::vector<FileMaterial>& materials,
                   const ConvertInput& input, const ImportProgress& progress) {
  Model model;
  model.reader = "assimp";
  ProblemLog problems;
  for (const Problem& problem : input.facts.problems) {
    // A unit that the user gave is not a guess.
    const bool aboutUnit = problem.kind == "no_unit" || problem.kind == "unit_assumed";
    if (aboutUnit && input.metresPerUnit) continue;
    problems.add(problem.kind, problem.example, problem.count);
  }
  model.metresPerUnit = input.metresPerUnit.value_or(input.facts.metresPerUnit);
  model.up = input.up.value_or(input.facts.up);
  convertMaterials(scene, materials, input, model, problems, progress);

  if (progress) progress("convert", 0);
  std::vector<Mesh> meshes = convertMeshes(scene, problems);
  tellLostTriangles(scene, input.facts, problems);
  Eigen::Affine3d worldFromRoot = Eigen::Affine3d::Identity();
  worldFromRoot.linear() =
      yUpFrom(model.up) * model.metresPerUnit * assimpFromFile(input.facts, input.format).inverse();
  worldFromRoot.translate(input.shift);
  const bool gltf = input.format == ModelFormat::gltf || input.format == ModelFormat::glb;
  const GltfNodes exact = gltf ? exactGltfNodes(scene, input.file, input.format) : GltfNodes();
  NodePlaces places;
  std::vector<ObjectDraft> drafts =
      collectObjects(scene, input.format, worldFromRoot, exact, meshes, problems, places);
  if (progress) progress("convert", 0.5);

  finishModel(std::move(drafts), std::move(meshes), input.file, input.offset, model, problems);
  model.problems = problems.problems();
  std::set<std::uint32_t> still;
  if (gltf) still = addGltfBodies(input.file, input.format, places, model);
  if (input.format != ModelFormat::ifc) addNamedBodies(model, still);
  return model;
}

void finishModel(std::vector<ObjectDraft> drafts, std::vector<Mesh> meshes,
                 const std::filesystem::path& file, const std::optional<Vec3>& offset, Model& model,
                 ProblemLog& problems) {
  std::vector<Box> meshBoxes, objectBoxes;
  for (const Mesh& mesh : meshes) meshBoxes.push_back(boxOf(mesh));
  recentreMeshes(drafts, meshes, meshBoxes, problems);
  for (const ObjectDraft& draft : drafts) objectBoxes.push_back(boxOf(draft, meshBoxes));
  dropFarObjects(drafts, objectBoxes, problems);
  if (drafts.empty()) {
    throw ImportError(file.string() + ": holds no triangles that can be used; export it with " +
                      "meshes (convert)");
  }
  model.offset = offset.value_or(sceneOffset(objectBoxes));
  countOddPlacements(drafts, problems);
  MeshTable table(meshes, model);
  for (const ObjectDraft& draft : drafts) {
    model.objects.push_back(finishObject(draft, model.offset, table));
  }
}

}  // namespace enfilade::scene
