#include "scene/import/bodies/collect_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "scene/import/bodies/body_precedence.hpp"
#include "scene/import/bodies/ifc_doors.hpp"
#include "scene/import/bodies/sidecar.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/rotation.hpp"
#include "scene/model/shapes/collision_geometry.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kMaxSidecarBytes = std::size_t{64} << 20;  // bytes

std::string readFile(const std::filesystem::path& file) {
  std::error_code problem;
  const auto size = std::filesystem::file_size(file, problem);
  if (!problem && size > kMaxSidecarBytes)
    throw SidecarError(file.string() + ": is larger than 64 MiB; is it a sidecar?");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream || stream.bad()) throw SidecarError(file.string() + ": cannot be read");
  return text.str();
}

Sidecar applySidecarFile(Model& model, const std::filesystem::path& file) {
  const std::filesystem::path sidecar = makeSidecarPath(file);
  std::error_code problem;
  if (!std::filesystem::exists(sidecar, problem)) return {};
  return applySidecar(model, readFile(sidecar), sidecar.filename().string());
}

bool hasSurface(const Mesh& mesh) {
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) -> Vec3 {
      return mesh.positions[mesh.indices[i + k]].cast<double>();
    };
    if (hasNumericalArea({corner(0), corner(1), corner(2)})) return true;
  }
  return false;
}

/// Drops bodies of imported files that have no surface to collide with, and counts them. Such a
/// file must not prevent loading. (In a sidecar it is an error.)
void dropBodiesWithoutArea(Model& model) {
  std::erase_if(model.bodies, [&](const BodySpec& body) {
    if (body.source == BodySource::sidecar) return false;
    for (const std::uint32_t index : body.objects) {
      const Object& object = model.objects[index];
      if (object.usage == Object::Usage::visualOnly) continue;
      for (const std::uint32_t mesh : object.meshes)
        if (hasSurface(model.meshes[mesh])) return false;
    }
    addDiagnostic(model.diagnostics, "body_without_area",
                  body.name + " of " + toString(body.source) + ": its objects have no surface");
    return true;
  });
}

/// Moves the objects of a door from the closed to the open end.
void openDoor(Model& model, const BodySpec& door) {
  const auto [low, high] = getJointLimits(door);
  const double end =
      std::abs(high - door.closedPosition) >= std::abs(low - door.closedPosition) ? high : low;
  Eigen::Affine3d motion = Eigen::Affine3d::Identity();
  if (getTraits(door.kind).rotates) {
    motion.linear() = makeAxisRotation(door.axis, end).toRotationMatrix();
    motion.translation() = door.anchor - motion.linear() * door.anchor;
  } else {
    motion.translation() = end * door.axis;
  }
  for (const std::uint32_t object : door.objects) {
    Object& leaf = model.objects[object];
    leaf.worldFromMesh = motion * leaf.worldFromMesh;
    leaf.worldFromPlacement.reset();  // it described the closed door
  }
}

/// Makes IFC's doors static: open, or without their leaves.
void fixDoors(Model& model, IfcDoors doors) {
  std::erase_if(model.bodies, [&](const BodySpec& body) {
    if (body.source != BodySource::ifc || !getTraits(body.kind).isDoor) return false;
    if (doors == IfcDoors::open) openDoor(model, body);
    if (doors == IfcDoors::absent)
      for (const std::uint32_t object : body.objects) model.objects[object].meshes.clear();
    return true;
  });
}

}  // namespace

const char* toString(IfcDoors doors) {
  switch (doors) {
    case IfcDoors::movable:
      return "move";
    case IfcDoors::fixed:
      return "still";
    case IfcDoors::open:
      return "open";
    case IfcDoors::absent:
      return "none";
  }
  return "";
}

IfcDoors parseIfcDoors(const std::string& text) {
  for (const IfcDoors doors : {IfcDoors::fixed, IfcDoors::open, IfcDoors::absent})
    if (text == toString(doors)) return doors;
  return IfcDoors::movable;
}

void collectBodies(Model& model, const std::filesystem::path& file, IfcDoors doors) {
  std::vector<BodySpec> ofFile = std::move(model.bodies), ofIfc;
  model.bodies.clear();
  // Doors are split before the sidecar is read, because it may name their leaves and frames.
  ofIfc = splitDoors(model, doors == IfcDoors::movable || doors == IfcDoors::open);
  const Sidecar sidecar = applySidecarFile(model, file);
  const auto firstOfIfc =
      std::stable_partition(ofFile.begin(), ofFile.end(),
                            [](const BodySpec& body) { return body.source != BodySource::ifc; });
  ofIfc.insert(ofIfc.end(), std::make_move_iterator(firstOfIfc),
               std::make_move_iterator(ofFile.end()));
  ofFile.erase(firstOfIfc, ofFile.end());
  mergeLowerPriorityBodies(model, std::move(ofFile), sidecar.staticObjects);
  if (doors != IfcDoors::fixed)
    mergeLowerPriorityBodies(model, std::move(ofIfc), sidecar.staticObjects);
  if (doors == IfcDoors::open || doors == IfcDoors::absent) fixDoors(model, doors);
  attachCollisionShapes(model);
  dropBodiesWithoutArea(model);
}

std::string formatBodySources(const Model& model) {
  std::map<BodySource, std::size_t> counts;
  for (const BodySpec& body : model.bodies) ++counts[body.source];
  std::string text;
  for (const auto& [source, count] : counts)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " of " + toString(source);
  return text;
}

}  // namespace enfilade::scene
