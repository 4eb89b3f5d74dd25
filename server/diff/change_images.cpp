// Steps: choose the moments for pictures, worst first. Replay both walks to get the avatars'
// positions at these moments. Find a viewpoint with a free line of sight, by ray casts. Render
// both models side by side.
#include "server/diff/change_images.hpp"

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "protocol/recording/recording.hpp"
#include "scene/world/queries/ray_caster.hpp"
#include "server/capture/overlay.hpp"
#include "server/diff/difference_text.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"
#include "server/plans/path_map.hpp"
#include "server/recording/world_recorder.hpp"
#include "server/runs/in_process_driver.hpp"

namespace enfilade::server {
namespace {

using Snapshots = std::map<std::uint64_t, std::shared_ptr<const scene::Snapshot>>;

constexpr int kWidth = 640, kHeight = 480;      // pixels of one view
constexpr int kBorder = 12, kLine = 22;         // pixels
constexpr double kRingRadius = 22;              // pixels, around the changed point
constexpr double kSharedPictureDistance = 0.5;  // metres, and
constexpr double kSharedPictureTime = 2;        // seconds: closer changes share a picture
constexpr double kTrailStep = 0.05;             // metres between two points of a drawn path

/// A moment of a walk for which a picture is made.
struct Moment {
  std::string a, b, line;
  Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
  std::uint64_t tick = 0;
  double time = 0;
  bool inLaterWalk = true;  ///< the moment belongs to the later walk
  bool worse = false;
  std::vector<std::string*> pictures;  ///< fields that receive the picture's name
};

class MomentList {
 public:
  explicit MomentList(std::size_t maxPictures) : maxMoments_(maxPictures) {}

  void add(Moment moment, std::string& picture) {
    for (Moment& other : moments) {
      if (other.inLaterWalk != moment.inLaterWalk || other.a != moment.a || other.b != moment.b)
        continue;
      if ((other.point - moment.point).norm() > kSharedPictureDistance) continue;
      if (std::abs(other.time - moment.time) > kSharedPictureTime) continue;
      other.pictures.push_back(&picture);
      return;
    }
    if (moments.size() == maxMoments_) return;
    moment.pictures.push_back(&picture);
    moments.push_back(std::move(moment));
  }

  std::vector<Moment> moments;

 private:
  std::size_t maxMoments_;
};

Moment makeMoment(const WalkEventChange& change) {
  const WalkEvent& current = change.after ? *change.after : *change.before;
  return {current.a,    current.b,    formatLine(change),       current.point, current.normal,
          current.tick, current.time, change.after.has_value(), change.worse,  {}};
}

Moment makeMoment(const ClearanceChange& change) {
  // A smaller clearance is shown in the later walk, a larger one in the earlier.
  const bool later = change.after && (change.minChange < 0 || !change.before);
  const Nearest& current = later ? *change.after : *change.before;
  return {change.a,           change.b,
          formatLine(change), current.point,
          Vec3::Zero(),       current.tick,
          current.time,       later,
          change.worse,       {}};
}

/// Makes the moment at the end of an order, at the height of a table.
Moment makeMoment(const OrderChange& change) {
  const FinishedOrder& current = change.after ? *change.after : *change.before;
  return {current.avatar,     current.obstacle,
          formatLine(change), current.position + Vec3(0, 0.8, 0),
          Vec3::Zero(),       current.tick,
          current.time,       change.after.has_value(),
          change.worse,       {}};
}

std::vector<Moment> collectMoments(WalkDifference& difference, std::uint32_t maxPictures) {
  MomentList moments(maxPictures);
  const auto addAll = [&](auto& changes, bool worse) {
    for (auto& change : changes)
      if (change.worse == worse && change.run == 0) moments.add(makeMoment(change), change.picture);
  };
  addAll(difference.events, true);
  for (OrderChange& change : difference.orders)
    if (change.worse && change.after && change.run == 0)
      moments.add(makeMoment(change), change.picture);
  addAll(difference.clearances, true);
  for (WalkEventChange& change : difference.events) {
    if (change.worse || change.run != 0 || change.kind == WalkEventKind::ground) continue;
    moments.add(makeMoment(change), change.picture);
  }
  addAll(difference.clearances, false);
  return std::move(moments.moments);
}

/// Replays a walk and returns its snapshots at these ticks; after its end, the last snapshot.
Snapshots replaySnapshots(const std::shared_ptr<const scene::Scene>& scene,
                          const RecordedWalk& walk, const std::set<std::uint64_t>& ticks) {
  Snapshots found;
  if (!scene || ticks.empty()) return found;
  protocol::RecordingReader reader(walk.file, walk.run);
  std::optional<RecordableWorld> world;
  std::optional<InProcessDriver> driver;
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (world) break;
      world.emplace(scene::World(scene, settingsFromProto(start->lengths()).value()));
      driver.emplace(*world, nullptr);
    }
    if (!driver) continue;
    if (const auto* commands = std::get_if<v1::RecordedCommands>(&*item)) {
      for (const auto& one : commands->commands())
        one.has_body() ? driver->submit(one.body()) : driver->submit(one.avatar());
    }
    if (!std::holds_alternative<v1::State>(*item)) continue;
    const std::uint64_t tick = driver->step().tick;
    if (ticks.contains(tick)) found[tick] = world->snapshot();
    if (tick >= *ticks.rbegin()) break;
  }
  for (const std::uint64_t tick : ticks)
    if (world) found.try_emplace(tick, world->snapshot());
  return found;
}

