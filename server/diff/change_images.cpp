// Steps: choose the moments worth a picture, worst first; make both walks again up to them, for
// whoever stands where then; find a standpoint from which the place is seen, by rays; draw it in
// both models, side by side.
#include "server/diff/change_images.hpp"

#include <spdlog/spdlog.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "protocol/recording/recording.hpp"
#include "scene/world/queries/ray_caster.hpp"
#include "server/capture/overlay.hpp"
#include "server/diff/difference_report.hpp"
#include "server/messages/world_messages.hpp"
#include "server/plans/path_map.hpp"
#include "server/recording/world_recorder.hpp"
#include "server/runs/in_process_driver.hpp"

namespace enfilade::server {
namespace {

using Snapshots = std::map<std::uint64_t, std::shared_ptr<const scene::Snapshot>>;

constexpr int kWidth = 640, kHeight = 480;  // pixels of one view
constexpr int kBorder = 12, kLine = 22;     // pixels
constexpr double kOnePlace = 0.5;           // metres, and
constexpr double kOneTime = 2;              // seconds: changes so near share a picture
constexpr double kStride = 0.05;            // metres between two points of a drawn way

/// A moment worth a picture.
struct Moment {
  std::string a, b, line;
  Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
  std::uint64_t tick = 0;
  double time = 0;
  bool later = true;  ///< of the later walk
  bool worse = false;
  std::vector<std::string*> pictures;  ///< where its name is noted
};

class Moments {
 public:
  explicit Moments(std::size_t most) : most_(most) {}

  void add(Moment moment, std::string& picture) {
    for (Moment& other : list) {
      if (other.later != moment.later || other.a != moment.a || other.b != moment.b) continue;
      if ((other.point - moment.point).norm() > kOnePlace) continue;
      if (std::abs(other.time - moment.time) > kOneTime) continue;
      other.pictures.push_back(&picture);
      return;
    }
    if (list.size() == most_) return;
    moment.pictures.push_back(&picture);
    list.push_back(std::move(moment));
  }

  std::vector<Moment> list;

