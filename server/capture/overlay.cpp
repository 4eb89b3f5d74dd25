#include "server/capture/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "render/avatar_mesh.hpp"
#include "render/image/font.hpp"

namespace enfilade::server {
namespace {

using render::Colour;
using render::Image;

constexpr double kLeastShare = 0.0005, kMostShare = 0.4;  // of the picture, for a box
constexpr std::size_t kMostNames = 16;                    // the largest ones
constexpr int kLabelHeight = render::kLetterHeight + 2;   // pixels
constexpr int kMostLines = 4;                             // that a name may be away from its object
constexpr double kInFront = 0.02;                         // metres that a mark may lie behind
constexpr double kOverFloor = 0.03;                       // metres that paths are drawn above it
constexpr Colour kContact{214, 40, 40}, kNear{240, 150, 20}, kPaper{250, 249, 246},
    kInk{30, 30, 36};

/// What is seen of one object: the rectangle of its pixels.
struct Extent {
  scene::EntityId id = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< pixels, the last ones included
  std::size_t pixels = 0;
  std::int64_t sumX = 0, sumY = 0;  ///< of the pixels

  int middleX() const { return static_cast<int>(sumX / static_cast<std::int64_t>(pixels)); }
  int middleY() const { return static_cast<int>(sumY / static_cast<std::int64_t>(pixels)); }
};

std::vector<Extent> extentsOf(const render::Frame& frame) {
  std::map<scene::EntityId, Extent> found;
  const int width = frame.camera.width;
  for (std::size_t i = 0; i < frame.ids.size(); ++i) {
    const scene::EntityId id = frame.ids[i];
    if (id == 0) continue;
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    const auto [at, isNew] = found.try_emplace(id, Extent{id, x, y, x, y});
    Extent& extent = at->second;
    extent.left = std::min(extent.left, x);
    extent.right = std::max(extent.right, x);
    extent.bottom = y;
    ++extent.pixels;
    extent.sumX += x;
    extent.sumY += y;
  }
  std::vector<Extent> extents;
  const auto all = static_cast<double>(frame.ids.size());
  for (const auto& [id, extent] : found) {
    const double area = static_cast<double>(extent.right - extent.left + 1) *
                        static_cast<double>(extent.bottom - extent.top + 1);
    if (static_cast<double>(extent.pixels) >= kLeastShare * all && area <= kMostShare * all)
      extents.push_back(extent);
  }
  std::stable_sort(extents.begin(), extents.end(),
                   [](const Extent& a, const Extent& b) { return a.pixels > b.pixels; });
  return extents;
}

Colour colourOf(scene::EntityId id) {
  const Eigen::Vector3f linear = render::avatarColour(id);
  const auto byte = [&](int i) {
    return static_cast<std::uint8_t>(std::lround(255 * std::pow(linear[i], 1 / 2.2f)));
  };
  return {byte(0), byte(1), byte(2)};
}

void drawBox(Image& image, const Extent& extent) {
  const double left = extent.left, top = extent.top, right = extent.right + 1.0,
               bottom = extent.bottom + 1.0;
  const Colour colour = colourOf(extent.id);
  render::drawLine(image, left, top, right, top, 1.5, colour);
  render::drawLine(image, right, top, right, bottom, 1.5, colour);
  render::drawLine(image, right, bottom, left, bottom, 1.5, colour);
  render::drawLine(image, left, bottom, left, top, 1.5, colour);
}

/// The last name of the path; the walker's name.
std::string nameOf(const scene::Model& model, const ShotList& list, scene::EntityId id) {
  if (id <= model.objects.size()) {
    const std::string& path = model.objects[id - 1].path;
    return path.substr(path.find_last_of('/') + 1);
  }
  for (const WalkerName& walker : list.walkers)
    if (walker.id == id) return walker.name;
  return "";
}

/// Where a name is written.
struct Label {
  int left, top, width;  ///< pixels
};

bool overlap(const Label& a, const Label& b) {
  return a.left < b.left + b.width && b.left < a.left + a.width &&
         std::abs(a.top - b.top) < kLabelHeight;
}

/// In the row of the object's middle that of its pixels which is next to the middle: an object may
/// have a hole there.
int columnOn(const render::Frame& frame, const Extent& extent) {
  const int width = frame.camera.width;
  const auto row = frame.ids.begin() + static_cast<std::ptrdiff_t>(extent.middleY()) * width;
  for (int away = 0; away < width; ++away) {
    for (const int x : {extent.middleX() - away, extent.middleX() + away})
      if (x >= 0 && x < width && row[x] == extent.id) return x;
  }
  return extent.middleX();
}

/// On the object, or as few lines above or below as others leave free; nullopt: nowhere near.
std::optional<Label> placeFor(const render::Frame& frame, const Extent& extent,
                              const std::string& name, const std::vector<Label>& others) {
  const int width = static_cast<int>(name.size()) * render::kLetterAdvance + 2;
  if (name.empty() || width > frame.camera.width) return std::nullopt;
  const int left = std::clamp(columnOn(frame, extent) - width / 2, 1, frame.camera.width - width);
  for (int lines = 0; lines <= kMostLines; ++lines) {
    for (const int shift : {-lines, lines}) {
      const Label label{left, extent.middleY() - render::kLetterHeight / 2 + shift * kLabelHeight,
                        width};
      const bool inside = label.top >= 1 && label.top + kLabelHeight <= frame.camera.height;
      if (inside && std::none_of(others.begin(), others.end(),
                                 [&](const Label& other) { return overlap(label, other); }))
        return label;
    }
  }
  return std::nullopt;
}

void drawName(Image& image, const Label& label, const std::string& name) {
  const int x = label.left, y = label.top;
  for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
    render::drawText(image, x + dx, y + dy, name, 1, kPaper);
  render::drawText(image, x, y, name, 1, kInk);
}

/// Whether nothing in the picture lies before the point. Points beside the picture are not seen.
bool seen(const render::Frame& frame, const Vec3& projected) {
  const double x = std::floor(projected.x()), y = std::floor(projected.y());
  if (!(x >= 0 && y >= 0 && x < frame.camera.width && y < frame.camera.height)) return false;
  const float depth =
      frame.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.camera.width) +
                  static_cast<std::size_t>(x)];
  return std::isnan(depth) || projected.z() <= static_cast<double>(depth) + kInFront;
}

