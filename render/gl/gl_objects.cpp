#include "render/gl/gl_objects.hpp"

#include <epoxy/gl.h>

#include <array>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

constexpr int kMaxErrors = 16;  // one flag per error; a lost context reports errors forever

const char* getErrorName(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
      return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
      return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
      return "GL_OUT_OF_MEMORY";
    case GL_CONTEXT_LOST:
      return "GL_CONTEXT_LOST";
    default:
      return "unknown GL error";
  }
}

const char* suggestRemedy(GLenum error) {
  switch (error) {
    case GL_OUT_OF_MEMORY:
      return "request a smaller frame or load a smaller scene";
    case GL_CONTEXT_LOST:
      return "the device was reset: create a new GlRenderer";
    default:
      return "this is a bug of Enfilade or the driver: please report it";
  }
}

class Shader {
 public:
  Shader(GLenum stage, const std::string& name, const std::string& source)
      : shader_(glCreateShader(stage)) {
    const char* text = source.c_str();
    glShaderSource(shader_, 1, &text, nullptr);
    glCompileShader(shader_);
    GLint good = GL_FALSE;
    glGetShaderiv(shader_, GL_COMPILE_STATUS, &good);
    if (good == GL_TRUE) return;
    std::array<char, 2048> log{};
    glGetShaderInfoLog(shader_, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glDeleteShader(shader_);
    throw RenderError("glCompileShader failed for " + name + ": " + log.data());
  }
  ~Shader() { glDeleteShader(shader_); }
  Shader(const Shader&) = delete;
  Shader& operator=(const Shader&) = delete;
  GLuint name() const { return shader_; }

 private:
  GLuint shader_;
};

}  // namespace

unsigned createGlObject(GlKind kind) {
  GLuint name = 0;
  switch (kind) {
    case GlKind::buffer:
      glCreateBuffers(1, &name);
      break;
    case GlKind::texture:
      glCreateTextures(GL_TEXTURE_2D, 1, &name);
      break;
    case GlKind::textureArray:
      glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
      break;
    case GlKind::vertexArray:
      glCreateVertexArrays(1, &name);
      break;
    case GlKind::framebuffer:
      glCreateFramebuffers(1, &name);
      break;
    case GlKind::program:
      name = glCreateProgram();
      break;
  }
  return name;
}

void deleteGlObject(GlKind kind, unsigned name) noexcept {
  switch (kind) {
    case GlKind::buffer:
      glDeleteBuffers(1, &name);
      break;
    case GlKind::texture:
    case GlKind::textureArray:
      glDeleteTextures(1, &name);
      break;
    case GlKind::vertexArray:
      glDeleteVertexArrays(1, &name);
      break;
    case GlKind::framebuffer:
      glDeleteFramebuffers(1, &name);
      break;
    case GlKind::program:
      glDeleteProgram(name);
      break;
  }
}

void checkGl(const char* stage) {
  const GLenum first = glGetError();
  if (first == GL_NO_ERROR) return;
  for (int i = 0; i < kMaxErrors && glGetError() != GL_NO_ERROR; ++i) {
  }
  throw RenderError(std::string(stage) + ": " + getErrorName(first) + "; " + suggestRemedy(first));
}

GlProgram buildProgram(const std::string& name, const std::string& vertexSource,
                       const std::string& fragmentSource) {
  const Shader vertex(GL_VERTEX_SHADER, name + " (vertex)", vertexSource);
  const Shader fragment(GL_FRAGMENT_SHADER, name + " (fragment)", fragmentSource);
  GlProgram program = GlProgram::create();
  glAttachShader(program.name(), vertex.name());
  glAttachShader(program.name(), fragment.name());
  glLinkProgram(program.name());
  GLint good = GL_FALSE;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &good);
  if (good == GL_TRUE) return program;
  std::array<char, 2048> log{};
  glGetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), nullptr, log.data());
  throw RenderError("glLinkProgram failed for " + name + ": " + log.data());
}

}  // namespace enfilade::render
