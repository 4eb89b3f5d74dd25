// A picture, step by step: the parts of the model that the camera may see, bodies where they are,
// then the avatars (both write colour, id and depth), then the sky where nothing was drawn, then
// glass over it all (colour only).
#include "render/gl/gl_renderer.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "render/gl/avatar_mesh.hpp"
#include "render/gl/draw_list.hpp"
#include "render/gl/egl_context.hpp"
#include "render/gl/frame_target.hpp"
#include "render/gl/model_buffers.hpp"
#include "render/gl/shaders.hpp"
#include "render/gl/vertex.hpp"

namespace enfilade::render {
namespace {

constexpr GLuint kVertexBinding = 0, kInstanceBinding = 1, kFrameUniforms = 0;

void put(float (&target)[4], const Vec3& xyz, double w) {
  for (int i = 0; i < 3; ++i) target[i] = static_cast<float>(xyz[i]);
  target[3] = static_cast<float>(w);
}

Eigen::Matrix4d clipFromRelative(const Camera& camera, const View& view) {
  const double range = camera.far - camera.near;
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip.row(0).head<3>() = view.scaleX * view.right.transpose();
  clip.row(1).head<3>() = view.scaleY * view.up.transpose();
  if (camera.projection == Camera::Projection::perspective) {
    clip.row(0).head<3>() += view.shiftX * view.forward.transpose();
    clip.row(1).head<3>() += view.shiftY * view.forward.transpose();
    clip.row(2).head<3>() = -camera.near / range * view.forward.transpose();
    clip(2, 3) = camera.near * camera.far / range;
    clip.row(3).head<3>() = view.forward.transpose();
  } else {
    clip.row(2).head<3>() = -1 / range * view.forward.transpose();
    clip(2, 3) = camera.far / range;
    clip(3, 3) = 1;
  }
  return clip;
}

FrameUniforms uniformsOf(const Camera& camera) {
  const View view = viewOf(camera);
  const bool plan = camera.projection == Camera::Projection::orthographic;
  const Eigen::Matrix4d clip = clipFromRelative(camera, view);
  FrameUniforms uniforms{};
  for (int i = 0; i < 16; ++i) {
    uniforms.clipFromRelative[i] = static_cast<float>(clip(i % 4, i / 4));
  }
  put(uniforms.forward, view.forward, plan ? 1 : 0);
  put(uniforms.middle,
      view.forward - view.shiftX / view.scaleX * view.right - view.shiftY / view.scaleY * view.up,
      0);
  put(uniforms.rightByX, view.right / view.scaleX, 0);
  put(uniforms.upByY, view.up / view.scaleY, 0);
  put(uniforms.range, Vec3(camera.near, camera.far, view.scaleY * camera.height / 2), 0);
  return uniforms;
}

void attribute(GLuint array, Attribute which, GLuint binding, GLint components, GLenum type,
               bool normalised, std::size_t offset) {
  const auto place = static_cast<GLuint>(which);
  glEnableVertexArrayAttrib(array, place);
  glVertexArrayAttribFormat(array, place, components, type,
                            static_cast<GLboolean>(normalised ? GL_TRUE : GL_FALSE),
                            static_cast<GLuint>(offset));
  glVertexArrayAttribBinding(array, place, binding);
}

GlVertexArray vertexArray() {
  GlVertexArray result = GlVertexArray::create();
  const GLuint array = result.name();
  attribute(array, Attribute::position, kVertexBinding, 3, GL_FLOAT, false,
            offsetof(Vertex, position));
  attribute(array, Attribute::normal, kVertexBinding, 4, GL_INT_2_10_10_10_REV, true,
            offsetof(Vertex, normal));
  attribute(array, Attribute::uv, kVertexBinding, 2, GL_FLOAT, false, offsetof(Vertex, uv));
  const std::array<std::pair<Attribute, std::size_t>, 6> rows{{
      {Attribute::rowX, offsetof(Instance, relativeFromMesh)},
      {Attribute::rowY, offsetof(Instance, relativeFromMesh) + 16},
      {Attribute::rowZ, offsetof(Instance, relativeFromMesh) + 32},
      {Attribute::baseColour, offsetof(Instance, material.baseColour)},
      {Attribute::emissive, offsetof(Instance, material.emissive)},
      {Attribute::surface, offsetof(Instance, material.surface)},
  }};
  for (const auto& [which, offset] : rows) {
    attribute(array, which, kInstanceBinding, 4, GL_FLOAT, false, offset);
  }
  const auto id = static_cast<GLuint>(Attribute::id);
  glEnableVertexArrayAttrib(array, id);
  glVertexArrayAttribIFormat(array, id, 1, GL_UNSIGNED_INT, offsetof(Instance, id));
  glVertexArrayAttribBinding(array, id, kInstanceBinding);
  glVertexArrayBindingDivisor(array, kInstanceBinding, 1);
  return result;
}

template <class Item>
GlBuffer uploaded(const std::vector<Item>& items) {
  GlBuffer buffer = GlBuffer::create();
  glNamedBufferStorage(buffer.name(), static_cast<GLsizeiptr>(items.size() * sizeof(Item)),
                       items.data(), 0);
  return buffer;
}

}  // namespace

struct GlRenderer::State {
  std::shared_ptr<const scene::Scene> scene;
  EglContext context;  // before all that lives in it
  ModelBuffers buffers;
  std::vector<Part> parts;
  GlVertexArray vertexArray;
  GlBuffer uniforms;
  GlProgram sky;
  GlProgram hollows;
  std::array<std::optional<GlProgram>, 12> surfaces;  // see surfaceProgram()
  FrameTarget target;
  bool prepared = false;  // all between the context and the target is there