/// Makes a camera at `eye` that looks at `point`.
render::Camera makeLookAtCamera(const Vec3& eye, const Vec3& point) {
  render::Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.eye = eye;
  camera.forward = (point - eye).normalized();
  const bool steep = std::hypot(camera.forward.x(), camera.forward.z()) < 1e-3;
  camera.up = steep ? Vec3::UnitX() : Vec3::UnitY();
  camera.fovY = 1.0;
  return camera;
}

struct Viewpoint {
  render::Camera camera;
  scene::EntityId hiddenAvatar = 0;  ///< avatar at the viewpoint, which is not drawn
};

/// Finds viewpoints of a moment: next to the avatar, in the same room.
class ViewpointFinder {
 public:
  explicit ViewpointFinder(const std::shared_ptr<const scene::Scene>& scene) : rays_(scene) {}

  Viewpoint find(const Moment& moment, const scene::Snapshot& snapshot) {
    rays_.update(snapshot);
    const scene::AvatarSnapshot* avatar = findAvatar(snapshot, moment.a);
    const Vec3 eyes =
        avatar ? Vec3(avatar->footPosition + Vec3(0, avatar->eyeHeight, 0)) : moment.point;
    const double heading = computeApproachHeading(moment, avatar);
    const scene::EntityId id = avatar ? avatar->id : 0;
    constexpr std::array<double, 10> kSideAngles{1.2,  -1.2, 0.9,  -0.9, 0.5,
                                                 -0.5, 1.6,  -1.6, 2.4,  -2.4};
    for (const double distance : {2.8, 2.0, 1.4, 4.0}) {
      for (const double sideAngle : kSideAngles) {
        const double angle = heading + sideAngle;
        Vec3 eye = moment.point + distance * Vec3(std::cos(angle), 0, std::sin(angle));
        eye.y() = std::max(moment.point.y() + 0.5, eyes.y());
        if (hasClearPath(eyes, eye, id) && isVisible(eye, moment.point, id))
          return {makeLookAtCamera(eye, moment.point)};
      }
    }
    // No viewpoint next to the avatar: use the avatar's eyes, or look from above.
    if (avatar && (moment.point - eyes).norm() > 0.2)
      return {makeLookAtCamera(eyes, moment.point), id};
    return {makeLookAtCamera(moment.point + Vec3(0.3, 2, 0.3), moment.point)};
  }

 private:
  /// Heading from the point towards the avatar's origin, radians.
  static double computeApproachHeading(const Moment& moment, const scene::AvatarSnapshot* avatar) {
    Vec3 from = -moment.normal;
    if (std::hypot(from.x(), from.z()) < 0.1 && avatar) from = avatar->footPosition - moment.point;
    if (std::hypot(from.x(), from.z()) < 0.05 && avatar) from = -avatar->viewDirection;
    return std::atan2(from.z(), from.x());
  }

