#include "server/capture/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "render/image/canvas.hpp"
#include "server/floors/label_names.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Colour;
using render::Image;

constexpr double kMinBoxShare = 0.0005, kMaxBoxShare = 0.4;  // of the picture, for boxes
constexpr std::size_t kMaxNames = 16;                        // largest things with a label
constexpr double kLabelSize = 11;                            // pixels, of letters
constexpr int kLabelHeight = 14;                             // pixels
constexpr int kMaxLabelLines = 4;                            // from object to its label
constexpr double kDepthTolerance = 0.02;                     // metres; occlusion tolerance
constexpr double kTrailLift = 0.03;                          // metres of paths above floor
constexpr Colour kContact{214, 40, 40}, kNearMiss{240, 150, 20}, kPaper{250, 249, 246},
    kInk{30, 30, 36};

const render::TextStyle kLabelStyle{kLabelSize, kInk, false, 1.5, kPaper};

/// The bounding rectangle of an object's visible pixels.
struct ObjectRect {
  scene::EntityId id = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< pixels, inclusive
  std::size_t pixels = 0;
  std::int64_t sumX = 0, sumY = 0;  ///< sums of pixel coordinates

  int middleX() const { return static_cast<int>(sumX / static_cast<std::int64_t>(pixels)); }
  int middleY() const { return static_cast<int>(sumY / static_cast<std::int64_t>(pixels)); }
};

/// Rectangles of the ids, one a pixel, that fill neither too little nor too much of the picture.
/// Those of avatars come first, then the largest.
std::vector<ObjectRect> findRects(const render::Frame& frame, const std::vector<std::uint32_t>& ids,
                                  std::size_t objects) {
  std::map<scene::EntityId, ObjectRect> found;
  const int width = frame.camera.width;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const scene::EntityId id = ids[i];
    if (id == 0) continue;
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    const auto [at, isNew] = found.try_emplace(id, ObjectRect{id, x, y, x, y});
    ObjectRect& rect = at->second;
    rect.left = std::min(rect.left, x);
    rect.right = std::max(rect.right, x);
    rect.bottom = y;
    ++rect.pixels;
    rect.sumX += x;
    rect.sumY += y;
  }
  std::vector<ObjectRect> rects;
  const auto all = static_cast<double>(ids.size());
  for (const auto& [id, rect] : found) {
    const double area = static_cast<double>(rect.right - rect.left + 1) *
                        static_cast<double>(rect.bottom - rect.top + 1);
    if (static_cast<double>(rect.pixels) >= kMinBoxShare * all && area <= kMaxBoxShare * all)
      rects.push_back(rect);
  }
  std::stable_sort(rects.begin(), rects.end(), [&](const ObjectRect& a, const ObjectRect& b) {
    const bool isAvatarA = a.id > objects, isAvatarB = b.id > objects;
    return isAvatarA != isAvatarB ? isAvatarA : a.pixels > b.pixels;
  });
  return rects;
}

void drawBox(Canvas& canvas, const ObjectRect& rect) {
  canvas.rectangle({static_cast<double>(rect.left), static_cast<double>(rect.top)},
                   rect.right + 1.0 - rect.left, rect.bottom + 1.0 - rect.top, 1.5,
                   computeAvatarColour(rect.id));
}

/// The name for people of an object, or an avatar's name.
std::string findName(const scene::Model& model, const CapturePlan& plan, scene::EntityId id) {
  if (id <= model.objects.size()) {
    return makeLabelName(model.objects[id - 1].path);
  }
  for (const AvatarName& avatar : plan.avatars)
    if (avatar.id == id) return avatar.name;
  return "";
}

/// The position of a label.
struct Label {
  int left, top, width;  ///< pixels
};

bool isOverlapping(const Label& a, const Label& b) {
  return a.left < b.left + b.width && b.left < a.left + a.width &&
         std::abs(a.top - b.top) < kLabelHeight;
}

/// Finds the object's pixel next to its centre, in the row of the centre. The centre itself may be
/// a hole.
int findLabelColumn(const render::Frame& frame, const std::vector<std::uint32_t>& ids,
                    const ObjectRect& rect) {
  const int width = frame.camera.width;
  const auto row = ids.begin() + static_cast<std::ptrdiff_t>(rect.middleY()) * width;
  for (int away = 0; away < width; ++away) {
    for (const int x : {rect.middleX() - away, rect.middleX() + away})
      if (x >= 0 && x < width && row[x] == rect.id) return x;
  }
  return rect.middleX();
}