  State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device);
  ~State();
  void prepare();
  GLuint surfaceProgram(const Batch& batch, bool normals);
  void setUp(const Camera& camera, const Channels& channels);
  void drawBatches(const DrawList& list, const GlBuffer& vertices, const GlBuffer& indices,
                   bool glass, bool normals);
  void drawAvatars(const AvatarMeshes& avatars, const Camera& camera, bool normals);
  void drawAir(const DrawList& list);
  void drawSky();
  void darkenHollows();
};

GlRenderer::State::State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device)
    : scene(std::move(shared)), context(device) {
  if (!scene) throw RenderError("GlRenderer: there is no scene");
}

/// A scene that nobody looks at is never brought to the device.
void GlRenderer::State::prepare() {
  if (prepared) return;
  buffers = uploadModel(scene->model());
  parts = partsOf(scene->model());
  vertexArray = render::vertexArray();
  uniforms = GlBuffer::create();
  glNamedBufferStorage(uniforms.name(), sizeof(FrameUniforms), nullptr, GL_DYNAMIC_STORAGE_BIT);
  sky = buildProgram("sky", skyVertexSource(), skyFragmentSource());
  hollows = buildProgram("hollows", skyVertexSource(), hollowFragmentSource());
  checkGl("setting up the renderer");
  prepared = true;
}

GlRenderer::State::~State() {
  // The members below the context delete their GL names in it.
  try {
    context.makeCurrent();
  } catch (const RenderError&) {
    // Destroyed on a wrong thread: the names die with the context.
  }
}

GLuint GlRenderer::State::surfaceProgram(const Batch& batch, bool normals) {
  const SurfaceVariant variant{batch.texture >= 0, batch.pass == Pass::mask,
                               batch.pass == Pass::blend, normals};
  const std::size_t index =
      4 * static_cast<std::size_t>(batch.pass) + (variant.textured ? 2 : 0) + (normals ? 1 : 0);
  std::optional<GlProgram>& program = surfaces[index];
  if (!program) {
    program = buildProgram("surface", surfaceVertexSource(), surfaceFragmentSource(variant));
  }
  return program->name();
}

void GlRenderer::State::setUp(const Camera& camera, const Channels& channels) {
  if (!target.fits(camera.width, camera.height)) {
    target = FrameTarget(camera.width, camera.height);
  }
  const FrameUniforms frame = uniformsOf(camera);
  glNamedBufferSubData(uniforms.name(), 0, sizeof(frame), &frame);
  glBindBufferBase(GL_UNIFORM_BUFFER, kFrameUniforms, uniforms.name());
  glBindVertexArray(vertexArray.name());
  glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);  // row 0 on top, reversed depth
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glEnable(GL_FRAMEBUFFER_SRGB);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);  // real models are wound both ways
  target.begin(channels);
}

