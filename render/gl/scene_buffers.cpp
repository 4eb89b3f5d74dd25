#include "render/gl/scene_buffers.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <string>

#include "collision/assert.hpp"
#include "render/render_error.hpp"
#include "render/vertex.hpp"

namespace enfilade::render {
namespace {

struct BufferSizes {
  std::uint64_t vertices = 0, indices = 0;
  std::uint64_t colours = 0;  ///< vertices of meshes with colours
};

/// Lays out the meshes consecutively, those with vertex colours first, so that their colours need a
/// buffer for these alone. Throws RenderError if the indices overflow.
BufferSizes layOutMeshes(const scene::Model& model, std::vector<MeshRange>& ranges) {
  BufferSizes totals;
  ranges.resize(model.meshes.size());
  for (const bool coloured : {true, false}) {
    for (std::size_t m = 0; m < ranges.size(); ++m) {
      const scene::Mesh& mesh = model.meshes[m];
      if (mesh.colours.empty() == coloured) continue;
      scene::Aabb box;
      for (const Eigen::Vector3f& position : mesh.positions) box.include(position.cast<double>());
      ranges[m] = {static_cast<std::uint32_t>(totals.indices),
                   static_cast<std::uint32_t>(mesh.indices.size()),
                   static_cast<std::int32_t>(totals.vertices),
                   box.empty() ? Vec3(Vec3::Zero()) : box.centre()};
      totals.vertices += mesh.positions.size();
      totals.indices += mesh.indices.size();
    }
    if (coloured) totals.colours = totals.vertices;
  }
  if (totals.vertices > std::numeric_limits<std::int32_t>::max() ||
      totals.indices > std::numeric_limits<std::uint32_t>::max()) {
    throw RenderError("the model " + model.source + " has " + std::to_string(totals.vertices) +
                      " vertices and " + std::to_string(totals.indices) +
                      " indices, more than one buffer can hold; load a part of it");
  }
  return totals;
}

std::vector<Vertex> makeVertices(const scene::Mesh& mesh, const Vec3& centre) {
  std::vector<Vertex> vertices(mesh.positions.size());
  const bool normals = mesh.normals.size() == mesh.positions.size();
  const bool uvs = mesh.uvs.size() == mesh.positions.size();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3 p = mesh.positions[i].cast<double>() - centre;
    vertices[i] = {
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())},
        normals ? packNormal(mesh.normals[i]) : 0u,
        {uvs ? mesh.uvs[i].x() : 0.0f, uvs ? mesh.uvs[i].y() : 0.0f}};
  }
  return vertices;
}

/// An unusable texture becomes white; the importer has already reported missing textures.
GlTexture uploadTexture(const scene::Texture& texture, GLint maxSize) {
  const auto width = static_cast<GLsizei>(texture.width);
  const auto height = static_cast<GLsizei>(texture.height);
  const bool usable = width > 0 && height > 0 && width <= maxSize && height <= maxSize &&
                      texture.rgba.size() == std::size_t{4} * texture.width * texture.height;
  constexpr std::uint32_t kWhiteTexel = 0xFFFFFFFFu;
  const void* pixels = usable ? static_cast<const void*>(texture.rgba.data()) : &kWhiteTexel;
  const GLsizei w = usable ? width : 1;
  const GLsizei h = usable ? height : 1;
  const auto levels = static_cast<GLsizei>(std::bit_width(static_cast<unsigned>(std::max(w, h))));

  GlTexture result = GlTexture::create();
  const GLuint name = result.name();
  glTextureStorage2D(name, levels, GL_SRGB8_ALPHA8, w, h);
  glTextureSubImage2D(name, 0, 0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, pixels);
  glGenerateTextureMipmap(name);
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return result;
}

GlBuffer makeBuffer(std::uint64_t bytes) {
  GlBuffer buffer = GlBuffer::create();
  glNamedBufferStorage(buffer.name(), static_cast<GLsizeiptr>(std::max<std::uint64_t>(bytes, 4)),
                       nullptr, GL_DYNAMIC_STORAGE_BIT);
  return buffer;
}

void writeBuffer(const GlBuffer& buffer, std::uint64_t offset, const void* data,
                 std::uint64_t bytes) {
  if (bytes == 0) return;
  glNamedBufferSubData(buffer.name(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes),
                       data);
}

}  // namespace

SceneBuffers uploadModel(const scene::Model& model) {
  SceneBuffers buffers;
  const BufferSizes totals = layOutMeshes(model, buffers.ranges);
  ENFILADE_ASSERT(buffers.ranges.size() == model.meshes.size());
  buffers.vertices = makeBuffer(totals.vertices * sizeof(Vertex));
  buffers.indices = makeBuffer(totals.indices * sizeof(std::uint32_t));
  buffers.colours = makeBuffer(totals.colours * sizeof(scene::VertexColour));
  checkGl("making the model's buffers");
  for (std::size_t m = 0; m < model.meshes.size(); ++m) {
    const scene::Mesh& mesh = model.meshes[m];
    const MeshRange& range = buffers.ranges[m];
    const std::vector<Vertex> vertices = makeVertices(mesh, range.centre);
    writeBuffer(buffers.vertices,
                std::uint64_t{sizeof(Vertex)} * static_cast<unsigned>(range.baseVertex),
                vertices.data(), vertices.size() * sizeof(Vertex));
    writeBuffer(buffers.indices, std::uint64_t{sizeof(std::uint32_t)} * range.firstIndex,
                mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
    writeBuffer(
        buffers.colours,
        std::uint64_t{sizeof(scene::VertexColour)} * static_cast<unsigned>(range.baseVertex),
        mesh.colours.data(), mesh.colours.size() * sizeof(scene::VertexColour));
    buffers.materials.push_back(makeMaterialData(model, mesh));
  }
  checkGl("uploading the model's meshes");
  GLint maxSize = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &maxSize);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (const scene::Texture& texture : model.textures) {
    buffers.textures.push_back(uploadTexture(texture, maxSize));
  }
  checkGl("uploading the model's textures");
  return buffers;
}

}  // namespace enfilade::render