/// Places a label on the object, or as close above or below as free space allows; nullopt: no
/// space.
std::optional<Label> placeLabel(const Canvas& canvas, const render::Frame& frame,
                                const std::vector<std::uint32_t>& ids, const ObjectRect& rect,
                                const std::string& name, const std::vector<Label>& others) {
  const int width = static_cast<int>(canvas.measure(name, kLabelStyle).width) + 4;
  if (name.empty() || width > frame.camera.width) return std::nullopt;
  const int left =
      std::clamp(findLabelColumn(frame, ids, rect) - width / 2, 1, frame.camera.width - width);
  for (int lines = 0; lines <= kMaxLabelLines; ++lines) {
    for (const int shift : {-lines, lines}) {
      const Label label{left, rect.middleY() - kLabelHeight / 2 + shift * kLabelHeight, width};
      const bool inside = label.top >= 1 && label.top + kLabelHeight <= frame.camera.height;
      if (inside && std::none_of(others.begin(), others.end(),
                                 [&](const Label& other) { return isOverlapping(label, other); }))
        return label;
    }
  }
  return std::nullopt;
}

/// True if the frame shows no surface before the point. Points outside the picture are not visible.
bool isVisible(const render::Frame& frame, const Vec3& projected) {
  const double x = std::floor(projected.x()), y = std::floor(projected.y());
  if (!(x >= 0 && y >= 0 && x < frame.camera.width && y < frame.camera.height)) return false;
  const float depth =
      frame.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.camera.width) +
                  static_cast<std::size_t>(x)];
  return std::isnan(depth) || projected.z() <= static_cast<double>(depth) + kDepthTolerance;
}

void drawContacts(Canvas& canvas, const render::Frame& frame, const CaptureFrame& captureFrame) {
  for (const ContactMark& contact : captureFrame.contacts) {
    const Vec3 at = render::project(frame.camera, contact.point);
    const bool inFront = isVisible(frame, at);
    canvas.disc({at.x(), at.y()}, inFront ? 6 : 3, kPaper);
    canvas.disc({at.x(), at.y()}, inFront ? 4.5 : 2, contact.isNearMiss ? kNearMiss : kContact);
  }
}

void drawTrail(Canvas& canvas, const render::Frame& frame, const AvatarTrail& trail,
               std::uint64_t tick) {
  const Vec3 lift(0, kTrailLift, 0);
  for (std::size_t i = 1; i < trail.steps.size() && trail.steps[i].tick <= tick; ++i) {
    const Vec3 from = render::project(frame.camera, trail.steps[i - 1].position + lift);
    const Vec3 to = render::project(frame.camera, trail.steps[i].position + lift);
    if (!(from.z() > frame.camera.near && to.z() > frame.camera.near)) continue;
    const bool inFront = isVisible(frame, from) && isVisible(frame, to);
    canvas.line({from.x(), from.y()}, {to.x(), to.y()}, inFront ? 3 : 1,
                computeAvatarColour(trail.id));
  }
}

/// One label for each thing that people see.
void drawNames(Canvas& canvas, const render::Frame& frame, const scene::Model& model,
               const scene::ObjectClasses& classes, const CapturePlan& plan) {
  const std::vector<std::uint32_t> things = classes.getThings(frame.ids);
  const std::vector<ObjectRect> rects = findRects(frame, things, model.objects.size());
  std::vector<Label> labels;
  for (std::size_t i = 0; i < std::min(rects.size(), kMaxNames); ++i) {
    const std::string name = findName(model, plan, rects[i].id);
    const auto label = placeLabel(canvas, frame, things, rects[i], name, labels);
    if (!label) continue;
    canvas.text({label->left + 2.0, static_cast<double>(label->top)}, name, kLabelStyle);
    labels.push_back(*label);
  }
}

}  // namespace

Image drawOverlay(const render::Frame& frame, const OverlayChoice& choice,
                  const scene::Model& model, const scene::ObjectClasses& classes,
                  const CapturePlan& plan, const CaptureFrame& captureFrame) {
  Canvas canvas(render::toImage(frame));
  if (choice.paths) {
    for (const AvatarTrail& trail : plan.trails) drawTrail(canvas, frame, trail, frame.tick);
  }
  if (choice.boxes) {
    for (const ObjectRect& rect : findRects(frame, frame.ids, model.objects.size()))
      drawBox(canvas, rect);
  }
  if (choice.names) drawNames(canvas, frame, model, classes, plan);
  if (choice.contacts) drawContacts(canvas, frame, captureFrame);
  return canvas.toImage();
}

}  // namespace enfilade::server