  bool hasClearPath(const Vec3& from, const Vec3& to, scene::EntityId ignoredEntity) const {
    const double distance = (to - from).norm();
    // The margin keeps the near plane out of walls.
    return distance < 1e-6 || !rays_.isBlocked({from, to - from, distance + 0.15}, {ignoredEntity});
  }

  /// True if the point is visible. The touching avatar itself is ignored, because it often hides
  /// it.
  bool isVisible(const Vec3& eye, const Vec3& point, scene::EntityId ignoredEntity) const {
    constexpr double kMaxOccluderDepth = 0.03;  // metres; closer occluders are ignored
    const double distance = (point - eye).norm();
    return distance > kMaxOccluderDepth &&
           !rays_.isBlocked({eye, point - eye, distance - kMaxOccluderDepth}, {ignoredEntity});
  }

  scene::RayCaster rays_;
};

render::Image renderMoment(render::RendererSelector& renderer, const scene::Scene& scene,
                           const scene::Snapshot& snapshot, const Viewpoint& from,
                           const Moment& moment) {
  render::FrameOptions options;
  options.hiddenEntity = from.hiddenAvatar;
  options.automaticShadows = true;
  options.samples = 4;
  const render::Frame frame = renderer.render(snapshot, from.camera, options);
  OverlayChoice choice;
  choice.contacts = true;
  CaptureFrame captureFrame;
  captureFrame.camera = from.camera;
  captureFrame.contacts = {{moment.point, false}};
  render::Canvas canvas(
      drawOverlay(frame, choice, scene.model(), scene.objectClasses(), {}, captureFrame));
  const Vec3 at = render::project(from.camera, moment.point);
  canvas.arc({at.x(), at.y()}, kRingRadius, 0, 2 * M_PI, 2, {214, 40, 40});
  return canvas.toImage();
}

/// Composes both views with captions. `before` may be empty.
render::Image composeSideBySide(const render::Image& before, const render::Image& after,
                                const Moment& moment) {
  const int width = 2 * kWidth + 3 * kBorder;
  render::Canvas canvas(width, kHeight + 2 * kBorder + 3 * kLine, kPlanPaper);
  render::TextStyle style;
  style.size = 13, style.colour = kPlanInk;
  canvas.text({kBorder, kBorder}, canvas.shorten(moment.line, style, width - 2 * kBorder), style);
  canvas.text({kBorder, kBorder + kLine}, moment.worse ? "got worse" : "changed", style);
  const double top = kBorder + 2 * kLine, right = kWidth + 2 * kBorder, below = top + kHeight + 4;
  if (!before.rgb.empty()) canvas.image(before, {kBorder, top}, kWidth, kHeight);
  canvas.image(after, {right, top}, kWidth, kHeight);
  canvas.text({kBorder, below}, before.rgb.empty() ? "before: not available" : "before", style);
  canvas.text({right, below}, "after", style);
  return canvas.toImage();
}

void drawMoments(std::vector<Moment>& moments, const WalkDifference& difference,
                 const ComparedModels& models, const std::filesystem::path& folder) {
  std::set<std::uint64_t> ticks;
  for (const Moment& moment : moments) ticks.insert(moment.tick);
  const Snapshots before = replaySnapshots(models.before, difference.before, ticks);
  const Snapshots after = replaySnapshots(models.after, difference.after, ticks);
  std::optional<render::RendererSelector> beforeRenderer;
  std::optional<ViewpointFinder> beforeFinder, afterFinder;
  if (models.before) {
    beforeRenderer.emplace(models.before, models.drawing.renderer, models.drawing.device);
    beforeFinder.emplace(models.before);
  }
  afterFinder.emplace(models.after);
  int number = 0;
  for (Moment& moment : moments) {
    const bool showAfter = moment.inLaterWalk || !models.before;
    const Viewpoint from = showAfter ? afterFinder->find(moment, *after.at(moment.tick))
                                     : beforeFinder->find(moment, *before.at(moment.tick));
    render::Image beforeImage;
    if (models.before)
      beforeImage =
          renderMoment(*beforeRenderer, *models.before, *before.at(moment.tick), from, moment);
    const render::Image afterImage =
        renderMoment(*models.afterRenderer, *models.after, *after.at(moment.tick), from, moment);
    char name[40];
    std::snprintf(name, sizeof name, "changes/%03d.png", ++number);
    render::writePng(folder / name, composeSideBySide(beforeImage, afterImage, moment));
    for (std::string* picture : moment.pictures) *picture = name;
  }
}

