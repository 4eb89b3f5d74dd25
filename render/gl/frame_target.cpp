#include "render/gl/frame_target.hpp"

#include <epoxy/gl.h>

#include <array>
#include <limits>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

GlTexture plane(GLenum format, int width, int height) {
  GlTexture texture = GlTexture::create();
  glTextureStorage2D(texture.name(), 1, format, width, height);
  return texture;
}

/// From the buffer's 1 (near) .. 0 (far) to metres along forward; NaN where nothing was drawn.
void toMetres(std::vector<float>& depth, const Camera& camera) {
  const double near = camera.near, far = camera.far, range = far - near;
  const bool perspective = camera.projection == Camera::Projection::perspective;
  for (float& d : depth) {
    if (d <= 0) {
      d = std::numeric_limits<float>::quiet_NaN();
    } else {
      const double z = perspective ? near * far / (near + d * range) : far - d * range;
      d = static_cast<float>(z);
    }
  }
}

void dropAlpha(std::vector<std::uint8_t>& rgba, std::size_t pixels) {
  for (std::size_t i = 1; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) rgba[3 * i + c] = rgba[4 * i + c];
  }
  rgba.resize(3 * pixels);
}

}  // namespace

FrameTarget::FrameTarget(int width, int height)
    : width_(width),
      height_(height),
      colour_(plane(GL_SRGB8_ALPHA8, width, height)),
      ids_(plane(GL_R32UI, width, height)),
      depth_(plane(GL_DEPTH_COMPONENT32F, width, height)),
      framebuffer_(GlFramebuffer::create()),
      overlay_(GlFramebuffer::create()) {
  const GLuint fbo = framebuffer_.name();
  glNamedFramebufferTexture(fbo, GL_COLOR_ATTACHMENT0, colour_.name(), 0);
  glNamedFramebufferTexture(fbo, GL_COLOR_ATTACHMENT1, ids_.name(), 0);
  glNamedFramebufferTexture(fbo, GL_DEPTH_ATTACHMENT, depth_.name(), 0);
  glNamedFramebufferTexture(overlay_.name(), GL_COLOR_ATTACHMENT0, colour_.name(), 0);
  glTextureParameteri(depth_.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(depth_.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  checkGl("making the frame's buffers");
  const GLenum status = glCheckNamedFramebufferStatus(fbo, GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    throw RenderError("glCheckNamedFramebufferStatus says " + std::to_string(status) + " for " +
                      std::to_string(width) + "x" + std::to_string(height) +
                      " pixels; try a smaller picture or another driver");
  }
}

void FrameTarget::begin() const {
  const GLuint fbo = framebuffer_.name();
  glBindFramebuffer(GL_FRAMEBUFFER, fbo);
  writeIds(true);
  glViewport(0, 0, width_, height_);
  constexpr std::array<GLfloat, 4> kBlack{0, 0, 0, 1};
  constexpr std::array<GLuint, 4> kNothing{0, 0, 0, 0};
  constexpr GLfloat kFarthest = 0;
  glDepthMask(GL_TRUE);
  glClearNamedFramebufferfv(fbo, GL_COLOR, 0, kBlack.data());
  glClearNamedFramebufferuiv(fbo, GL_COLOR, 1, kNothing.data());
  glClearNamedFramebufferfv(fbo, GL_DEPTH, 0, &kFarthest);
}

void FrameTarget::writeIds(bool on) const {
  constexpr GLenum kColour = GL_COLOR_ATTACHMENT0;
  const std::array<GLenum, 2> targets{kColour, on ? GLenum{GL_COLOR_ATTACHMENT1} : GLenum{GL_NONE}};
  glNamedFramebufferDrawBuffers(framebuffer_.name(), 2, targets.data());
}

void FrameTarget::beginOverlay() const {
  glBindFramebuffer(GL_FRAMEBUFFER, overlay_.name());
  glBindTextureUnit(0, depth_.name());
}

void FrameTarget::endOverlay() const {
  glBindTextureUnit(0, 0);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
}

void FrameTarget::read(Frame& frame) const {
  const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  frame.rgb.resize(4 * pixels);
  glNamedFramebufferReadBuffer(framebuffer_.name(), GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, frame.rgb.data());
  dropAlpha(frame.rgb, pixels);
  frame.ids.resize(pixels);
  glNamedFramebufferReadBuffer(framebuffer_.name(), GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_INT, frame.ids.data());
  frame.depth.resize(pixels);
  glReadPixels(0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT, frame.depth.data());
  toMetres(frame.depth, frame.camera);
}

}  // namespace enfilade::render
