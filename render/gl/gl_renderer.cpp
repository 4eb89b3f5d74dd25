// A picture, step by step: the depth of what the camera may see of the model, of bodies where they
// are, and of avatars; then colour, id and normal of what has that depth, once a pixel; then the
// sky where nothing was drawn and glass over it all (colour only); shade in hollows is put on what
// was read back.
//
// Which parts are drawn:
//
// 1. Those that a picture from nearby showed are drawn into the depth.
// 2. It is read back, and what else may be seen in front of it is searched for (part_search.hpp).
//    Mostly that is nothing, or little, which is drawn into the depth, too. Where much was found
//    (nothing was known of this view), it is searched among: the nearest are drawn first, which
//    hides most of the others, then twice as many, and so on.
// 3. What may be seen by the last depth that was read is shaded. Where neither colours nor
//    normals are wanted, ids are drawn with the depth, and that is all unless something was
//    missing.
//
// In a small scene where hardly anything is hidden, all that lies in the picture is drawn and
// shaded at once instead.
//
// Where shadows are wanted, which pixels the sun reaches is asked between depth and colour; all
// that is in the picture is then drawn into the depth first, too.
//
// Why the picture is that of drawing everything: in a pixel the nearest fragment wins, among equals
// the one drawn last. What is left out lies, wherever it has a fragment, behind something that is
// drawn; so each pixel's winner is among what is drawn, and what is shaded keeps its order.
#include "render/gl/gl_renderer.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "render/gl/dynamic_instances.hpp"
#include "render/gl/egl_context.hpp"
#include "render/gl/occlusion_culler.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/scene_buffers.hpp"
#include "render/gl/surface_pass.hpp"
#include "render/gl/visibility_cache.hpp"

namespace enfilade::render {
namespace {

// So few that were not foreseen are drawn with what was; among more is searched first.
constexpr std::size_t kFewMissing = 256;
constexpr std::size_t kFirstChunk = 512;  // parts of the first drawing of a search; then twice ...
constexpr int kMostChunks = 24;           // ... as many each time: more than there can be
// What is drawn is looked at again every so many pictures: whether it is still seen, or in the
// picture at all.
constexpr std::uint64_t kLookAgain = 8, kForgetOutside = 64;

// Of so few it is quick to say how much lies in the picture.
constexpr std::size_t kFewParts = 256;

/// What is drawn of the model and of the avatars.
struct Choice {
  std::vector<std::uint32_t> parts;   ///< ascending
  std::vector<std::uint32_t> pieces;  ///< of AvatarMeshes, ascending
};

void add(std::vector<std::uint32_t>& all, const std::vector<std::uint32_t>& more) {
  std::vector<std::uint32_t> merged;
  merged.reserve(all.size() + more.size());
  std::set_union(all.begin(), all.end(), more.begin(), more.end(), std::back_inserter(merged));
  all = std::move(merged);
}

/// One picture that is being made.
struct Job {
  const Camera& camera;
  const FrameOptions& options;
  const Sunlit& sunlit;
  BoxSight sight;
  FrameStatistics statistics;
  std::vector<float> metres;  ///< Frame::depth; empty: nobody needed it yet

  bool shadows() const { return options.shadows && options.channels.rgb; }
};

}  // namespace

struct GlRenderer::State {
  std::shared_ptr<const scene::Scene> scene;
  EglContext context;  // before all that lives in it
  ModelBuffers buffers;
  std::vector<Part> parts;
  std::optional<PartSearch> search;
  std::optional<SurfacePass> pass;  // empty: nothing of the above was brought to the device yet
  MovingThings moving;
  FrameTarget target;
  SeenMemory memory;
  DepthPyramid depth;
  bool depthIsOfPicture = false;  // `depth` is that of all that is drawn
  std::uint64_t picture = 0;

  State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device);
  ~State();
  void prepare();
  scene::Box boxOf(std::uint32_t part) const;
  bool isGlass(const Job& job, std::uint32_t part) const;
  DrawList drawSurfaces(const Job& job, const Choice& choice);
  void drawAir(const DrawList& glass);
  void readDepth(const Camera& camera);
  const std::vector<float>& metresIn(Job& job);
  void shadeNearest(Job& job);
  std::size_t trianglesOf(const std::vector<std::uint32_t>& some) const;
  Choice inside(const Job& job) const;
  bool hardlyHidden(const Job& job, const Choice& all) const;
  DrawList drawInside(Job& job, const Choice& all);
  DrawList drawSeen(Job& job);
  Choice foreseen(const Job& job, const Seen& seen) const;
  Choice missing(Job& job, const Choice& drawn);
  Choice searchAmong(Job& job, Choice drawn, Choice missing);
  Choice notHidden(const Job& job, const Choice& drawn) const;
  void remember(const Job& job, const Choice& drawn, Seen& seen) const;
};

