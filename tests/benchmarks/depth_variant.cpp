#include "tests/benchmarks/depth_variant.hpp"

#include <epoxy/gl.h>

#include <limits>

#include "render/camera/camera.hpp"
#include "render/gl/egl_context.hpp"
#include "render/gl/gl_objects.hpp"

namespace enfilade::benchmarks {
namespace {

using render::Camera;

constexpr const char* kVertexSource = R"(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 0) uniform mat4 clipFromRelative;
void main() { gl_Position = clipFromRelative * vec4(position, 1.0); }
)";
constexpr const char* kFragmentSource = "#version 450 core\nvoid main() {}\n";

Eigen::Matrix4f computeClipFromRelative(const Camera& camera, bool reversed) {
  const render::CameraBasis view = render::computeCameraBasis(camera);
  const double near = camera.near, far = camera.far, range = far - near;
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip.row(0).head<3>() = view.scaleX * view.right.transpose();
  clip.row(1).head<3>() = view.scaleY * view.up.transpose();
  clip.row(3).head<3>() = view.forward.transpose();
  clip.row(2).head<3>() = (reversed ? -near : far + near) / range * view.forward.transpose();
  clip(2, 3) = (reversed ? near * far : -2 * near * far) / range;
  return clip.cast<float>();
}

/// Converts a stored depth to metres; NaN for the background.
float toMetres(float stored, const Camera& camera, bool reversed) {
  const double near = camera.near, far = camera.far, range = far - near;
  const double d = stored;
  if (reversed ? d <= 0 : d >= 1) return std::numeric_limits<float>::quiet_NaN();
  return static_cast<float>(reversed ? near * far / (near + d * range)
                                     : near * far / (far - d * range));
}

}  // namespace

struct DepthVariant::State {
  std::shared_ptr<const scene::Scene> scene;
  DepthBuffer buffer;
  render::EglContext context;
  render::GlProgram program;
  render::GlVertexArray array;
  render::GlBuffer vertices;
  render::GlTexture depth;
  render::GlFramebuffer target;
  GLsizei count = 0;
  int width = 0, height = 0;

  void resize(const Camera& camera);
};

void DepthVariant::State::resize(const Camera& camera) {
  if (width == camera.width && height == camera.height) return;
  width = camera.width;
  height = camera.height;
  depth = render::GlTexture::create();
  glTextureStorage2D(depth.name(), 1, buffer.floats ? GL_DEPTH_COMPONENT32F : GL_DEPTH_COMPONENT24,
                     width, height);
  target = render::GlFramebuffer::create();
  glNamedFramebufferTexture(target.name(), GL_DEPTH_ATTACHMENT, depth.name(), 0);
  glNamedFramebufferDrawBuffer(target.name(), GL_NONE);
}

DepthVariant::DepthVariant(std::shared_ptr<const scene::Scene> scene, DepthBuffer buffer)
    : state_(std::make_unique<State>()) {
  state_->scene = std::move(scene);
  state_->buffer = std::move(buffer);
  state_->program = render::buildProgram("depth", kVertexSource, kFragmentSource);
  state_->array = render::GlVertexArray::create();
  glEnableVertexArrayAttrib(state_->array.name(), 0);
  glVertexArrayAttribFormat(state_->array.name(), 0, 3, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(state_->array.name(), 0, 0);
}

DepthVariant::~DepthVariant() {
  state_->context.makeCurrent();
}

void DepthVariant::aim(const Camera& camera) {
  state_->context.makeCurrent();
  std::vector<Eigen::Vector3f> corners;
  const scene::Model& model = state_->scene->model();
  for (const scene::Object& object : model.objects) {
    if (object.usage == scene::Object::Usage::collisionOnly) continue;
    for (const std::uint32_t m : object.meshes) {
      const scene::Mesh& mesh = model.meshes[m];
      for (const std::uint32_t corner : mesh.indices) {
        const scene::Vec3 relative = computeWorldPosition(object, mesh, corner) - camera.eye;
        corners.push_back(relative.cast<float>());
      }
    }
  }
  state_->count = static_cast<GLsizei>(corners.size());
  state_->vertices = render::GlBuffer::create();
  glNamedBufferStorage(state_->vertices.name(),
                       static_cast<GLsizeiptr>(corners.size() * sizeof(Eigen::Vector3f)),
                       corners.data(), 0);
  render::checkGl("filling the vertices of a depth variant");
}

render::Frame DepthVariant::draw(const Camera& camera) {
  State& s = *state_;
  s.context.makeCurrent();
  s.resize(camera);
  glBindFramebuffer(GL_FRAMEBUFFER, s.target.name());
  glViewport(0, 0, s.width, s.height);
  glClipControl(GL_UPPER_LEFT, s.buffer.reversed ? GL_ZERO_TO_ONE : GL_NEGATIVE_ONE_TO_ONE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(s.buffer.reversed ? GL_GREATER : GL_LESS);
  glClearDepth(s.buffer.reversed ? 0 : 1);
  glClear(GL_DEPTH_BUFFER_BIT);
  glUseProgram(s.program.name());
  const Eigen::Matrix4f clip = computeClipFromRelative(camera, s.buffer.reversed);
  glUniformMatrix4fv(0, 1, GL_FALSE, clip.data());
  glBindVertexArray(s.array.name());
  glVertexArrayVertexBuffer(s.array.name(), 0, s.vertices.name(), 0, sizeof(Eigen::Vector3f));
  glDrawArrays(GL_TRIANGLES, 0, s.count);
  render::Frame frame;
  frame.camera = camera;
  frame.renderer = s.buffer.name;
  frame.depth.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, s.width, s.height, GL_DEPTH_COMPONENT, GL_FLOAT, frame.depth.data());
  for (float& d : frame.depth) d = toMetres(d, camera, s.buffer.reversed);
  render::checkGl("drawing a depth variant");
  return frame;
}

}  // namespace enfilade::benchmarks