 private:
  std::size_t most_;
};

Moment momentOf(const HappeningChange& change) {
  const Happening& told = change.after ? *change.after : *change.before;
  return {told.a,    told.b,    lineOf(change),           told.point,   told.normal,
          told.tick, told.time, change.after.has_value(), change.worse, {}};
}

Moment momentOf(const ClearanceChange& change) {
  // Nearer: where it is near now; farther: where it was.
  const bool later = change.after && (change.least < 0 || !change.before);
  const Nearest& told = later ? *change.after : *change.before;
  return {change.a,  change.b,  lineOf(change), told.point,   Vec3::Zero(),
          told.tick, told.time, later,          change.worse, {}};
}

/// Where a walk ended, as high as a table.
Moment momentOf(const OrderChange& change) {
  const OrderEnd& told = change.after ? *change.after : *change.before;
  return {told.avatar,    told.obstacle,
          lineOf(change), told.position + Vec3(0, 0.8, 0),
          Vec3::Zero(),   told.tick,
          told.time,      change.after.has_value(),
          change.worse,   {}};
}

std::vector<Moment> momentsOf(WalkDifference& difference, std::uint32_t most) {
  Moments moments(most);
  const auto addAll = [&](auto& changes, bool worse) {
    for (auto& change : changes)
      if (change.worse == worse && change.run == 0) moments.add(momentOf(change), change.picture);
  };
  addAll(difference.happenings, true);
  for (OrderChange& change : difference.orders)
    if (change.worse && change.after && change.run == 0)
      moments.add(momentOf(change), change.picture);
  addAll(difference.clearances, true);
  for (HappeningChange& change : difference.happenings) {
    if (change.worse || change.run != 0 || change.kind == HappeningKind::ground) continue;
    moments.add(momentOf(change), change.picture);
  }
  addAll(difference.clearances, false);
  return std::move(moments.list);
}

/// Who stood where at these ticks; where a walk is shorter, at its end.
Snapshots snapshotsAt(const std::shared_ptr<const scene::Scene>& scene, const RecordedWalk& walk,
                      const std::set<std::uint64_t>& ticks) {
  Snapshots found;
  if (!scene || ticks.empty()) return found;
  protocol::RecordingReader reader(walk.file, walk.run);
  std::optional<RecordedWorld> world;
  std::optional<InProcessDriver> driver;
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
      if (world) break;
      world.emplace(scene::World(scene, lengthsFrom(start->lengths()).value()));
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

/// Looks at `point` from `eye`.
render::Camera cameraAt(const Vec3& eye, const Vec3& point) {
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

struct Standpoint {
  render::Camera camera;
  scene::EntityId hidden = 0;  ///< whose eyes these are
};

/// From which the place is seen: beside the one who came there, in the same room.
class Standpoints {
 public:
  explicit Standpoints(const std::shared_ptr<const scene::Scene>& scene) : rays_(scene) {}

  Standpoint find(const Moment& moment, const scene::Snapshot& snapshot) {
    rays_.follow(snapshot);
    const scene::AvatarView* who = avatarNamed(snapshot, moment.a);
    const Vec3 eyes = who ? Vec3(who->feet + Vec3(0, who->eyeHeight, 0)) : moment.point;
    const double heading = headingFrom(moment, who);
    const scene::EntityId id = who ? who->id : 0;
    constexpr std::array<double, 10> kAside{1.2, -1.2, 0.9, -0.9, 0.5, -0.5, 1.6, -1.6, 2.4, -2.4};
    for (const double distance : {2.8, 2.0, 1.4, 4.0}) {
      for (const double aside : kAside) {
        const double angle = heading + aside;
        Vec3 eye = moment.point + distance * Vec3(std::cos(angle), 0, std::sin(angle));
        eye.y() = std::max(moment.point.y() + 0.5, eyes.y());
        if (reaches(eyes, eye, id) && sees(eye, moment.point, id))
          return {cameraAt(eye, moment.point)};
      }
    }
    // Nothing beside: through the walker's own eyes, or from above.
    if (who && (moment.point - eyes).norm() > 0.2) return {cameraAt(eyes, moment.point), id};
    return {cameraAt(moment.point + Vec3(0.3, 2, 0.3), moment.point)};
  }

 private:
  /// Radians: from the place to where it was come from.
  static double headingFrom(const Moment& moment, const scene::AvatarView* who) {
    Vec3 from = -moment.normal;
    if (std::hypot(from.x(), from.z()) < 0.1 && who) from = who->feet - moment.point;
    if (std::hypot(from.x(), from.z()) < 0.05 && who) from = -who->gaze;
    return std::atan2(from.z(), from.x());
  }

  bool reaches(const Vec3& from, const Vec3& to, scene::EntityId through) const {
    const double distance = (to - from).norm();
    // As much beyond as a picture's near plane and a wall's plaster need.
    return distance < 1e-6 || !rays_.isBlocked({from, to - from, distance + 0.15}, {through});
  }

  /// Whoever touches something stands before the place for most who look on.
  bool sees(const Vec3& eye, const Vec3& point, scene::EntityId through) const {
    constexpr double kBefore = 0.03;  // metres that may hide it
    const double distance = (point - eye).norm();
    return distance > kBefore &&
           !rays_.isBlocked({eye, point - eye, distance - kBefore}, {through});
  }

  scene::RayCaster rays_;
};

/// A ring about the place, for the eye to find it.
void drawRing(render::Image& image, const render::Camera& camera, const Vec3& point) {
  constexpr int kCorners = 32;
  constexpr double kRadius = 22, kTurn = 6.283185307179586;  // pixels
  const Vec3 at = render::project(camera, point);
  const auto corner = [&](int i) {
    const double angle = kTurn * i / kCorners;
    return std::pair(at.x() + kRadius * std::cos(angle), at.y() + kRadius * std::sin(angle));
  };
  for (int i = 0; i < kCorners; ++i) {
    const auto [x0, y0] = corner(i);
    const auto [x1, y1] = corner(i + 1);
    render::drawLine(image, x0, y0, x1, y1, 2, {214, 40, 40});
  }
}

render::Image drawn(render::Renderer& renderer, const scene::Scene& scene,
                    const scene::Snapshot& snapshot, const Standpoint& from, const Moment& moment) {
  render::FrameOptions options;
  options.hidden = from.hidden;
  const render::Frame frame = renderer.render(snapshot, from.camera, options);
  OverlayChoice choice;
  choice.contacts = true;
  Shot shot;
  shot.camera = from.camera;
  shot.contacts = {{moment.point, false}};
  render::Image image = drawOverlay(frame, choice, scene.model(), {}, shot);
  drawRing(image, from.camera, moment.point);
  return image;
}

/// `before` may be empty.
render::Image sideBySide(const render::Image& before, const render::Image& after,
                         const Moment& moment) {
  const int width = 2 * kWidth + 3 * kBorder;
  render::Image image = blankImage(width, kHeight + 2 * kBorder + 3 * kLine);
  render::drawText(image, kBorder, kBorder, moment.line, 1, kPlanInk);
  render::drawText(image, kBorder, kBorder + kLine, moment.worse ? "got worse" : "changed", 1,
                   kPlanInk);
  const int top = kBorder + 2 * kLine;
  if (!before.rgb.empty()) paste(image, before, kBorder, top);
  paste(image, after, kWidth + 2 * kBorder, top);
  const int below = top + kHeight + 6;
  render::drawText(image, kBorder, below, before.rgb.empty() ? "before: not to be had" : "before",
                   1, kPlanInk);
  render::drawText(image, kWidth + 2 * kBorder, below, "after", 1, kPlanInk);
  return image;
}

void drawMoments(std::vector<Moment>& moments, const WalkDifference& difference,
                 const ComparedModels& models, const std::filesystem::path& folder) {
  std::set<std::uint64_t> ticks;
  for (const Moment& moment : moments) ticks.insert(moment.tick);
  const Snapshots before = snapshotsAt(models.before, difference.before, ticks);
  const Snapshots after = snapshotsAt(models.after, difference.after, ticks);
  std::optional<render::Renderer> beforeRenderer;
  std::optional<Standpoints> beforeStandpoints, afterStandpoints;
  if (models.before) {
    beforeRenderer.emplace(models.before, models.drawing.renderer, models.drawing.device);
    beforeStandpoints.emplace(models.before);
  }
  afterStandpoints.emplace(models.after);
  int number = 0;
  for (Moment& moment : moments) {
    const bool there = moment.later || !models.before;
    const Standpoint from = there ? afterStandpoints->find(moment, *after.at(moment.tick))
                                  : beforeStandpoints->find(moment, *before.at(moment.tick));
    render::Image was;
    if (models.before)
      was = drawn(*beforeRenderer, *models.before, *before.at(moment.tick), from, moment);
    const render::Image is =
        drawn(*models.afterRenderer, *models.after, *after.at(moment.tick), from, moment);
    char name[40];
    std::snprintf(name, sizeof name, "changes/%03d.png", ++number);
    render::writePng(folder / name, sideBySide(was, is, moment));
    for (std::string* picture : moment.pictures) *picture = name;
  }
}

/// The ways of a walk's first run, thinned out.
std::vector<WalkedPath> waysOf(const RecordedWalk& walk, const std::string& suffix,
                               scene::EntityId aside) {
  std::map<std::string, WalkedPath> ways;
  protocol::RecordingReader reader(walk.file, walk.run);
  std::uint64_t last = 0;
  while (const auto item = reader.next()) {
    const auto* state = std::get_if<v1::State>(&*item);
    if (!state) continue;
    if (state->tick() <= last) break;  // the world begins anew
    last = state->tick();
    for (const v1::AvatarState& avatar : state->avatars()) {
      WalkedPath& way = ways[avatar.name()];
      const Vec3 feet = vectorFrom(avatar.feet());
      if (way.feet.empty()) {
        way.avatar = avatar.name() + suffix;
        way.id = avatar.id() + aside;
      }
      if (way.feet.empty() || (way.feet.back() - feet).norm() > kStride) way.feet.push_back(feet);
    }
  }
  std::vector<WalkedPath> list;
  for (auto& [name, way] : ways) list.push_back(std::move(way));
  return list;
}

void drawChangeMap(const WalkDifference& difference, const ComparedModels& models,
                   const std::filesystem::path& folder) {
  WalkTrace trace;
  trace.title = "what got worse, in " + difference.after.runs.front().start.scene().source();
  // The later ways are drawn over the earlier ones and take the colours that pictures have.
  trace.paths = waysOf(difference.before, ", before", 7);
  for (WalkedPath& way : waysOf(difference.after, ", after", 0))
    trace.paths.push_back(std::move(way));
  for (const HappeningChange& change : difference.happenings) {
    if (!change.worse || change.run != 0) continue;
    auto& marks = change.kind == HappeningKind::contact ? trace.contacts : trace.stops;
    marks.push_back({change.after->point, Vec3::UnitX()});
  }
  for (const OrderChange& change : difference.orders)
    if (change.worse && change.after && change.run == 0)
      trace.stops.push_back({change.after->position, Vec3::UnitX()});
  const scene::Snapshot still = *scene::World(models.after).snapshot();
  const auto picture = [&](const render::Camera& camera) -> std::optional<PlanPicture> {
    const render::Frame frame = models.afterRenderer->render(still, camera);
    return PlanPicture{render::colourOf(frame), frame.ids};
  };
  const auto map = drawMap(trace, {picture, models.after.get()});
  if (map) render::writePng(folder / "changes" / "map.png", *map);
}

/// Makes the folder; pictures of an earlier run would be taken for ones of this.
void prepare(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    const bool number = stem.find_first_not_of("0123456789") == std::string::npos;
    if (entry.path().extension() == ".png" && (number || stem == "map"))
      std::filesystem::remove(entry.path());
  }
}

}  // namespace

void drawChanges(WalkDifference& difference, const ComparedModels& models, std::uint32_t most,
                 const std::filesystem::path& folder) {
  prepare(folder / "changes");
  std::vector<Moment> moments = momentsOf(difference, most);
  if (moments.empty()) return;
  drawMoments(moments, difference, models, folder);
  drawChangeMap(difference, models, folder);
  spdlog::info("{} pictures of what changed in {}", moments.size(), (folder / "changes").string());
}

}  // namespace enfilade::server
