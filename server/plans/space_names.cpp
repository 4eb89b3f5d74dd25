#include "server/plans/space_names.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "scene/model/shapes/space_solid.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Point;
using render::TextStyle;
using Avoid = CaptionPlacer::Avoid;

constexpr double kNameSize = 12;                        // thin lines
constexpr double kNameLineHeight = 1.25;                // of the size
constexpr std::array<double, 3> kScales{1, 0.8, 0.65};  // of the size; smaller is not legible
constexpr double kPlaceStep = 6;  // thin lines between two places that are tried
constexpr int kMaxSteps = 40;     // to each side

struct NameLine {
  std::string text;
  TextStyle style;
  double width = 0;
};

/// Lines below one another, centred.
struct NameBlock {
  std::vector<NameLine> lines;
  double width = 0, lineHeight = 0;
  double height() const { return lineHeight * static_cast<double>(lines.size()); }
};

/// A room on the plan.
struct Room {
  const scene::Space& space;
  scene::SpaceMiddle middle;
  Point centre;
  std::string longName, number;  ///< either may be empty; the number is not the name
};

NameBlock makeBlock(const Canvas& measuring, const std::vector<std::string>& boldLines,
                    const std::string& plainLine, double size, double unit) {
  NameBlock block;
  block.lineHeight = kNameLineHeight * size;
  const auto add = [&](const std::string& text, bool bold) {
    if (text.empty()) return;
    TextStyle style;
    style.size = size, style.colour = kPlanInk, style.bold = bold;
    style.halo = 3 * unit, style.haloColour = kPlanPaper;
    const double width = measuring.measure(text, style).width;
    block.lines.push_back({text, style, width});
    block.width = std::max(block.width, width);
  };
  for (const std::string& line : boldLines) add(line, true);
  add(plainLine, false);
  return block;
}

/// The name in one line, and in two if it has several words.
std::vector<std::vector<std::string>> makeBreaks(const std::string& name) {
  std::vector<std::vector<std::string>> breaks{{name}};
  std::size_t best = std::string::npos;
  const auto distance = [&](std::size_t at) {
    return std::abs(static_cast<double>(at) - static_cast<double>(name.size()) / 2);
  };
  for (std::size_t at = name.find(' '); at != std::string::npos; at = name.find(' ', at + 1))
    if (best == std::string::npos || distance(at) < distance(best)) best = at;
  // A number stays with its word.
  constexpr std::size_t kMinPart = 3;
  if (best != std::string::npos && std::min(best, name.size() - best - 1) >= kMinPart)
    breaks.push_back({name.substr(0, best), name.substr(best + 1)});
  return breaks;
}

Vec3 toScene(const PlanView& view, Point point, double height) {
  return {view.area.min.x() + (point.x - view.topLeft.x) / view.unitsPerMetre, height,
          view.area.min.z() + (point.y - view.topLeft.y) / view.unitsPerMetre};
}

/// Whether the corners of a box, and the middles between them, lie in the room.
bool isInRoom(const PlanView& view, const Room& room, const CanvasBox& box) {
  for (const double y : {0.0, 0.5, 1.0})
    for (const double x : {0.0, 0.5, 1.0})
      if (!scene::isInSpace(
              room.space,
              toScene(view, {box.topLeft.x + x * box.width, box.topLeft.y + y * box.height},
                      room.middle.point.y())))
        return false;
  return true;
}

/// The free place in the room that is next to its middle; nullopt: none.
std::optional<CanvasBox> findPlace(const CaptionPlacer& placer, const PlanView& view,
                                   const Room& room, const NameBlock& block, Avoid avoid) {
  const scene::Aabb& roomBox = room.space.box;
  if (block.width > roomBox.size().x() * view.unitsPerMetre ||
      block.height() > roomBox.size().z() * view.unitsPerMetre)
    return std::nullopt;
  const double step = kPlaceStep * view.unit;
  std::vector<std::pair<int, int>> offsets;
  const auto stepsFor = [&](double metres) {
    return std::min(kMaxSteps, static_cast<int>(metres * view.unitsPerMetre / step));
  };
  const int across = stepsFor(roomBox.size().x()), down = stepsFor(roomBox.size().z());
  for (int y = -down; y <= down; ++y)
    for (int x = -across; x <= across; ++x) offsets.emplace_back(x, y);
  std::ranges::stable_sort(
      offsets, {}, [](const auto& at) { return at.first * at.first + at.second * at.second; });
  for (const auto& [x, y] : offsets) {
    const CanvasBox place{
        {room.centre.x + x * step - block.width / 2, room.centre.y + y * step - block.height() / 2},
        block.width,
        block.height()};
    if (placer.isFree(place, avoid) && isInRoom(view, room, place)) return place;
  }
  return std::nullopt;
}

bool placeBlock(CaptionList& captions, const PlanView& view, const Room& room,
                const NameBlock& block) {
  for (const Avoid avoid : {Avoid::marksAndLines, Avoid::marks}) {
    const auto place = findPlace(captions.placer, view, room, block, avoid);
    if (!place) continue;
    captions.placer.take(*place);
    double top = place->topLeft.y;
    for (const NameLine& line : block.lines) {
      const double left = place->topLeft.x + (block.width - line.width) / 2;
      captions.addPlaced({line.text, line.style, {{left, top}, line.width, block.lineHeight}});
      top += block.lineHeight;
    }
    return true;
  }
  return false;
}

std::string formatRoomPlace(const Vec3& point) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "at x = %.1f, z = %.1f", point.x(), point.z());
  return text.data();
}

void placeName(CaptionList& captions, const Canvas& measuring, const PlanView& view,
               const Room& room) {
  const double u = view.unit;
  for (const double scale : kScales)
    for (const std::vector<std::string>& lines : makeBreaks(room.longName))
      if (placeBlock(captions, view, room,
                     makeBlock(measuring, lines, room.number, scale * kNameSize * u, u)))
        return;
  const bool hasBoth = !room.longName.empty() && !room.number.empty();
  for (const double scale : kScales) {
    if (!hasBoth) break;
    if (placeBlock(captions, view, room,
                   makeBlock(measuring, {}, room.number, scale * kNameSize * u, u)))
      return captions.addEntry({room.number, room.longName});
  }
  const std::string whole =
      hasBoth ? room.longName + " " + room.number : room.longName + room.number;
  const NameBlock line = makeBlock(measuring, {whole}, "", kScales[1] * kNameSize * u, u);
  captions.add(measuring, {.at = room.centre, .needsLeader = true}, whole, line.lines.front().style,
               formatRoomPlace(room.middle.point));
}

}  // namespace

void placeSpaceNames(CaptionList& captions, const Canvas& measuring, const PlanView& view,
                     std::span<const scene::Space> spaces) {
  for (const scene::Space& space : spaces) {
    if (space.box.empty()) continue;
    if (space.longName.empty() && space.name.empty()) continue;
    const Vec3 low = space.box.min.cwiseMax(view.area.min),
               high = space.box.max.cwiseMin(view.area.max);
    if (low.x() >= high.x() || low.z() >= high.z()) continue;
    const scene::SpaceMiddle middle = scene::findSpaceMiddle(space, view.area);
    placeName(captions, measuring, view,
              {space, middle, view.at(middle.point), space.longName,
               space.name == space.longName ? "" : space.name});
  }
}

}  // namespace enfilade::server
