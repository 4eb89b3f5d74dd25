// Rewrites the primitives of glTF meshes: floats instead of quantized, compressed or sparse data,
// and triangles instead of strips and fans. Private to the import.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/gltf/encoding/draco_mesh.hpp"
#include "scene/import/gltf/encoding/gltf_binary.hpp"
#include "scene/import/gltf/encoding/texture_mapping.hpp"
#include "scene/import/gltf/gltf_buffers.hpp"
#include "scene/import/gltf/gltf_rest_pose.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

class PlainPrimitives {
 public:
  /// All arguments must outlive this object.
  PlainPrimitives(const nlohmann::json& gltf, GltfBuffers& buffers, GltfBinary& binary,
                  std::vector<Diagnostic>& problems)
      : gltf_(gltf), buffers_(buffers), binary_(binary), problems_(problems) {}

  /// Rewrites one primitive in place. It keeps its material, positions, normals, vertex colours
  /// and the texture coordinates that its material uses; `name` is for errors. Throws ImportError.
  void rewrite(nlohmann::json& primitive, const std::string& name);
  /// As rewrite(), with the vertices in a rest pose.
  void rewritePosed(nlohmann::json& primitive, const std::string& name, const RestPose& pose);

 private:
  /// A Draco mesh whose arrays were written.
  struct WrittenDraco {
    std::size_t indices = 0, vertices = 0;
    std::map<std::string, std::size_t> attributes;
  };
  using Widths = std::map<std::string, std::size_t>;

  Widths listAttributes(const nlohmann::json& attributes, const TextureMapping& mapping,
                        const std::string& name);
  std::size_t findColourWidth(const nlohmann::json& attributes, const std::string& name);
  DracoMesh decodeDraco(const nlohmann::json& extension, const nlohmann::json& attributes,
                        const Widths& widths, const std::string& name);
  PrimitiveArrays readArrays(nlohmann::json& primitive, const nlohmann::json& attributes,
                             const Widths& widths, const std::string& name);
  const WrittenDraco& writeDraco(const nlohmann::json& extension, const nlohmann::json& attributes,
                                 const Widths& widths, const TextureMapping& mapping,
                                 const std::string& name);
  std::size_t writeAttribute(const std::string& attribute, std::size_t accessor, std::size_t width,
                             const TextureMapping& mapping);
  std::size_t writeFloats(const std::string& attribute, std::vector<float> values,
                          std::size_t width, const TextureMapping& mapping);
  bool tryAttribute(const std::string& attribute, const std::string& name,
                    const std::function<void()>& read);
  void requireTriangle(const std::vector<std::uint32_t>& corners, std::size_t vertices,
                       const std::string& name) const;
  void rewriteIndices(nlohmann::json& primitive, std::size_t vertices, const std::string& name);
  bool isNormalised(const nlohmann::json& accessor) const;
  std::size_t countElements(std::size_t accessor) const;

  const nlohmann::json& gltf_;
  GltfBuffers& buffers_;
  GltfBinary& binary_;
  std::vector<Diagnostic>& problems_;
  std::map<std::string, std::size_t> written_;  // new accessors, by what they were made of
  std::map<std::string, WrittenDraco> writtenDraco_;
};

/// The corners of the triangles of a strip (`mode` 5) or fan (6), in glTF's order (3.7.2.1). Of a
/// strip, triangles that repeat a corner are left out: they only join its pieces.
std::vector<std::uint32_t> unrollTriangles(const std::vector<std::uint32_t>& corners,
                                           std::size_t mode);

}  // namespace enfilade::scene
