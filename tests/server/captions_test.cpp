// Captions of maps and plans cover no mark and no other caption, and none is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "server/plans/space_names.hpp"
#include "server/plans/storey_marks.hpp"
#include "tests/scene/prism_space.hpp"

namespace enfilade::server {
namespace {

constexpr double kPixelsPerMetre = 80;

/// 8 x 6 m.
PlanView makeRoomView() {
  PlanView view;
  view.area = {scene::Vec3(0, 0, 0), scene::Vec3(8, 3, 6)};
  view.unitsPerMetre = kPixelsPerMetre;
  return view;
}

scene::Space makeRoom(double x0, double x1, double z0, double z1, const char* longName,
                      const char* name) {
  scene::Space room = tests::makePrism({{x0, z0}, {x0, z1}, {x1, z1}, {x1, z0}}, 2.5);
  room.storey = 0;
  room.longName = longName, room.name = name;
  return room;
}

/// Two rooms, an avatar in the middle of each, and a picture taken there.
struct TwoRooms {
  TwoRooms() {
    model.storeys = {{"Ground", "", 0}};
    model.spaces = {makeRoom(0, 4, 0, 6, "Buero", "2"), makeRoom(4, 8, 0, 6, "Bad", "3")};
    for (int i = 0; i < 2; ++i) {
      const Vec3 middle(2 + 4 * i, 0, 3);
      trace.paths.push_back(
          {i == 0 ? "ann" : "bob", {middle}, static_cast<scene::EntityId>(i + 1)});
      trace.captures.push_back(
          {i == 0 ? "office-north-view" : "bathroom", middle + Vec3(0, 1.6, 0), Vec3(0.3, 0, -1)});
    }
  }
  scene::Model model;
  WalkTrace trace;
  PlanView view = makeRoomView();
  std::vector<double> floors{0};
  std::vector<CaptionEntry> entries;

  StoreyMarks place() { return {view, floors, trace, model.spaces, entries}; }
};

bool meetsBox(const CanvasBox& box, render::Point from, render::Point to) {
  for (int i = 0; i <= 100; ++i)
    if (box.contains({from.x + (to.x - from.x) * i / 100, from.y + (to.y - from.y) * i / 100}))
      return true;
  return false;
}

void expectNoOverlap(const StoreyMarks& marks, const std::vector<CanvasBox>& dots) {
  const std::vector<Caption>& captions = marks.captions();
  for (std::size_t i = 0; i < captions.size(); ++i) {
    const Caption& caption = captions[i];
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_FALSE(isOverlapping(caption.box, captions[k].box))
          << caption.text << " and " << captions[k].text;
      for (const auto& [one, other] : {std::pair(i, k), {k, i}}) {
        const std::optional<Leader>& leader = captions[one].leader;
        EXPECT_FALSE(leader && meetsBox(captions[other].box, leader->from, leader->to))
            << "the leader of " << captions[one].text << " crosses " << captions[other].text;
      }
    }
    for (const Wedge& wedge : marks.wedges())
      for (const render::Point& end : {wedge.left, wedge.right})
        EXPECT_FALSE(meetsBox(caption.box, wedge.eye, end)) << caption.text << " and a wedge";
    for (const CanvasBox& dot : dots)
      EXPECT_FALSE(isOverlapping(caption.box, dot)) << caption.text << " and a dot";
  }
}

bool hasCaption(const StoreyMarks& marks, const std::string& text) {
  return std::ranges::any_of(marks.captions(),
                             [&](const Caption& caption) { return caption.text == text; });
}

TEST(Captions, NamesOfRoomsCoverNoMarkAndNoOtherCaption) {
  TwoRooms rooms;
  const StoreyMarks marks = rooms.place();
  for (const char* text : {"Buero", "2", "Bad", "3", "ann", "bob", "office-north-view", "bathroom"})
    EXPECT_TRUE(hasCaption(marks, text)) << text;
  EXPECT_TRUE(rooms.entries.empty());
  std::vector<CanvasBox> starts;
  for (const double x : {2.0, 6.0})
    starts.push_back({{x * kPixelsPerMetre - 6, 3 * kPixelsPerMetre - 6}, 12, 12});
  expectNoOverlap(marks, starts);
  // Also in their own rooms.
  for (const Caption& caption : marks.captions())
    EXPECT_TRUE(caption.text != "Bad" || caption.box.topLeft.x >= 4 * kPixelsPerMetre);
}

TEST(Captions, ALaterWedgeDoesNotStrikeThroughAnEarlierName) {
  TwoRooms rooms;
  rooms.trace.captures.clear();
  // A row of cameras that look along it, as on a tour of rooms in a row.
  for (int i = 0; i < 6; ++i)
    rooms.trace.captures.push_back(
        {"enfilade-from-the-vestibule-" + std::to_string(i), Vec3(1 + i, 1.6, 3), Vec3(1, 0, 0)});
  const StoreyMarks marks = rooms.place();
  ASSERT_EQ(marks.wedges().size(), 6u);
  EXPECT_EQ(marks.captions().size(), 2u + 4u + 6u);  // avatars, rooms, pictures or their numbers
  expectNoOverlap(marks, {});
}

TEST(Captions, WithoutSpaceForItANameGetsANumberAndALineInTheList) {
  TwoRooms rooms;
  rooms.trace.captures.clear();
  constexpr int kCount = 60;
  for (int i = 0; i < kCount; ++i)
    rooms.trace.captures.push_back({"a-long-name-of-a-picture-" + std::to_string(i),
                                    Vec3(2 + 0.05 * i, 1.6, 3), Vec3(0, 0, -1)});
  const StoreyMarks marks = rooms.place();
  std::set<std::string> listed;
  std::size_t numbered = 0;
  for (const CaptionEntry& entry : rooms.entries) {
    const std::size_t name = entry.text.find(", at x = ");  // without space for its number
    EXPECT_NE(hasCaption(marks, entry.key), name != std::string::npos) << entry.key;
    numbered += name == std::string::npos ? 1 : 0;
    listed.insert(entry.text.substr(0, name));
  }
  EXPECT_GT(numbered, 0u);
  std::size_t written = 0;
  for (const MapCapture& capture : rooms.trace.captures) {
    const bool isOnPlan = hasCaption(marks, capture.name);
    EXPECT_NE(isOnPlan, listed.contains(capture.name)) << capture.name;
    written += isOnPlan ? 1 : 0;
  }
  EXPECT_GT(written, 5u);
  EXPECT_GT(listed.size(), 5u);
  expectNoOverlap(marks, {});
}

TEST(Captions, APictureFromOutsideOfTheMapIsListedWithItsPlace) {
  TwoRooms rooms;
  rooms.trace.captures = {{"from the street", Vec3(-20, 1.6, 3), Vec3(1, 0, 0)}};
  const StoreyMarks marks = rooms.place();
  EXPECT_FALSE(hasCaption(marks, "from the street"));
  ASSERT_EQ(rooms.entries.size(), 1u);
  EXPECT_EQ(rooms.entries[0].text, "from the street, at x = -20.0, y = 1.6, z = 3.0");
}

TEST(Captions, ANameLiesInItsRoomInTwoLinesOrAsANumberInANarrowOne) {
  scene::Model model;
  model.storeys = {{"Ground", "", 0}};
  model.spaces = {makeRoom(0, 0.9, 0, 3, "Patient Room", "12"),        // two lines
                  makeRoom(2, 2.35, 0, 3, "Installations", "S"),       // number alone
                  makeRoom(4, 4.1, 0, 3, "Shaft of the lift", "L1")};  // with a leader
  const PlanView view = makeRoomView();
  std::vector<CaptionEntry> entries;
  CaptionList captions(view.box(), view.unit, entries);
  placeSpaceNames(captions, render::Canvas(1, 1, kPlanPaper), view, model.spaces);
  std::set<std::string> texts;
  for (const Caption& caption : captions.captions()) {
    texts.insert(caption.text);
    const double middle = caption.box.topLeft.x + caption.box.width / 2;
    if (middle < kPixelsPerMetre) {
      EXPECT_GE(caption.box.topLeft.x, 0) << caption.text;
      EXPECT_LE(caption.box.topLeft.x + caption.box.width, 0.9 * kPixelsPerMetre) << caption.text;
    }
    EXPECT_EQ(caption.leader.has_value(), caption.text == "Shaft of the lift L1") << caption.text;
  }
  EXPECT_EQ(texts, (std::set<std::string>{"Patient", "Room", "12", "S", "Shaft of the lift L1"}));
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0].key, "S");
  EXPECT_EQ(entries[0].text, "Installations");
}