GlRenderer::State::State(std::shared_ptr<const scene::Scene> shared, const DeviceChoice& device)
    : scene(std::move(shared)), context(device) {
  if (!scene) throw RenderError("GlRenderer: there is no scene");
}

/// A scene that nobody looks at is never brought to the device.
void GlRenderer::State::prepare() {
  if (pass) return;
  buffers = uploadModel(scene->model());
  parts = partsOf(scene->model());
  search.emplace(parts);
  pass.emplace();
}

GlRenderer::State::~State() {
  // The members below the context delete their GL names in it.
  try {
    context.makeCurrent();
  } catch (const RenderError&) {
    // Destroyed on a wrong thread: the names die with the context.
  }
}

scene::Box GlRenderer::State::boxOf(std::uint32_t part) const {
  return placedBox(parts[part], moving.bodies());
}

bool GlRenderer::State::isGlass(const Job& job, std::uint32_t part) const {
  return parts[part].pass == Pass::blend && job.options.glass == Glass::clear;
}

/// Returns the glass, which is to be drawn last.
DrawList GlRenderer::State::drawSurfaces(const Job& job, const Choice& choice) {
  DrawLists lists = drawLists({scene->model(), parts, buffers.ranges, buffers.materials},
                              moving.bodies(), job.camera, job.options, choice.parts);
  pass->draw(lists.surfaces, {buffers.vertices.name(), buffers.indices.name(), buffers.textures});
  pass->draw(drawList(moving.avatars(), job.camera, choice.pieces),
             moving.avatarGeometry(buffers.textures));
  return std::move(lists.glass);
}

/// What has a colour only.
void GlRenderer::State::drawAir(const DrawList& glass) {
  target.drawInto({true, false, false, false});
  pass->drawSky();
  if (glass.commands.empty()) return;
  pass->blendGlass();
  pass->draw(glass, {buffers.vertices.name(), buffers.indices.name(), buffers.textures});
}

void GlRenderer::State::readDepth(const Camera& camera) {
  target.readDepth(depth.base(camera.width, camera.height));
  depthIsOfPicture = true;
}

/// Of the picture as it is drawn now.
const std::vector<float>& GlRenderer::State::metresIn(Job& job) {
  if (!depthIsOfPicture) readDepth(job.camera);
  if (job.metres.empty())
    job.metres = metresOf(depth.base(job.camera.width, job.camera.height), job.camera);
  return job.metres;
}

/// When all depth is drawn.
void GlRenderer::State::shadeNearest(Job& job) {
  const Channels& channels = job.options.channels;
  target.drawInto(channels);
  if (job.shadows()) target.lightBy(job.sunlit(metresIn(job)));
  pass->shadeNearest(channels.normals, job.shadows());
}

std::size_t GlRenderer::State::trianglesOf(const std::vector<std::uint32_t>& some) const {
  std::size_t triangles = 0;
  for (const std::uint32_t part : some)
    triangles += buffers.ranges[parts[part].mesh].indexCount / 3;
  return triangles;
}

/// All that lies in the picture.
Choice GlRenderer::State::inside(const Job& job) const {
  Choice all;
  all.parts = partsInPicture(parts, moving.bodies(), job.camera, job.options.hidden);
  const std::vector<AvatarMeshes::Piece>& pieces = moving.avatars().pieces;
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].id == job.options.hidden) continue;
    if (!job.sight.outside(job.sight.relative(pieces[i].box))) all.pieces.push_back(i);
  }
  return all;
}

/// Whether a picture from nearby showed at least half of the triangles: to draw what is seen twice,
/// into the depth and shaded, takes longer then than to draw all once.
bool GlRenderer::State::hardlyHidden(const Job& job, const Choice& all) const {
  const Seen* seen = memory.find(job.camera);
  return seen && trianglesOf(all.parts) <= 2 * trianglesOf(foreseen(job, *seen).parts);
}