void GlRenderer::State::drawBatches(const DrawList& list, const GlBuffer& vertices,
                                    const GlBuffer& indices, bool glass, bool normals) {
  const auto wanted = [&](const Batch& batch) { return (batch.pass == Pass::blend) == glass; };
  if (std::none_of(list.batches.begin(), list.batches.end(), wanted)) return;
  const GlBuffer instances = uploaded(list.instances);
  const GlBuffer commands = uploaded(list.commands);
  glVertexArrayVertexBuffer(vertexArray.name(), kVertexBinding, vertices.name(), 0, sizeof(Vertex));
  glVertexArrayVertexBuffer(vertexArray.name(), kInstanceBinding, instances.name(), 0,
                            sizeof(Instance));
  glVertexArrayElementBuffer(vertexArray.name(), indices.name());
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands.name());
  for (const Batch& batch : list.batches) {
    if (!wanted(batch)) continue;
    glUseProgram(surfaceProgram(batch, normals));
    if (batch.texture >= 0) {
      glBindTextureUnit(0, buffers.textures[static_cast<std::size_t>(batch.texture)].name());
    }
    const std::size_t offset = sizeof(DrawCommand) * batch.firstCommand;
    glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
                                reinterpret_cast<const void*>(offset),
                                static_cast<GLsizei>(batch.commandCount), sizeof(DrawCommand));
  }
}

void GlRenderer::State::drawAvatars(const AvatarMeshes& avatars, const Camera& camera,
                                    bool normals) {
  DrawList list;
  appendVisible(list, avatars, camera);
  if (list.commands.empty()) return;
  drawBatches(list, uploaded(avatars.vertices), uploaded(avatars.indices), false, normals);
}

/// What has a colour only: the sky, the shade in hollows, and glass.
void GlRenderer::State::drawAir(const DrawList& list) {
  target.drawInto({true, false, false, false});
  drawSky();
  darkenHollows();
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE);
  drawBatches(list, buffers.vertices, buffers.indices, true, false);
}

void GlRenderer::State::drawSky() {
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_GEQUAL);
  glUseProgram(sky.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDepthFunc(GL_GREATER);
}

void GlRenderer::State::darkenHollows() {
  target.beginOverlay();
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ZERO, GL_SRC_COLOR);
  glUseProgram(hollows.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
  target.endOverlay();
}

GlRenderer::GlRenderer(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device)
    : state_(std::make_unique<State>(std::move(scene), device)) {}

GlRenderer::~GlRenderer() = default;

Frame GlRenderer::render(const scene::Snapshot& snapshot, const Camera& camera,
                         const FrameOptions& options) {
  if (const auto why = refusal(camera)) throw RenderError(*why);
  State& s = *state_;
  s.context.makeCurrent();
  s.prepare();
  const Channels& channels = options.channels;
  DrawList list;
  appendVisible(list, {s.scene->model(), s.parts, s.buffers.ranges, s.buffers.materials},
                placementsOf(*s.scene, snapshot), camera, options);
  s.setUp(camera, channels);
  s.drawBatches(list, s.buffers.vertices, s.buffers.indices, false, channels.normals);
  s.drawAvatars(avatarMeshes(snapshot, options.hidden), camera, channels.normals);
  if (channels.rgb) s.drawAir(list);
  Frame frame;
  frame.camera = camera;
  frame.tick = snapshot.tick;
  frame.renderer = deviceName();
  frame.software = software();
  s.target.read(frame, channels);
  checkGl("drawing a frame");
  return frame;
}

const std::string& GlRenderer::deviceNote() const {
  return state_->context.note();
}
const std::string& GlRenderer::deviceName() const {
  return state_->context.deviceName();
}
bool GlRenderer::software() const {
  return state_->context.software();
}

}  // namespace enfilade::render