// ---- paths --------------------------------------------------------------------------------------

double computeDistance(const render::Colour& a, const render::Colour& b) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

TEST(PathStyles, DifferInColourOrDashesAndAreNoMarkOfAContact) {
  constexpr double kDistinct = 25, kUnlikeMarks = 60;  // of 0..255 in each channel
  std::vector<WalkedPath> paths(32);
  for (std::size_t i = 0; i < paths.size(); ++i)
    paths[i].id = static_cast<scene::EntityId>(300 + i);
  const std::vector<PathStyle> styles = makePathStyles(paths);
  for (std::size_t i = 0; i < styles.size(); ++i) {
    for (const render::Colour& mark : {kContactColour, kBlockedColour})
      EXPECT_GT(computeDistance(styles[i].colour, mark), kUnlikeMarks) << i;
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_TRUE(styles[i].line != styles[k].line ||
                  computeDistance(styles[i].colour, styles[k].colour) > kDistinct)
          << i << " and " << k;
  }
  EXPECT_EQ(styles[0].line, render::LineKind::solid);
  // An avatar has one style, also if it comes back, and its earlier walk is pale.
  std::vector<WalkedPath> twice{paths[0], paths[8], paths[0]};
  twice[2].isEarlier = true;
  const std::vector<PathStyle> again = makePathStyles(twice);
  EXPECT_EQ(again[0].colour, styles[0].colour);
  EXPECT_EQ(again[1].line, styles[8].line);
  EXPECT_GT(again[2].colour[0], again[0].colour[0]);
}

TEST(PathStyles, TextInTheColourOfAPathIsReadable) {
  const render::Colour dark{40, 60, 120};
  EXPECT_EQ(makeReadable(dark), dark);
  for (const render::Colour& pale : {render::Colour{255, 238, 170}, render::Colour{255, 255, 255},
                                     render::Colour{170, 255, 170}}) {
    const render::Colour text = makeReadable(pale);
    EXPECT_LT(*std::ranges::max_element(text), 130) << "a grey of 118 has the contrast 4.5";
    for (std::size_t k = 1; k < 3; ++k)  // its hue is kept
      EXPECT_NEAR(static_cast<double>(text[k]) / text[0], static_cast<double>(pale[k]) / pale[0],
                  0.1);
  }
}

}  // namespace
}  // namespace enfilade::server
