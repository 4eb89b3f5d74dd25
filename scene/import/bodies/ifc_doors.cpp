#include "scene/import/bodies/ifc_doors.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "collision/assert.hpp"
#include "scene/import/bodies/door_leaf.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr double kRightAngle = 1.5707963267948966;  // radians
constexpr double kMinUprightCosine = 0.999;  // cosine between a door's z axis and the scene's up
constexpr double kSlidingSpeed = 1;          // m/s

/// Motion of one leaf, in the door frame.
struct LeafMotion {
  bool slides = false;
  int side = -1;  ///< hinges at the low (-1) or high (1) end of x; or sliding direction
  bool swingsBothWays = false;  ///< hinged: opens to both sides of the wall
};

/// Motion of all leaves of a door.
struct DoorMotion {
  std::vector<LeafMotion> leaves;
  bool isGuessed = false;
};

DoorMotion guessMotion(const DoorPieces& pieces) {
  DoorMotion motion{{}, true};
  const bool two = pieces.leaves.size() == 2;
  ENFILADE_ASSERT(!two || pieces.leaves[0].panel.min.x() <= pieces.leaves[1].panel.min.x());
  for (std::size_t i = 0; i < pieces.leaves.size(); ++i) {
    const int latch = pieces.leaves[i].latch;
    const int hingeSide = latch == 0 ? -1 : -latch;
    motion.leaves.push_back({false, two ? (i == 0 ? -1 : 1) : hingeSide, true});
  }
  return motion;
}

/// Returns the motion of an operation; nullopt if it is not modelled or does not fit the drawn
/// leaves. Left is the low end of x, seen along y with z up.
std::optional<DoorMotion> findMotion(std::string_view operation, const DoorPieces& pieces) {
  static const std::map<std::string_view, std::vector<LeafMotion>> kMotions{
      {"SINGLE_SWING_LEFT", {{false, -1, false}}},
      {"SINGLE_SWING_RIGHT", {{false, 1, false}}},
      {"DOUBLE_SWING_LEFT", {{false, -1, true}}},
      {"DOUBLE_SWING_RIGHT", {{false, 1, true}}},
      {"DOUBLE_DOOR_SINGLE_SWING", {{false, -1, false}, {false, 1, false}}},
      {"DOUBLE_DOOR_DOUBLE_SWING", {{false, -1, true}, {false, 1, true}}},
      {"SLIDING_TO_LEFT", {{true, -1, false}}},
      {"SLIDING_TO_RIGHT", {{true, 1, false}}},
      {"DOUBLE_DOOR_SLIDING", {{true, -1, false}, {true, 1, false}}}};
  // Readers do not agree on the side to which each of these leaves opens.
  static const std::set<std::string_view> kOpen{"", "NOTDEFINED", "USERDEFINED",
                                                "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_LEFT",
                                                "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_RIGHT"};
  if (kOpen.contains(operation)) return guessMotion(pieces);
  const auto known = kMotions.find(operation);
  if (known == kMotions.end() || known->second.size() != pieces.leaves.size()) return std::nullopt;
  if (pieces.hasSwappedAxes && !known->second[0].slides) return guessMotion(pieces);
  return DoorMotion{known->second, false};
}

