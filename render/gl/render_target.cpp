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

void readAttachment(GLuint framebuffer, GLenum attachment, int width, int height, GLenum format,
                    GLenum type, void* data) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glNamedFramebufferReadBuffer(framebuffer, attachment);
  glReadPixels(0, 0, width, height, format, type, data);
}

}  // namespace

RenderTarget::RenderTarget(int width, int height)
    : width_(width),
      height_(height),
      colour_(makeTexture(GL_SRGB8_ALPHA8, width, height)),
      ids_(makeTexture(GL_R32UI, width, height)),
      depth_(makeTexture(GL_DEPTH_COMPONENT32F, width, height)),
      framebuffer_(GlFramebuffer::create()) {
  const GLuint fbo = framebuffer_.name();
  glNamedFramebufferTexture(fbo, GL_COLOR_ATTACHMENT0, colour_.name(), 0);
  glNamedFramebufferTexture(fbo, GL_COLOR_ATTACHMENT1, ids_.name(), 0);
  glNamedFramebufferTexture(fbo, GL_DEPTH_ATTACHMENT, depth_.name(), 0);
  checkComplete(fbo, width, height);
}

/// Adds an attachment that few frames need, with the first frame that does.
void RenderTarget::addAttachment(GlTexture& texture, unsigned format, unsigned attachment) {
  if (texture.name() != 0) return;
  texture = makeTexture(format, width_, height_);
  glNamedFramebufferTexture(framebuffer_.name(), attachment, texture.name(), 0);
  checkComplete(framebuffer_.name(), width_, height_);
}

void RenderTarget::begin(const Channels& channels, bool planeDepth) {
  if (channels.normals) addAttachment(normals_, GL_RGBA32F, GL_COLOR_ATTACHMENT2);
  if (planeDepth) addAttachment(planeDepth_, GL_R32F, GL_COLOR_ATTACHMENT3);
  const GLuint fbo = framebuffer_.name();
  glBindFramebuffer(GL_FRAMEBUFFER, fbo);
  setDrawChannels(channels, planeDepth);
  glViewport(0, 0, width_, height_);
  constexpr std::array<GLfloat, 4> kBlack{0, 0, 0, 1}, kNone{0, 0, 0, 0};
  constexpr GLfloat kNaN = std::numeric_limits<GLfloat>::quiet_NaN();
  constexpr std::array<GLfloat, 4> kNoDepth{kNaN, kNaN, kNaN, kNaN};
  constexpr std::array<GLuint, 4> kNothing{0, 0, 0, 0};
  constexpr GLfloat kFarthest = 0;
  glDepthMask(GL_TRUE);
  if (channels.rgb) glClearNamedFramebufferfv(fbo, GL_COLOR, 0, kBlack.data());
  if (channels.ids) glClearNamedFramebufferuiv(fbo, GL_COLOR, 1, kNothing.data());
  if (channels.normals) glClearNamedFramebufferfv(fbo, GL_COLOR, 2, kNone.data());
  if (planeDepth) glClearNamedFramebufferfv(fbo, GL_COLOR, 3, kNoDepth.data());
  glClearNamedFramebufferfv(fbo, GL_DEPTH, 0, &kFarthest);
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
  glNamedFramebufferDrawBuffers(framebuffer_.name(), 4, targets.data());
}

void RenderTarget::readColour(Frame& frame, const AmbientOcclusion& ambientOcclusion) {
  const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
  rgba_.resize(4 * width * height);
  readAttachment(framebuffer_.name(), GL_COLOR_ATTACHMENT0, width_, height_, GL_RGBA,
                 GL_UNSIGNED_BYTE, rgba_.data());
  frame.rgb.resize(3 * width * height);
  std::vector<std::uint8_t> visibility(width);
  const std::uint8_t* from = rgba_.data();
  std::uint8_t* to = frame.rgb.data();
  for (int y = 0; y < height_; ++y) {
    ambientOcclusion.computeRow(y, visibility);
    for (std::size_t x = 0; x < width; ++x, from += 4, to += 3) {
      applyAo(from, visibility[x], from[3], to);
    }
  }
}

void RenderTarget::readChannels(Frame& frame, const Channels& channels) const {
  const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  const auto readInto = [&](GLenum attachment, GLenum format, GLenum type, void* data) {
    readAttachment(framebuffer_.name(), attachment, width_, height_, format, type, data);
  };
  if (channels.ids) {
    frame.ids.resize(pixels);
    readInto(GL_COLOR_ATTACHMENT1, GL_RED_INTEGER, GL_UNSIGNED_INT, frame.ids.data());
  }
  if (channels.normals) {
    frame.normals.resize(3 * pixels);
    readInto(GL_COLOR_ATTACHMENT2, GL_RGB, GL_FLOAT, frame.normals.data());
  }
}

void RenderTarget::readDepth(std::vector<float>& depth) const {
  depth.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
}

void RenderTarget::readPlaneDepth(std::vector<float>& metres) const {
  metres.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  readAttachment(framebuffer_.name(), GL_COLOR_ATTACHMENT3, width_, height_, GL_RED, GL_FLOAT,
                 metres.data());
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
