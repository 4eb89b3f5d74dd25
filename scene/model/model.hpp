// Model: the result of an import. Meshes are stored once; objects place them.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "collision/types.hpp"
#include "scene/model/body_spec.hpp"
#include "scene/model/up_axis.hpp"

namespace enfilade::scene {

using collision::Aabb;
using collision::Vec3;

/// glTF's metallic-roughness subset. Colours are linear RGBA, 0..1.
struct Material {
  enum class Alpha : std::uint8_t { opaque, mask, blend };

  std::string name;
  Eigen::Vector4f baseColour{0.8f, 0.8f, 0.8f, 1.0f};
  Eigen::Vector3f emissive{0, 0, 0};
  float metallic = 0;
  float roughness = 1;
  Alpha alpha = Alpha::opaque;
  float alphaCutoff = 0.5f;
  bool doubleSided = false;
  std::int32_t baseColourTexture = -1;  ///< index into Model::textures, -1: none
};

/// 8-bit sRGB with linear alpha, row 0 at the top, 4 bytes a pixel.
struct Texture {
  std::string name;
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};

/// 8-bit sRGB with linear alpha.
using VertexColour = std::array<std::uint8_t, 4>;

/// Triangles of one material, in the mesh's own frame and unit. Counter-clockwise is the outside.
struct Mesh {
  std::string name;
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;  ///< empty, or one per position; unit length
  std::vector<Eigen::Vector2f> uvs;  ///< empty, or one per position; (0,0) is the image's top left
  /// Empty, or one per position; they multiply the material's base colour.
  std::vector<VertexColour> colours;
  std::vector<std::uint32_t> indices;  ///< three per triangle
  std::uint32_t material = 0;

  std::size_t triangleCount() const { return indices.size() / 3; }
};

/// A property of an object that its file defines, such as "_ID" of an instance (glTF).
struct ObjectAttribute {
  std::string name;
  std::vector<double> values;  ///< finite
  bool operator==(const ObjectAttribute&) const = default;
};

/// A node that carries meshes, as a person would name it. Its id is its index.
struct Object {
  /// If a file has a simpler shape for collision, the object itself is visual only, and the shape
  /// is collision only.
  enum class Usage : std::uint8_t { both, visualOnly, collisionOnly };

  std::string path;  ///< stable and unique: names from the root joined by '/', repeats as name#2
  std::string globalId;               ///< IFC GlobalId, or empty
  std::vector<std::uint32_t> meshes;  ///< indices into Model::meshes
  /// Metres, Y up, offset removed; may mirror and scale non-uniformly. If its determinant is
  /// negative, counter-clockwise in the mesh is clockwise in the world.
  Eigen::Affine3d worldFromMesh = Eigen::Affine3d::Identity();
  std::string ifcClass = {};  ///< such as "IfcDoor", "IfcTransportElement"; or empty
  std::string operationType =
      {};  ///< IFC OperationType or similar: "SINGLE_SWING_LEFT", "ELEVATOR"
  /// IFC OverallWidth and OverallHeight of doors and windows in metres; 0: unknown.
  double overallWidth = 0, overallHeight = 0;
  /// Placement of an IFC product, in metres and without scale; null: unknown. Its axes are IFC's.
  /// For a door, x runs along its width from the lower corner, y is the side to which it opens, z
  /// is up. Stored outside the object, because few objects have one.
  std::shared_ptr<const Eigen::Affine3d> worldFromPlacement = nullptr;
  Usage usage = Usage::both;
  /// The storey that contains it: an index into Model::storeys; nullopt: unknown.
  std::optional<std::uint32_t> storey = std::nullopt;
  /// The object that this one is a part of, by which people name it. For a collision shape it is
  /// the drawn object, for a door's frame the door.
  std::optional<std::uint32_t> partOf = std::nullopt;
  /// Its class, as "chair", by the sidecar or the node's extras; empty: unknown.
  std::string className = {};
  /// The first object of those that are one thing by the sidecar or the node's extras.
  std::optional<std::uint32_t> thing = std::nullopt;
  std::vector<ObjectAttribute> attributes = {};  ///< by ascending names
};

/// A level of a building, as an IfcBuildingStorey.
struct Storey {
  std::string name;      ///< may be empty
  std::string globalId;  ///< IFC GlobalId, or empty
  double elevation = 0;  ///< metres: y of its floor in the scene frame
};

/// A room or another part of a building that is air, as an IfcSpace.
struct Space {
  std::string name;                                    ///< such as a number; may be empty
  std::string longName;                                ///< such as "Living room"; may be empty
  std::string globalId;                                ///< IFC GlobalId, or empty
  std::optional<std::uint32_t> storey = std::nullopt;  ///< an index into Model::storeys
  Aabb box;                                            ///< scene frame, metres; may be empty
  /// Three corners per triangle of its surface, scene frame, metres; in the box. Empty: the box is
  /// its solid.
  std::vector<Vec3> surface = {};
};

/// A finding about the file for the user: degenerate triangles, missing textures, ...
struct Diagnostic {
  std::string kind;  ///< a short stable identifier, such as "missing_texture"
  std::size_t count = 0;
  std::string example;  ///< the first occurrence
};

struct Model {
  std::string source;  ///< the file's path as given, or the generator's name
  std::string reader;  ///< reader of the file: "assimp", "web-ifc", "ifcplusplus"; otherwise empty
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Mesh> meshes;
  std::vector<Storey> storeys;  ///< ascending elevations; empty: the file states none
  std::vector<Space> spaces;
  std::vector<Object> objects;
  std::vector<BodySpec> bodies;  ///< Scene rejects a model with invalid bodies

  double metresPerUnit = 1;  ///< assumed unit of the file
  /// Name of the map whose coordinates the file's are, such as "EPSG:25832": x east, y up, -z
  /// north. Empty: not on a map.
  std::string map;
  /// Direction of true north in the scene: its x and z, unit length. nullopt: unknown.
  std::optional<Eigen::Vector2d> north;
  /// Names of the scenes in the file (glTF), of which `fileScene` was read; a name may be empty.
  std::vector<std::string> fileScenes;
  std::uint32_t fileScene = 0;
  UpAxis upAxis = UpAxis::y;  ///< the file's up axis; coordinates are already converted to Y up
  /// Subtracted from the file's coordinates (metres, Y up) so that the scene lies near its origin;
  /// zero unless the scene lies far from it. file = scene + offset.
  Vec3 offset = Vec3::Zero();
  std::vector<Diagnostic> diagnostics;
  /// Other files that were read or looked up, possibly repeated or missing: their content affects
  /// the model.
  std::vector<std::string> dependencies;
};

/// Returns for each object the body that contains it, or null.
inline std::vector<const BodySpec*> mapObjectsToBodies(const Model& model) {
  std::vector<const BodySpec*> bodies(model.objects.size());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) bodies[object] = &body;
  return bodies;
}

/// Validates all bodies of the model; an error text names body and field.
std::optional<std::string> validateBodies(const Model& model);

/// The mesh's material; a default material if the mesh of a hand-made model has none.
const Material& findMaterial(const Model& model, const Mesh& mesh);

/// World position of a vertex. Always use this expression, so that all results agree to the last
/// bit.
inline Vec3 computeWorldPosition(const Object& object, const Mesh& mesh, std::uint32_t vertex) {
  return object.worldFromMesh * mesh.positions[vertex].cast<double>();
}

}  // namespace enfilade::scene