BodySpec makeBodySpec(const Object& door, const DoorPieces& pieces, const DoorLeaf& leaf,
                      const LeafMotion& motion) {
  Eigen::Matrix3d worldFromDoor = door.worldFromPlacement->linear();
  if (pieces.hasSwappedAxes) worldFromDoor.col(0).swap(worldFromDoor.col(1));
  const auto inWorld = [&](const Vec3& p) -> Vec3 {
    return worldFromDoor * p + door.worldFromPlacement->translation();
  };
  const Aabb& panel = leaf.panel;
  BodySpec body;
  body.source = BodySource::ifc;
  body.openedBy = OpenedBy::touch;
  if (motion.slides) {
    body.kind = BodyKind::sliding;
    body.axis = (motion.side * worldFromDoor.col(0)).normalized();
    body.anchor = inWorld(panel.centre());
    body.high = panel.size().x();
    body.speed = kSlidingSpeed;
    return body;
  }
  body.kind = BodyKind::hinged;
  body.axis = Vec3::UnitY();
  body.speed = kRightAngle;
  // It opens towards y: about +z with hinges at the low end, about -z with hinges at the high end.
  body.low = motion.swingsBothWays || motion.side > 0 ? -kRightAngle : 0;
  body.high = motion.swingsBothWays || motion.side < 0 ? kRightAngle : 0;
  body.anchor =
      inWorld({motion.side < 0 ? panel.min.x() : panel.max.x(),
               motion.swingsBothWays ? panel.centre().y() : panel.max.y(), panel.min.z()});
  return body;
}

/// Extracts meshes of subsets of triangles, each subset once.
class MeshSplitter {
 public:
  explicit MeshSplitter(Model& model) : model_(model) {}

  /// Returns the meshes of the triangles whose entry in `pieces` is `piece`; may be empty.
  std::vector<std::uint32_t> extractMeshes(const std::vector<std::uint32_t>& meshes,
                                           const std::vector<std::uint8_t>& pieces,
                                           std::uint8_t piece) {
    std::vector<std::uint32_t> result;
    std::size_t begin = 0;
    for (const std::uint32_t mesh : meshes) {
      const std::size_t count = model_.meshes[mesh].triangleCount();
      std::vector<bool> wanted;
      for (std::size_t i = begin; i < begin + count; ++i) wanted.push_back(pieces[i] == piece);
      begin += count;
      if (const auto made = extractMesh(mesh, wanted)) result.push_back(*made);
    }
    return result;
  }

 private:
  std::optional<std::uint32_t> extractMesh(std::uint32_t mesh, const std::vector<bool>& wanted) {
    const auto kept = std::count(wanted.begin(), wanted.end(), true);
    if (kept == 0) return std::nullopt;
    if (static_cast<std::size_t>(kept) == wanted.size()) return mesh;
    const auto next = static_cast<std::uint32_t>(model_.meshes.size());
    const auto [known, isNew] = extracted_.try_emplace({mesh, wanted}, next);
    if (isNew) model_.meshes.push_back(cutMesh(model_.meshes[mesh], wanted));
    return known->second;
  }

  static Mesh cutMesh(const Mesh& mesh, const std::vector<bool>& wanted) {
    Mesh result;
    result.name = mesh.name;
    result.material = mesh.material;
    std::map<std::uint32_t, std::uint32_t> numbers;
    for (std::size_t i = 0; i < 3 * wanted.size(); ++i) {
      if (!wanted[i / 3]) continue;
      const std::uint32_t from = mesh.indices[i];
      const auto [at, isNew] =
          numbers.try_emplace(from, static_cast<std::uint32_t>(result.positions.size()));
      result.indices.push_back(at->second);
      if (!isNew) continue;
      result.positions.push_back(mesh.positions[from]);
      if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[from]);
      if (!mesh.uvs.empty()) result.uvs.push_back(mesh.uvs[from]);
      if (!mesh.colours.empty()) result.colours.push_back(mesh.colours[from]);
    }
    return result;
  }

  Model& model_;
  std::map<std::pair<std::uint32_t, std::vector<bool>>, std::uint32_t> extracted_;
};

/// Removes meshes that no object uses after the split.
void dropUnusedMeshes(Model& model, std::size_t before) {
  std::vector<bool> used(model.meshes.size());
  for (const Object& object : model.objects)
    for (const std::uint32_t mesh : object.meshes) used[mesh] = true;
  std::vector<std::uint32_t> number(model.meshes.size());
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < number.size(); ++i) {
    number[i] = kept;
    if (!used[i] && i < before) continue;
    if (kept != i) model.meshes[kept] = std::move(model.meshes[i]);
    ++kept;
  }
  model.meshes.resize(kept);
  for (Object& object : model.objects)
    for (std::uint32_t& mesh : object.meshes) mesh = number[mesh];
}

