// Steps of a search for a place: rings of growing radius around the mark. The first rings need no
// leader. A place that covers no path is preferred to one on a path, at every distance: near
// places come first.
#include "server/plans/captions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "collision/assert.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Point;
using render::TextSize;
using render::TextStyle;

constexpr double kCellSize = 3;     // thin lines
constexpr double kMaxCells = 2000;  // along each axis: bounds the memory of large pages
constexpr double kRingStep = 0.7;   // of the text's height, between two rings
constexpr int kNearRings = 4, kFarDirections = 32;
constexpr std::array<double, 4> kNearAngles{22.5, -22.5, 67.5, -67.5};  // degrees
constexpr double kMaxLeader = 130;    // thin lines: the eye follows a longer one with difficulty
constexpr double kMarkRadius = 22;    // thin lines: a leader may cross its own mark
constexpr double kLeaderWidth = 0.8;  // thin lines
constexpr render::Colour kLeaderColour{90, 92, 100};

/// The box of a text beyond the end of a ray along the unit vector `direction`.
CanvasBox makeBox(Point mark, Point direction, double distance, const TextSize& size) {
  const Point end{mark.x + distance * direction.x, mark.y + distance * direction.y};
  const double left = direction.x > 0 ? end.x : end.x - size.width;
  return {{left, end.y - size.height / 2}, size.width, size.height};
}

Leader makeLeader(Point mark, const CanvasBox& box) {
  return {mark,
          {std::clamp(mark.x, box.topLeft.x, box.topLeft.x + box.width),
           std::clamp(mark.y, box.topLeft.y, box.topLeft.y + box.height)}};
}

}  // namespace

bool isOverlapping(const CanvasBox& a, const CanvasBox& b) {
  return a.topLeft.x < b.topLeft.x + b.width && b.topLeft.x < a.topLeft.x + a.width &&
         a.topLeft.y < b.topLeft.y + b.height && b.topLeft.y < a.topLeft.y + a.height;
}

// ---- raster -------------------------------------------------------------------------------------

CaptionPlacer::CaptionPlacer(const CanvasBox& frame, double unit)
    : frame_(frame),
      unit_(unit),
      cellSize_(std::max(kCellSize * unit, std::max(frame.width, frame.height) / kMaxCells)),
      columns_(std::max(1, static_cast<int>(std::ceil(frame.width / cellSize_)))),
      rows_(std::max(1, static_cast<int>(std::ceil(frame.height / cellSize_)))),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

/// Calls visit(index) for the cells that a box meets, until it returns false.
template <class Visit>
bool CaptionPlacer::allCells(const CanvasBox& box, const Visit& visit) const {
  const auto cell = [&](double at, int count) {
    return static_cast<int>(std::clamp(std::floor(at / cellSize_), -1.0, count + 0.0));
  };
  const double x = box.topLeft.x - frame_.topLeft.x, y = box.topLeft.y - frame_.topLeft.y;
  const int left = std::max(0, cell(x, columns_)),
            right = std::min(columns_ - 1, cell(x + box.width, columns_));
  const int top = std::max(0, cell(y, rows_)),
            bottom = std::min(rows_ - 1, cell(y + box.height, rows_));
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column)
      if (!visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(column)))
        return false;
  return true;
}

void CaptionPlacer::setCells(const CanvasBox& box, Cell value) {
  allCells(box, [&](std::size_t index) {
    cells_[index] |= value;
    return true;
  });
}

bool CaptionPlacer::hasNone(const CanvasBox& box, Cell mask) const {
  return allCells(box, [&](std::size_t index) { return (cells_[index] & mask) == 0; });
}

/// Calls visit(box) for squares along a line, closer than cells.
template <class Visit>
void CaptionPlacer::visitLine(Point from, Point to, double thickness, const Visit& visit) const {
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  if (!std::isfinite(length)) return;
  const int count = static_cast<int>(std::min(std::ceil(2 * length / cellSize_),
                                              4.0 * (columns_ + rows_)));  // a few frames
  for (int i = 0; i <= count; ++i) {
    const double t = count == 0 ? 0 : static_cast<double>(i) / count;
    const Point at{from.x + t * (to.x - from.x), from.y + t * (to.y - from.y)};
    visit(CanvasBox{{at.x - thickness / 2, at.y - thickness / 2}, thickness, thickness});
  }
}

void CaptionPlacer::reserveLine(Point from, Point to, double thickness) {
  visitLine(from, to, thickness, [&](const CanvasBox& box) { setCells(box, kMark); });
}

void CaptionPlacer::avoidLine(Point from, Point to, double thickness) {
  visitLine(from, to, thickness, [&](const CanvasBox& box) { setCells(box, kLine); });
}