/// Reads the paths of a walk's first run, thinned out, by the names of the avatars.
std::map<std::string, WalkedPath> readPaths(const RecordedWalk& walk, bool isEarlier) {
  std::map<std::string, WalkedPath> paths;
  protocol::RecordingReader reader(walk.file, walk.run);
  std::uint64_t last = 0;
  while (const auto item = reader.next()) {
    const auto* state = std::get_if<v1::State>(&*item);
    if (!state) continue;
    if (state->tick() <= last) break;  // the world restarts
    last = state->tick();
    for (const v1::AvatarState& avatar : state->avatars()) {
      WalkedPath& path = paths[avatar.name()];
      const Vec3 footPosition = vectorFromProto(avatar.feet());
      if (path.footPositions.empty()) {
        path.avatar = avatar.name() + (isEarlier ? ", before" : ", after");
        path.id = avatar.id();
        path.isEarlier = isEarlier;
      }
      if (path.footPositions.empty() ||
          (path.footPositions.back() - footPosition).norm() > kTrailStep)
        path.footPositions.push_back(footPosition);
    }
  }
  return paths;
}

void drawChangeMap(const WalkDifference& difference, const ComparedModels& models,
                   const std::filesystem::path& folder) {
  WalkTrace trace;
  trace.title = "regressions in " + difference.after.runs.front().start.scene().source();
  // Later paths are drawn over earlier ones and have the avatars' colours of the pictures.
  std::map<std::string, WalkedPath> before = readPaths(difference.before, true);
  std::map<std::string, WalkedPath> after = readPaths(difference.after, false);
  // Ids depend on the number of objects: an avatar may have another one in the changed model.
  for (auto& [name, path] : before)
    if (const auto later = after.find(name); later != after.end()) path.id = later->second.id;
  for (auto* paths : {&before, &after})
    for (auto& [name, path] : *paths) trace.paths.push_back(std::move(path));
  for (const WalkEventChange& change : difference.events) {
    if (!change.worse || change.run != 0) continue;
    auto& marks = change.kind == WalkEventKind::contact ? trace.contacts : trace.blockedWalks;
    marks.push_back({change.after->point, Vec3::UnitX()});
  }
  for (const OrderChange& change : difference.orders)
    if (change.worse && change.after && change.run == 0)
      trace.refusedOrders.push_back({change.after->position, Vec3::UnitX()});
  const PlanRenderer renderPlan =
      makePlanRenderer(*models.afterRenderer, scene::World(models.after).snapshot());
  const auto map = drawMap(trace, {renderPlan, makeFloorPlanSource(models.after)});
  if (map) render::writePng(folder / "changes" / "map.png", *map);
}

/// Creates the folder and removes pictures of an earlier run.
void preparePictureFolder(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    const bool number = stem.find_first_not_of("0123456789") == std::string::npos;
    if (entry.path().extension() == ".png" && (number || stem == "map"))
      std::filesystem::remove(entry.path());
  }
}

}  // namespace

void drawChanges(WalkDifference& difference, const ComparedModels& models,
                 std::uint32_t maxPictures, const std::filesystem::path& folder) {
  preparePictureFolder(folder / "changes");
  std::vector<Moment> moments = collectMoments(difference, maxPictures);
  if (moments.empty()) return;
  drawMoments(moments, difference, models, folder);
  drawChangeMap(difference, models, folder);
  logInfo("{} pictures of changes in {}", moments.size(), (folder / "changes").string());
}

}  // namespace enfilade::server