DrawList GlRenderer::State::drawInside(Job& job, const Choice& all) {
  job.statistics.drawn = static_cast<std::uint32_t>(all.parts.size());
  job.statistics.outside = static_cast<std::uint32_t>(parts.size() - all.parts.size());
  if (job.shadows()) {
    target.drawInto({false, false, false, false});
    pass->toDepth();
    drawSurfaces(job, all);
    shadeNearest(job);
  } else {
    pass->shadeAll(job.options.channels.normals);
  }
  return drawSurfaces(job, all);
}

/// What was seen from nearby and lies in this picture.
Choice GlRenderer::State::foreseen(const Job& job, const Seen& seen) const {
  Choice choice;
  for (const std::uint32_t part : seen.parts) {
    if (parts[part].object + 1 == job.options.hidden) continue;
    if (!job.sight.outside(job.sight.relative(boxOf(part)))) choice.parts.push_back(part);
  }
  const std::vector<AvatarMeshes::Piece>& pieces = moving.avatars().pieces;
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].id == job.options.hidden) continue;
    if (!std::binary_search(seen.avatars.begin(), seen.avatars.end(), pieces[i].id)) continue;
    if (!job.sight.outside(job.sight.relative(pieces[i].box))) choice.pieces.push_back(i);
  }
  return choice;
}

/// What may be seen besides `drawn`, whose depth is in `depth`.
Choice GlRenderer::State::missing(Job& job, const Choice& drawn) {
  search->markDrawn(drawn.parts);
  PartSearch::Found found = search->search(job.sight, depth, moving.bodies(), job.options.hidden);
  job.statistics.outside = found.outside;
  Choice choice;
  choice.parts = std::move(found.parts);
  const std::vector<AvatarMeshes::Piece>& pieces = moving.avatars().pieces;
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].id == job.options.hidden) continue;
    if (std::binary_search(drawn.pieces.begin(), drawn.pieces.end(), i)) continue;
    const EyeBox box = job.sight.relative(pieces[i].box);
    if (job.sight.look(box, depth) == Sight::maybe) choice.pieces.push_back(i);
  }
  return choice;
}

/// Draws what is missing into the depth, the nearest first, as long as any of it may be seen.
/// Returns what may be seen of all that was drawn.
Choice GlRenderer::State::searchAmong(Job& job, Choice drawn, Choice missing) {
  const auto maybe = [&](std::uint32_t part) {
    return job.sight.look(job.sight.relative(boxOf(part)), depth) == Sight::maybe;
  };
  std::vector<std::pair<double, std::uint32_t>> left;  // squared metres to the nearest point
  for (const std::uint32_t part : missing.parts) {
    const EyeBox box = job.sight.relative(boxOf(part));
    left.emplace_back((box.centre.cwiseAbs() - box.half).cwiseMax(0.0).squaredNorm(), part);
  }
  std::sort(left.begin(), left.end());
  std::size_t most = kFirstChunk;
  for (int i = 0; i < kMostChunks && !left.empty(); ++i, most *= 2) {
    const auto end = left.begin() + static_cast<std::ptrdiff_t>(std::min(most, left.size()));
    Choice chunk;
    for (auto entry = left.begin(); entry != end; ++entry) chunk.parts.push_back(entry->second);
    std::sort(chunk.parts.begin(), chunk.parts.end());
    if (i == 0) chunk.pieces = missing.pieces;
    left.erase(left.begin(), end);
    drawSurfaces(job, chunk);
    add(drawn.parts, chunk.parts);
    readDepth(job.camera);
    depth.build();
    ++job.statistics.passes;
    std::erase_if(left, [&](const auto& entry) { return !maybe(entry.second); });
  }
  add(drawn.pieces, missing.pieces);
  return notHidden(job, drawn);
}

/// For the next picture: what was drawn, less what is no longer seen, and what was seen and lies
/// beside the picture now.
void GlRenderer::State::remember(const Job& job, const Choice& drawn, Seen& seen) const {
  std::vector<std::uint32_t> kept;
  for (const std::uint32_t part : drawn.parts) {
    const bool due = seen.parts.empty() || (part + picture) % kLookAgain == 0;
    if (due && job.sight.look(job.sight.relative(boxOf(part)), depth) == Sight::hidden) continue;
    kept.push_back(part);
  }
  for (const std::uint32_t part : seen.parts) {
    if (std::binary_search(drawn.parts.begin(), drawn.parts.end(), part)) continue;
    if ((part + picture) % kForgetOutside != 0) kept.push_back(part);
  }
  std::sort(kept.begin(), kept.end());
  seen.parts = std::move(kept);
  seen.avatars.clear();
  for (const std::uint32_t piece : drawn.pieces)
    seen.avatars.push_back(moving.avatars().pieces[piece].id);
  std::sort(seen.avatars.begin(), seen.avatars.end());
}

