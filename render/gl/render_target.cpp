#include "render/gl/render_target.hpp"

#include <epoxy/gl.h>

#include <array>
#include <limits>

#include "collision/assert.hpp"
#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

GlTexture makeTexture(GLenum format, int width, int height) {
  GlTexture texture = GlTexture::create();
  glTextureStorage2D(texture.name(), 1, format, width, height);
  return texture;
}

void checkComplete(GLuint framebuffer, int width, int height) {
  checkGl("making the frame's buffers");
  const GLenum status = glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    throw RenderError("glCheckNamedFramebufferStatus gives " + std::to_string(status) + " for " +
                      std::to_string(width) + "x" + std::to_string(height) +
                      " pixels; try a smaller frame or another driver");
  }
}

}  // namespace

RenderTarget::RenderTarget(int width, int height, int layers)
    : width_(width), height_(height), framebuffers_(static_cast<std::size_t>(layers)) {
  ENFILADE_ASSERT(layers > 0);
  for (GlFramebuffer& framebuffer : framebuffers_) framebuffer = GlFramebuffer::create();
  attach(colour_, GL_SRGB8_ALPHA8, GL_COLOR_ATTACHMENT0);
  attach(ids_, GL_R32UI, GL_COLOR_ATTACHMENT1);
  attach(depth_, GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
  for (const GlFramebuffer& framebuffer : framebuffers_)
    checkComplete(framebuffer.name(), width, height);
}

/// Creates the layers of a texture, and attaches each to its framebuffer.
void RenderTarget::attach(GlTextureArray& texture, unsigned format, unsigned attachment) {
  texture = GlTextureArray::create();
  glTextureStorage3D(texture.name(), 1, format, width_, height_, layers());
  for (int layer = 0; layer < layers(); ++layer)
    glNamedFramebufferTextureLayer(framebuffers_[static_cast<std::size_t>(layer)].name(),
                                   attachment, texture.name(), 0, layer);
}

void RenderTarget::select(int layer) {
  ENFILADE_ASSERT(layer >= 0 && layer < layers());
  layer_ = layer;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer());
  glViewport(0, 0, width_, height_);
}

void RenderTarget::begin(const Channels& channels, bool planeDepth) {
  // Few frames need these attachments: they are added with the first frame that does.
  const bool addsNormals = channels.normals && normals_.name() == 0,
             addsPlaneDepth = planeDepth && planeDepth_.name() == 0;
  if (addsNormals) attach(normals_, GL_RGBA32F, GL_COLOR_ATTACHMENT2);
  if (addsPlaneDepth) attach(planeDepth_, GL_R32F, GL_COLOR_ATTACHMENT3);
  const GLuint fbo = framebuffer();
  if (addsNormals || addsPlaneDepth) checkComplete(fbo, width_, height_);
  setDrawChannels(channels, planeDepth);
  constexpr std::array<GLfloat, 4> kBlack{0, 0, 0, 1}, kNone{0, 0, 0, 0};
  constexpr GLfloat kNaN = std::numeric_limits<GLfloat>::quiet_NaN();
  constexpr std::array<GLfloat, 4> kNoDepth{kNaN, kNaN, kNaN, kNaN};
  constexpr std::array<GLuint, 4> kNothing{0, 0, 0, 0};
  constexpr GLfloat kFarDepth = 0;
  if (channels.rgb) glClearNamedFramebufferfv(fbo, GL_COLOR, 0, kBlack.data());
  if (channels.ids) glClearNamedFramebufferuiv(fbo, GL_COLOR, 1, kNothing.data());
  if (channels.normals) glClearNamedFramebufferfv(fbo, GL_COLOR, 2, kNone.data());
  if (planeDepth) glClearNamedFramebufferfv(fbo, GL_COLOR, 3, kNoDepth.data());
  // Not by the framebuffer: NVIDIA's driver 580.159 then culled visible fragments by the depth of
  // an earlier frame, in blocks of 8 pixels. It did so where a small frame followed another in the
  // same layer.
  glClearTexSubImage(depth_.name(), 0, 0, 0, layer_, width_, height_, 1, GL_DEPTH_COMPONENT,
                     GL_FLOAT, &kFarDepth);
}

