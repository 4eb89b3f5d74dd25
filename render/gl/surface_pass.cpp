#include "render/gl/surface_pass.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "collision/assert.hpp"
#include "render/camera/camera.hpp"
#include "render/gl/shaders.hpp"

namespace enfilade::render {
namespace {

constexpr GLuint kVertexBinding = 0, kInstanceBinding = 1, kColourBinding = 2;
constexpr GLuint kFrameUniformBinding = 0;

// A surface of coplanar rank r is drawn by r of these steps behind its plane. Units are the last
// bits of the nearest depth of a triangle: less leaves stripes near the eye. GPUs round vertices to
// 1/256 pixel, so that triangles of one plane differ by slopes (the depth that a pixel spans), too.
// The depth of frames is then that of planes, without these steps.
constexpr float kCoplanarUnits = 32, kCoplanarSlope = 1.0f / 64;

void setVec4(float (&target)[4], const Vec3& xyz, double w) {
  for (int i = 0; i < 3; ++i) target[i] = static_cast<float>(xyz[i]);
  target[3] = static_cast<float>(w);
}

Eigen::Matrix4d computeClipFromRelative(const Camera& camera, const CameraBasis& basis) {
  const double range = camera.far - camera.near;
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip.row(0).head<3>() = basis.scaleX * basis.right.transpose();
  clip.row(1).head<3>() = basis.scaleY * basis.up.transpose();
  if (camera.projection == Camera::Projection::perspective) {
    clip.row(0).head<3>() += basis.shiftX * basis.forward.transpose();
    clip.row(1).head<3>() += basis.shiftY * basis.forward.transpose();
    clip.row(2).head<3>() = -camera.near / range * basis.forward.transpose();
    clip(2, 3) = camera.near * camera.far / range;
    clip.row(3).head<3>() = basis.forward.transpose();
  } else {
    clip.row(2).head<3>() = -1 / range * basis.forward.transpose();
    clip(2, 3) = camera.far / range;
    clip(3, 3) = 1;
  }
  return clip;
}

FrameUniforms makeFrameUniforms(const Camera& camera) {
  const CameraBasis basis = computeCameraBasis(camera);
  const bool plan = camera.projection == Camera::Projection::orthographic;
  const Eigen::Matrix4d clip = computeClipFromRelative(camera, basis);
  FrameUniforms uniforms{};
  for (int i = 0; i < 16; ++i) {
    uniforms.clipFromRelative[i] = static_cast<float>(clip(i % 4, i / 4));
  }
  setVec4(uniforms.forward, basis.forward, plan ? 1 : 0);
  setVec4(uniforms.middle,
          basis.forward - basis.shiftX / basis.scaleX * basis.right -
              basis.shiftY / basis.scaleY * basis.up,
          0);
  setVec4(uniforms.rightByX, basis.right / basis.scaleX, camera.width / 2.0);
  setVec4(uniforms.upByY, basis.up / basis.scaleY, camera.height / 2.0);
  return uniforms;
}

void bindAttribute(GLuint array, Attribute attribute, GLuint binding, GLint components, GLenum type,
                   bool normalised, std::size_t offset) {
  const auto location = static_cast<GLuint>(attribute);
  glEnableVertexArrayAttrib(array, location);
  glVertexArrayAttribFormat(array, location, components, type,
                            static_cast<GLboolean>(normalised ? GL_TRUE : GL_FALSE),
                            static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(array, location, binding);
}

GlVertexArray makeVertexArray() {
  GlVertexArray result = GlVertexArray::create();
  const GLuint array = result.name();
  bindAttribute(array, Attribute::position, kVertexBinding, 3, GL_FLOAT, false,
                offsetof(Vertex, position));
  bindAttribute(array, Attribute::normal, kVertexBinding, 4, GL_INT_2_10_10_10_REV, true,
                offsetof(Vertex, normal));
  bindAttribute(array, Attribute::uv, kVertexBinding, 2, GL_FLOAT, false, offsetof(Vertex, uv));
  const std::array<std::pair<Attribute, std::size_t>, 6> rows{{
      {Attribute::rowX, offsetof(Instance, relativeFromMesh)},
      {Attribute::rowY, offsetof(Instance, relativeFromMesh) + 16},
      {Attribute::rowZ, offsetof(Instance, relativeFromMesh) + 32},
      {Attribute::baseColour, offsetof(Instance, material.baseColour)},
      {Attribute::emissive, offsetof(Instance, material.emissive)},
      {Attribute::surface, offsetof(Instance, material.surface)},
  }};
  for (const auto& [which, offset] : rows) {
    bindAttribute(array, which, kInstanceBinding, 4, GL_FLOAT, false, offset);
  }
  const auto id = static_cast<GLuint>(Attribute::id);
  glEnableVertexArrayAttrib(array, id);
  glVertexArrayAttribIFormat(array, id, 1, GL_UNSIGNED_INT, offsetof(Instance, id));
  glVertexArrayAttribBinding(array, id, kInstanceBinding);
  glVertexArrayBindingDivisor(array, kInstanceBinding, 1);
  return result;
}

/// One draw call per command.
void drawUnbatched(std::span<const DrawCommand> commands) {
  for (const DrawCommand& command : commands) {
    const std::size_t offset = sizeof(std::uint32_t) * command.firstIndex;
    glDrawElementsInstancedBaseVertexBaseInstance(
        GL_TRIANGLES, static_cast<GLsizei>(command.count), GL_UNSIGNED_INT,
        reinterpret_cast<const void*>(offset), static_cast<GLsizei>(command.instanceCount),
        command.baseVertex, command.baseInstance);
  }
}

}  // namespace

void StreamBuffer::fill(const void* data, std::size_t bytes) {
  if (bytes == 0) return;
  if (bytes > capacity_) {
    capacity_ = 2 * bytes;
    buffer_ = GlBuffer::create();
    glNamedBufferStorage(buffer_.name(), static_cast<GLsizeiptr>(capacity_), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
  }
  glNamedBufferSubData(buffer_.name(), 0, static_cast<GLsizeiptr>(bytes), data);
}

SurfacePass::SurfacePass(bool roundsVertices, bool hasPlaneDepth)
    : roundsVertices_(roundsVertices),
      coplanarSlope_(hasPlaneDepth ? kCoplanarSlope : 0),
      vertexArray_(makeVertexArray()),
      uniforms_(GlBuffer::create()),
      sky_(buildProgram("sky", makeSkyVertexSource(), makeSkyFragmentSource())) {
  glNamedBufferStorage(uniforms_.name(), sizeof(FrameUniforms), nullptr, GL_DYNAMIC_STORAGE_BIT);
  checkGl("setting up the renderer");
}

unsigned SurfacePass::findProgram(const Batch& batch) {
  SurfaceVariant variant;
  variant.mask = batch.alphaMode == AlphaMode::mask;
  variant.shaded = shaded_;
  variant.coloured = batch.coloured && (shaded_ || variant.mask);
  variant.textured = batch.texture >= 0 && (shaded_ || variant.mask);
  variant.blend = shaded_ && batch.alphaMode == AlphaMode::blend;
  variant.normals = shaded_ && normals_;
  variant.plan = shaded_ && plan_;
  variant.shadows = shaded_ && shadows_ && !variant.blend;
  variant.planeDepth = planeDepth_ && !variant.blend;
  std::size_t index = 0;
  for (const bool has :
       {variant.mask, variant.shaded, variant.textured, variant.blend, variant.normals,
        variant.plan, variant.shadows, variant.coloured, variant.planeDepth})
    index = 2 * index + (has ? 1 : 0);
  std::optional<GlProgram>& program = surfaces_[index];
  if (!program) {
    program = buildProgram("surface", makeSurfaceVertexSource(variant, roundsVertices_),
                           makeSurfaceFragmentSource(variant));
  }
  return program->name();
}

/// An enabled attribute needs a buffer, also if the program does not read it.
void SurfacePass::enableColours(bool coloured) {
  if (coloured_ == coloured) return;
  coloured_ = coloured;
  const auto location = static_cast<GLuint>(Attribute::colour);
  if (coloured) {
    bindAttribute(vertexArray_.name(), Attribute::colour, kColourBinding, 4, GL_UNSIGNED_BYTE, true,
                  0);
  } else {
    glDisableVertexArrayAttrib(vertexArray_.name(), location);
  }
}

void SurfacePass::setCoplanarRank(std::uint8_t rank) {
  if (coplanarRank_ == rank) return;
  coplanarRank_ = rank;
  glPolygonOffset(-coplanarSlope_ * rank, -kCoplanarUnits * rank);  // larger depths are nearer
  (rank > 0 ? glEnable : glDisable)(GL_POLYGON_OFFSET_FILL);
}

void SurfacePass::begin(const Camera& camera) {
  plan_ = camera.projection == Camera::Projection::orthographic;
  const FrameUniforms frame = makeFrameUniforms(camera);
  glNamedBufferSubData(uniforms_.name(), 0, sizeof(frame), &frame);
  glBindBufferBase(GL_UNIFORM_BUFFER, kFrameUniformBinding, uniforms_.name());
  glBindVertexArray(vertexArray_.name());
  glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);  // row 0 on top, reversed depth
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDisable(GL_FRAMEBUFFER_SRGB);  // shaders encode opaque colours
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);  // models have inconsistent winding
}

void SurfacePass::beginDepthPrepass(bool planeDepth) {
  shaded_ = false;
  planeDepth_ = planeDepth;
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GEQUAL);
}