void drawContacts(Image& image, const render::Frame& frame, const Shot& shot) {
  for (const ContactMark& contact : shot.contacts) {
    const Vec3 at = render::project(frame.camera, contact.point);
    const bool front = seen(frame, at);
    render::drawDisc(image, at.x(), at.y(), front ? 6 : 3, kPaper);
    render::drawDisc(image, at.x(), at.y(), front ? 4.5 : 2, contact.near ? kNear : kContact);
  }
}

void drawTrail(Image& image, const render::Frame& frame, const WalkTrail& trail,
               std::uint64_t tick) {
  const Vec3 lift(0, kOverFloor, 0);
  for (std::size_t i = 1; i < trail.feet.size() && trail.feet[i].tick <= tick; ++i) {
    const Vec3 from = render::project(frame.camera, trail.feet[i - 1].at + lift);
    const Vec3 to = render::project(frame.camera, trail.feet[i].at + lift);
    if (!(from.z() > frame.camera.near && to.z() > frame.camera.near)) continue;
    const bool front = seen(frame, from) && seen(frame, to);
    render::drawLine(image, from.x(), from.y(), to.x(), to.y(), front ? 3 : 1, colourOf(trail.id));
  }
}

}  // namespace

Image drawOverlay(const render::Frame& frame, const OverlayChoice& choice,
                  const scene::Model& model, const ShotList& list, const Shot& shot) {
  Image image = render::colourOf(frame);
  if (choice.paths) {
    for (const WalkTrail& trail : list.trails) drawTrail(image, frame, trail, frame.tick);
  }
  const std::vector<Extent> extents =
      choice.boxes || choice.names ? extentsOf(frame) : std::vector<Extent>();
  if (choice.boxes) {
    for (const Extent& extent : extents) drawBox(image, extent);
  }
  if (choice.names) {
    std::vector<Label> labels;
    for (std::size_t i = 0; i < std::min(extents.size(), kMostNames); ++i) {
      const std::string name = nameOf(model, list, extents[i].id);
      const auto label = placeFor(frame, extents[i], name, labels);
      if (!label) continue;
      drawName(image, *label, name);
      labels.push_back(*label);
    }
  }
  if (choice.contacts) drawContacts(image, frame, shot);
  return image;
}

}  // namespace enfilade::server
