// The names of rooms on plans lie in the rooms.
#include <gtest/gtest.h>

#include <algorithm>

#include "server/plans/space_names.hpp"
#include "tests/scene/prism_space.hpp"

namespace enfilade::server {
namespace {

constexpr render::Colour kPaperColour{255, 255, 255};
constexpr unsigned kRoomPixelsPerMetre = 40;

TEST(SpaceNames, OfARoomShapedLikeAnLDoNotLieInItsNeighbour) {
  // The neighbour is the notch, at more than 2 m in x and z.
  scene::Model model;
  model.storeys = {{"Ground", "", 0}};
  model.spaces = {tests::makePrism({{2, 2}, {2, 6}, {0, 6}, {0, 0}, {6, 0}, {6, 2}}, 2.5)};
  model.spaces[0].storey = 0;
  model.spaces[0].longName = "Corridor";
  model.spaces[0].name = "017";
  render::Canvas canvas(6 * kRoomPixelsPerMetre, 6 * kRoomPixelsPerMetre, kPaperColour);
  PlanView view;
  view.area = {scene::Vec3(0, 0, 0), scene::Vec3(6, 3, 6)};
  view.unitsPerMetre = kRoomPixelsPerMetre;
  std::vector<CaptionEntry> entries;
  CaptionList captions(view.box(), view.unit, entries);
  placeSpaceNames(captions, canvas, view, model.spaces);
  captions.drawTexts(canvas);
  const render::Image image = canvas.toImage();
  std::size_t inside = 0, outside = 0;
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    if (image.rgb[i] == 255) continue;
    const std::size_t pixel = i / 3, width = 6 * kRoomPixelsPerMetre;
    const std::size_t x = pixel % width, y = pixel / width;
    ++(x > 2 * kRoomPixelsPerMetre && y > 2 * kRoomPixelsPerMetre ? outside : inside);
  }
  EXPECT_GT(inside, 100u);
  EXPECT_EQ(outside, 0u);
}

}  // namespace
}  // namespace enfilade::server
