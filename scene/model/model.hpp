// What an importer delivers and everything else reads: meshes stored once, objects that place them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "collision/types.hpp"
#include "scene/model/body_spec.hpp"

namespace enfilade::scene {

using collision::Box;
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

/// Triangles of one material, in the mesh's own frame and unit. Counter-clockwise is outside.
struct Mesh {
  std::string name;
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;  ///< empty, or one a position; unit length
  std::vector<Eigen::Vector2f> uvs;    ///< empty, or one a position; (0,0) is the image's top left
  std::vector<std::uint32_t> indices;  ///< three a triangle
  std::uint32_t material = 0;
};

/// One thing a person would name: a node that carries meshes. Its id is its index.
struct Object {
  /// What it is there for. Where a file has a simpler shape for collision, the object itself is
  /// only drawn, and the shape is only solid.
  enum class Use : std::uint8_t { whole, drawn, solid };

  std::string path;  ///< stable and unique: names from the root joined by '/', repeats as name#2
  std::string globalId;               ///< IFC GlobalId, or empty
  std::vector<std::uint32_t> meshes;  ///< indices into Model::meshes
  /// metres, Y up, offset removed; may mirror and scale unequally. Where its determinant is
  /// negative, counter-clockwise in the mesh is clockwise in the world.
  Eigen::Affine3d worldFromMesh = Eigen::Affine3d::Identity();
  std::string ifcClass = {};   ///< as "IfcDoor", "IfcTransportElement", or empty
  std::string operation = {};  ///< IFC OperationType or its like: "SINGLE_SWING_LEFT", "ELEVATOR"
  /// IFC's OverallWidth and OverallHeight of doors and windows in metres; 0: not told.
  double overallWidth = 0, overallHeight = 0;
  /// Where an IFC product was placed, in metres and without scale; nullopt: not told. Its own axes
  /// are IFC's: of a door x runs along its width from the lower corner, y is the side to which it
  /// opens, z is up.
  std::optional<Eigen::Affine3d> worldFromPlacement = std::nullopt;
  Use use = Use::whole;
  /// The object that it is a piece of and that people would name: of a collision shape what is
  /// drawn in its place, of a door's frame the door.
  std::optional<std::uint32_t> pieceOf = std::nullopt;
};

/// Something the user should know about the file: degenerate triangles, missing textures, ...
struct Problem {
  std::string kind;  ///< a short stable word, as "missing_texture"
  std::size_t count = 0;
  std::string example;  ///< the first place it was met
};

struct Model {
  std::string source;  ///< the file's path as given, or the generator's name
  std::string reader;  ///< what read the file: "assimp", "web-ifc", "ifcplusplus"; else empty
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Mesh> meshes;
  std::vector<Object> objects;
  std::vector<BodySpec> bodies;  ///< what moves; Scene refuses a model whose bodies are wrong

  double metresPerUnit = 1;  ///< what one unit of the file was taken for
  char up = 'y';             ///< the file's up axis, already turned to Y
  /// Subtracted from the file's coordinates (in metres, Y up) so that the scene lies near its
  /// origin; zero unless the scene lies far from it. file = scene + offset.
  Vec3 offset = Vec3::Zero();
  std::vector<Problem> problems;
  /// Files beside `source` that were read or looked for, some of them twice or in vain: what they
  /// hold shaped the model as well.
  std::vector<std::string> filesBeside;
};

/// The world position of a vertex, always by this one expression, so that all who ask agree to the
/// last bit.
inline Vec3 worldPosition(const Object& object, const Mesh& mesh, std::uint32_t vertex) {
  return object.worldFromMesh * mesh.positions[vertex].cast<double>();
}

}  // namespace enfilade::scene