void SurfacePass::beginEqualDepthPass(bool normals, bool shadows, bool planeDepth) {
  shaded_ = true;
  normals_ = normals;
  shadows_ = shadows;
  planeDepth_ = planeDepth;
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_EQUAL);
}

void SurfacePass::beginForwardPass(bool normals, bool planeDepth) {
  shaded_ = true;
  normals_ = normals;
  shadows_ = false;
  planeDepth_ = planeDepth;
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_GEQUAL);  // at equal depth the last draw wins, as in beginEqualDepthPass()
}

void SurfacePass::draw(const DrawList& list, const Geometry& geometry) {
  if (list.commands.empty()) return;
  instances_.fill(list.instances.data(), list.instances.size() * sizeof(Instance));
  commands_.fill(list.commands.data(), list.commands.size() * sizeof(DrawCommand));
  const GLuint array = vertexArray_.name();
  glVertexArrayVertexBuffer(array, kVertexBinding, geometry.vertices, 0, sizeof(Vertex));
  glVertexArrayVertexBuffer(array, kInstanceBinding, instances_.name(), 0, sizeof(Instance));
  if (geometry.colours != 0)
    glVertexArrayVertexBuffer(array, kColourBinding, geometry.colours, 0,
                              sizeof(scene::VertexColour));
  glVertexArrayElementBuffer(array, geometry.indices);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands_.name());
  for (const Batch& batch : list.batches) {
    glUseProgram(findProgram(batch));
    enableColours(batch.coloured);
    setCoplanarRank(batch.coplanarRank);
    if (batch.texture >= 0) {
      ENFILADE_ASSERT(static_cast<std::size_t>(batch.texture) < geometry.textures.size());
      glBindTextureUnit(0, geometry.textures[static_cast<std::size_t>(batch.texture)].name());
    }
    if (list.unbatched) {
      drawUnbatched(std::span(list.commands).subspan(batch.firstCommand, batch.commandCount));
      continue;
    }
    const std::size_t offset = sizeof(DrawCommand) * batch.firstCommand;
    glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
                                reinterpret_cast<const void*>(offset),
                                static_cast<GLsizei>(batch.commandCount), sizeof(DrawCommand));
  }
  setCoplanarRank(0);
}

void SurfacePass::drawSky() const {
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_GEQUAL);
  glUseProgram(sky_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDepthFunc(GL_GREATER);
}

void SurfacePass::beginTransparentPass() {
  shaded_ = true;
  normals_ = shadows_ = planeDepth_ = false;
  glEnable(GL_BLEND);
  glEnable(GL_FRAMEBUFFER_SRGB);  // blend linear light
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE_MINUS_SRC_ALPHA);
}

}  // namespace enfilade::render