void RenderTarget::setShadowMask(const std::vector<std::uint8_t>& mask) {
  ENFILADE_ASSERT(mask.size() ==
                  static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  constexpr GLuint kUnit = 1;  // of `shadowMask` in the shaders
  if (shadowMask_.name() == 0) shadowMask_ = makeTexture(GL_R8, width_, height_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(shadowMask_.name(), 0, 0, 0, width_, height_, GL_RED, GL_UNSIGNED_BYTE,
                      mask.data());
  glBindTextureUnit(kUnit, shadowMask_.name());
}

void RenderTarget::setDrawChannels(const Channels& channels, bool planeDepth) const {
  const auto target = [](bool on, GLenum attachment) { return on ? attachment : GLenum{GL_NONE}; };
  const std::array<GLenum, 4> targets{
      target(channels.rgb, GL_COLOR_ATTACHMENT0), target(channels.ids, GL_COLOR_ATTACHMENT1),
      target(channels.normals, GL_COLOR_ATTACHMENT2), target(planeDepth, GL_COLOR_ATTACHMENT3)};
  glNamedFramebufferDrawBuffers(framebuffer(), 4, targets.data());
}

template <class Value>
void RenderTarget::read(const GlTextureArray& texture, Layers layers, unsigned format,
                        unsigned type, std::span<Value> values) const {
  ENFILADE_ASSERT(layers.first >= 0 && layers.first + layers.count <= this->layers());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glGetTextureSubImage(texture.name(), 0, 0, 0, layers.first, width_, height_, layers.count, format,
                       type, static_cast<GLsizei>(values.size_bytes()), values.data());
}

void RenderTarget::readColour(Layers layers, std::span<std::uint8_t> rgba) const {
  read(colour_, layers, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
}
void RenderTarget::readIds(Layers layers, std::span<std::uint32_t> ids) const {
  read(ids_, layers, GL_RED_INTEGER, GL_UNSIGNED_INT, ids);
}
void RenderTarget::readNormals(Layers layers, std::span<float> normals) const {
  read(normals_, layers, GL_RGB, GL_FLOAT, normals);
}
void RenderTarget::readDepth(Layers layers, std::span<float> depth) const {
  read(depth_, layers, GL_DEPTH_COMPONENT, GL_FLOAT, depth);
}
void RenderTarget::readPlaneDepth(Layers layers, std::span<float> metres) const {
  read(planeDepth_, layers, GL_RED, GL_FLOAT, metres);
}

std::vector<std::uint8_t> applyOcclusion(std::span<const std::uint8_t> rgba, int width, int height,
                                         const AmbientOcclusion& ambientOcclusion) {
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  ENFILADE_ASSERT(rgba.size() == 4 * columns * rows);
  std::vector<std::uint8_t> rgb(3 * columns * rows), visibility(columns);
  const std::uint8_t* from = rgba.data();
  std::uint8_t* to = rgb.data();
  for (int y = 0; y < height; ++y) {
    ambientOcclusion.computeRow(y, visibility);
    for (std::size_t x = 0; x < columns; ++x, from += 4, to += 3)
      applyAo(from, visibility[x], from[3], to);
  }
  return rgb;
}

/// Computes in floats, which adds an error of about 2e-7 of the distance to the buffer's rounding.
std::vector<float> convertDepthToMetres(const std::vector<float>& depth, const Camera& camera) {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  const auto near = static_cast<float>(camera.near), far = static_cast<float>(camera.far);
  const auto range = static_cast<float>(camera.far - camera.near);
  std::vector<float> metres(depth.size());
  if (camera.projection == Camera::Projection::perspective) {
    const auto product = static_cast<float>(camera.near * camera.far);
    for (std::size_t i = 0; i < depth.size(); ++i)
      metres[i] = depth[i] > 0 ? product / (near + depth[i] * range) : kNothing;
  } else {
    for (std::size_t i = 0; i < depth.size(); ++i)
      metres[i] = depth[i] > 0 ? far - depth[i] * range : kNothing;
  }
  return metres;
}

}  // namespace enfilade::render