bool CaptionPlacer::isFree(const CanvasBox& box, Avoid avoid) const {
  const Point opposite{box.topLeft.x + box.width, box.topLeft.y + box.height};
  const Cell mask = kMark | kCaption | kLeader | (avoid == Avoid::marksAndLines ? kLine : 0);
  return frame_.contains(box.topLeft) && frame_.contains(opposite) && hasNone(box, mask);
}

// ---- places -------------------------------------------------------------------------------------

/// A leader crosses no caption, and other marks and leaders only if there is no other place.
bool CaptionPlacer::isLeaderFree(const Leader& leader, Avoid avoid) const {
  bool isFree = true;
  visitLine(leader.from, leader.to, kLeaderWidth * unit_, [&](const CanvasBox& box) {
    const double distance =
        std::hypot(box.topLeft.x - leader.from.x, box.topLeft.y - leader.from.y);
    const bool own = avoid == Avoid::marks || distance < kMarkRadius * unit_;
    isFree = isFree && hasNone(box, own ? kCaption : kCaption | kMark | kLeader);
  });
  return isFree;
}

/// One side first, then the other: a name on the wrong side of a door is taken for another room's.
std::optional<CaptionPlacer::Place> CaptionPlacer::findNear(const CaptionMark& mark,
                                                            const TextSize& size,
                                                            Avoid avoid) const {
  for (const double side : {1.0, -1.0}) {
    for (int ring = 1; ring <= kNearRings; ++ring) {
      for (const double degrees : kNearAngles) {
        const double angle = degrees * M_PI / 180;
        const double along = (mark.prefersLeft ? -side : side) * std::cos(angle);
        const CanvasBox box =
            makeBox(mark.at, {along, std::sin(angle)}, ring * kRingStep * size.height, size);
        if (isFree(box, avoid)) return Place{box, std::nullopt};
      }
    }
  }
  return std::nullopt;
}

std::optional<CaptionPlacer::Place> CaptionPlacer::findFar(Point mark, const TextSize& size,
                                                           double maxLeader, Avoid avoid) const {
  const double step = kRingStep * size.height;
  for (int ring = 2; ring * step <= maxLeader; ++ring) {
    for (int i = 0; i < kFarDirections; ++i) {
      const double angle = (i + 0.5) * 2 * M_PI / kFarDirections;
      const CanvasBox box = makeBox(mark, {std::cos(angle), std::sin(angle)}, ring * step, size);
      const Leader leader = makeLeader(mark, box);
      if (isFree(box, avoid) && isLeaderFree(leader, avoid)) return Place{box, leader};
    }
  }
  return std::nullopt;
}

std::optional<CaptionPlacer::Place> CaptionPlacer::place(const CaptionMark& mark,
                                                         const TextSize& size, double maxLeader) {
  if (!(size.height > 0)) return std::nullopt;
  std::optional<Place> found;
  for (const bool near : {true, false}) {
    for (const Avoid avoid : {Avoid::marksAndLines, Avoid::marks}) {
      if (found || (near && mark.needsLeader)) continue;
      found = near ? findNear(mark, size, avoid) : findFar(mark.at, size, maxLeader, avoid);
    }
  }
  if (!found) return std::nullopt;
  take(found->box);
  if (found->leader)
    visitLine(found->leader->from, found->leader->to, kLeaderWidth * unit_,
              [&](const CanvasBox& box) { setCells(box, kLeader); });
  return found;
}

// ---- lists --------------------------------------------------------------------------------------

void CaptionList::add(const Canvas& measuring, const CaptionMark& mark, const std::string& text,
                      const TextStyle& style, const std::string& where) {
  if (text.empty()) return;
  const bool isShown = placer.frame().contains(mark.at);
  const auto tryText = [&](const std::string& shown, const TextStyle& shownStyle,
                           double maxLeader) {
    const auto place = placer.place(mark, measuring.measure(shown, shownStyle), maxLeader);
    if (place) captions_.push_back({shown, shownStyle, place->box, place->leader});
    return place.has_value();
  };
  if (isShown && tryText(text, style, kMaxLeader * placer.unit())) return;
  // In brackets: numbers without them are rooms'.
  const std::string number = "(" + std::to_string(entries_.size() + 1) + ")";
  TextStyle numberStyle = style;
  numberStyle.bold = true;
  const double anywhere = std::max(placer.frame().width, placer.frame().height);
  const bool isNumbered = isShown && tryText(number, numberStyle, anywhere);
  entries_.push_back({number, isNumbered ? text : text + ", " + where});
}

void CaptionList::drawLeaders(Canvas& canvas) const {
  for (const Caption& caption : captions_)
    if (caption.leader)
      canvas.line(caption.leader->from, caption.leader->to, kLeaderWidth * placer.unit(),
                  kLeaderColour);
}

void CaptionList::drawTexts(Canvas& canvas) const {
  for (const Caption& caption : captions_)
    canvas.text(caption.box.topLeft, caption.text, caption.style);
}

}  // namespace enfilade::server