class DoorSplitter {
 public:
  DoorSplitter(Model& model, bool theyOpen) : model_(model), theyOpen_(theyOpen), meshes_(model) {
    for (const Object& object : model.objects) paths_.insert(object.path);
  }

  void split(std::uint32_t index) {
    const Object door = model_.objects[index];
    if (!door.worldFromPlacement) return reportStatic(door, "its placement is not known");
    if (!(door.worldFromPlacement->linear().col(2).y() > kMinUprightCosine))
      return reportStatic(door, "it is not upright");
    const DoorPieces pieces = splitDoorTriangles(model_, door);
    if (pieces.leaves.empty()) return reportStatic(door, pieces.reason);
    const std::optional<DoorMotion> motion = findMotion(door.operationType, pieces);
    if (!motion)
      return reportStatic(door, door.operationType + " does not match " +
                                    std::to_string(pieces.leaves.size()) +
                                    " leaves, or is not modelled");
    if (theyOpen_ && motion->isGuessed) reportGuess(door, *motion);
    for (std::uint8_t leaf = 0; leaf < pieces.leaves.size(); ++leaf) {
      BodySpec body = makeBodySpec(door, pieces, pieces.leaves[leaf], motion->leaves[leaf]);
      body.objects = {leaf == 0 ? index : addPiece(door, index, pieces, leaf, "/leaf2")};
      body.name = model_.objects[body.objects[0]].path;
      bodies.push_back(std::move(body));
    }
    addPiece(door, index, pieces, DoorPieces::kFrame, "/frame");
    model_.objects[index].meshes = meshes_.extractMeshes(door.meshes, pieces.pieceOfTriangle, 0);
  }

  std::vector<BodySpec> bodies;

 private:
  void reportStatic(const Object& door, const std::string& reason) {
    addDiagnostic(model_.diagnostics, "still_doors", door.path + ": " + reason);
  }

  void reportGuess(const Object& door, const DoorMotion& motion) {
    const std::string operation =
        door.operationType.empty() ? "no OperationType" : door.operationType;
    const std::string how = motion.leaves.size() == 2   ? "two leaves that swing both ways"
                            : motion.leaves[0].side < 0 ? "hinged at the left, swings both ways"
                                                        : "hinged at the right, swings both ways";
    addDiagnostic(model_.diagnostics, "guessed_doors",
                  door.path + ": " + operation + "; " + how + "; a sidecar can override this");
  }

  /// Returns the new object's index, or the door's own if the piece is empty.
  std::uint32_t addPiece(const Object& door, std::uint32_t index, const DoorPieces& pieces,
                         std::uint8_t piece, const char* name) {
    Object object = door;
    object.meshes = meshes_.extractMeshes(door.meshes, pieces.pieceOfTriangle, piece);
    if (object.meshes.empty()) return index;
    object.path = door.path + name;
    for (int number = 2; !paths_.insert(object.path).second; ++number)
      object.path = door.path + name + "#" + std::to_string(number);
    object.globalId.clear();
    object.partOf = index;
    model_.objects.push_back(std::move(object));
    return static_cast<std::uint32_t>(model_.objects.size() - 1);
  }

  Model& model_;
  const bool theyOpen_;
  MeshSplitter meshes_;
  std::set<std::string> paths_;
};

}  // namespace

std::vector<BodySpec> splitDoors(Model& model, bool theyOpen) {
  std::vector<std::uint32_t> doors;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const std::string& word = model.objects[i].ifcClass;
    if (word == "IfcDoor" || word == "IfcDoorStandardCase") doors.push_back(i);
  }
  if (doors.empty()) return {};
  const std::size_t before = model.meshes.size();
  DoorSplitter splitter(model, theyOpen);
  for (const std::uint32_t door : doors) splitter.split(door);
  dropUnusedMeshes(model, before);
  return std::move(splitter.bodies);
}

}  // namespace enfilade::scene