/// What may be seen by the depth that was read last.
Choice GlRenderer::State::notHidden(const Job& job, const Choice& drawn) const {
  Choice seen;
  seen.pieces = drawn.pieces;
  for (const std::uint32_t part : drawn.parts) {
    if (job.sight.look(job.sight.relative(boxOf(part)), depth) == Sight::maybe)
      seen.parts.push_back(part);
  }
  return seen;
}

/// What may be seen.
DrawList GlRenderer::State::drawSeen(Job& job) {
  if (parts.size() <= kFewParts) {
    const Choice all = inside(job);
    if (hardlyHidden(job, all)) return drawInside(job, all);
  }
  Seen& seen = memory.recall(job.camera, ++picture);
  Choice drawn = foreseen(job, seen);
  const Channels& channels = job.options.channels;
  bool done = !channels.rgb && !channels.normals;
  target.drawInto({false, done && channels.ids, false, false});
  pass->toDepth();
  drawSurfaces(job, drawn);
  readDepth(job.camera);
  depth.build();
  Choice more = missing(job, drawn);
  if (more.parts.size() > kFewMissing) {
    done = false;
    drawn = searchAmong(job, std::move(drawn), std::move(more));
  } else {
    const bool glassOnly =
        more.pieces.empty() && std::all_of(more.parts.begin(), more.parts.end(),
                                           [&](std::uint32_t p) { return isGlass(job, p); });
    if (!glassOnly) {
      done = false;  // what was missing may come before what was drawn in the order
      drawSurfaces(job, more);
      // Now, and not when all is shaded: what needs the depth is worked out while the device
      // shades. The pyramid stays as it is, farther in places than the picture, which hides too
      // little; where nothing had been drawn it hides nothing.
      readDepth(job.camera);
      if (drawn.parts.empty()) depth.build();
      ++job.statistics.passes;
    }
    add(drawn.parts, more.parts);
    add(drawn.pieces, more.pieces);
  }
  const Choice shaded = notHidden(job, drawn);
  DrawList glass;
  if (!done) {
    shadeNearest(job);
    glass = drawSurfaces(job, shaded);
  }
  remember(job, drawn, seen);
  job.statistics.drawn = static_cast<std::uint32_t>(shaded.parts.size());
  job.statistics.occluded =
      static_cast<std::uint32_t>(parts.size()) - job.statistics.drawn - job.statistics.outside;
  return glass;
}

GlRenderer::GlRenderer(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device)
    : state_(std::make_unique<State>(std::move(scene), device)) {}

GlRenderer::~GlRenderer() = default;

Frame GlRenderer::render(const scene::Snapshot& snapshot, const Camera& camera,
                         const FrameOptions& options, const Sunlit& sunlit) {
  if (const auto why = refusal(camera)) throw RenderError(*why);
  State& s = *state_;
  s.context.makeCurrent();
  s.prepare();
  s.moving.follow(*s.scene, snapshot);
  if (!s.target.fits(camera.width, camera.height)) {
    s.target = FrameTarget(camera.width, camera.height);
  }
  s.pass->begin(camera);
  s.target.begin(options.channels);
  s.depthIsOfPicture = false;
  Job job{camera, options, sunlit, BoxSight(camera), {}, {}};
  if (job.shadows() && !sunlit) throw RenderError("GlRenderer: nobody finds what is in shadow");
  const DrawList glass =
      options.culling == Culling::hidden ? s.drawSeen(job) : s.drawInside(job, s.inside(job));
  if (options.channels.rgb) s.drawAir(glass);
  Frame frame;
  frame.camera = camera;
  frame.tick = snapshot.tick;
  frame.renderer = deviceName();
  frame.software = software();
  frame.statistics = job.statistics;
  if (options.channels.depth || options.channels.rgb) {
    glFlush();  // where the depth was read before, the device draws while this thread goes on
    s.metresIn(job);
    frame.depth = std::move(job.metres);
  }
  if (options.channels.rgb) s.target.readColour(frame, Hollows(frame.depth, camera));
  s.target.read(frame, options.channels);
  if (!options.channels.depth) frame.depth = {};
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
