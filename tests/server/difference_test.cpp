// Tests of matching the contacts of two walks, and of comparing two recordings.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "protocol/recording/recording.hpp"
#include "server/diff/align_events.hpp"
#include "server/diff/difference_json.hpp"
#include "server/diff/walk_difference.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server {
namespace {

WalkEvent makeEventAt(double x, double time) {
  WalkEvent happening;
  happening.point = Vec3(x, 0, 0);
  happening.time = time;
  happening.tick = static_cast<std::uint64_t>(time * 60);
  return happening;
}

using IndexPairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Minimum cost of pairing two lists in order, by exhaustive search.
double computeMinCost(const std::vector<WalkEvent>& before, std::size_t i,
                      const std::vector<WalkEvent>& after, std::size_t j) {
  const auto left = static_cast<double>(before.size() - i + after.size() - j);
  double best = left * kMaxMatchDistance / 2;
  for (std::size_t k = i; k < before.size(); ++k) {
    for (std::size_t l = j; l < after.size(); ++l) {
      const double apart = (before[k].point - after[l].point).norm();
      if (apart >= kMaxMatchDistance) continue;
      const double skipped = static_cast<double>(k - i + l - j) * kMaxMatchDistance / 2;
      best = std::min(best, skipped + apart + computeMinCost(before, k + 1, after, l + 1));
    }
  }
  return best;
}

double computeCost(const IndexPairs& pairs, const std::vector<WalkEvent>& before,
                   const std::vector<WalkEvent>& after) {
  double cost =
      static_cast<double>(before.size() + after.size() - 2 * pairs.size()) * kMaxMatchDistance / 2;
  for (const auto& [i, j] : pairs) cost += (before[i].point - after[j].point).norm();
  return cost;
}

TEST(AlignEvents, TheSameListIsItsOwnMatch) {
  const std::vector<WalkEvent> list{makeEventAt(0, 1), makeEventAt(5, 2), makeEventAt(0, 3),
                                    makeEventAt(0, 4)};
  EXPECT_EQ(alignEvents(list, list), (IndexPairs{{0, 0}, {1, 1}, {2, 2}, {3, 3}}));
}

TEST(AlignEvents, ANewEventInTheMiddleMovesNoOther) {
  const std::vector<WalkEvent> before{makeEventAt(0, 1), makeEventAt(6, 3), makeEventAt(12, 5)};
  const std::vector<WalkEvent> after{makeEventAt(0, 1), makeEventAt(3, 2), makeEventAt(6, 3),
                                     makeEventAt(12, 5)};
  EXPECT_EQ(alignEvents(before, after), (IndexPairs{{0, 0}, {1, 2}, {2, 3}}));
}

TEST(AlignEvents, ALaterTimeAtTheSamePlaceIsTheSame) {
  EXPECT_EQ(alignEvents({makeEventAt(1, 10)}, {makeEventAt(1, 40)}), (IndexPairs{{0, 0}}));
}

TEST(AlignEvents, AnotherPlaceIsAnother) {
  EXPECT_EQ(alignEvents({makeEventAt(0, 10)}, {makeEventAt(kMaxMatchDistance, 10)}), IndexPairs{});
  EXPECT_EQ(alignEvents({makeEventAt(0, 10)}, {makeEventAt(0.99 * kMaxMatchDistance, 10)}),
            (IndexPairs{{0, 0}}));
}

TEST(AlignEvents, NoMatchingIsCheaper) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 6);
  std::uniform_int_distribution<int> length(0, 5);
  int paired = 0, possible = 0;
  for (int round = 0; round < 200; ++round) {
    std::vector<WalkEvent> before, after;
    for (int i = length(random); i > 0; --i)
      before.push_back(makeEventAt(place(random), static_cast<double>(before.size())));
    for (int i = length(random); i > 0; --i)
      after.push_back(makeEventAt(place(random), static_cast<double>(after.size())));
    const IndexPairs pairs = alignEvents(before, after);
    // Times break ties between equal positions at a cost of one millimetre a second.
    EXPECT_NEAR(computeCost(pairs, before, after), computeMinCost(before, 0, after, 0), 0.1);
    paired += static_cast<int>(pairs.size());
    possible += static_cast<int>(std::min(before.size(), after.size()));
  }
  EXPECT_GT(paired, possible * 3 / 10);
  EXPECT_LT(paired, possible);
}

TEST(AlignEvents, LongListsAreCutIntoPieces) {
  std::vector<WalkEvent> before, after;
  for (int i = 0; i < 4500; ++i) {
    before.push_back(makeEventAt(i % 7, i));
    if (i % 10 != 3) after.push_back(makeEventAt(i % 7, i));
  }
  const IndexPairs pairs = alignEvents(before, after);
  EXPECT_EQ(pairs.size(), after.size());
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    EXPECT_LT(pairs[i - 1].first, pairs[i].first);
    EXPECT_LT(pairs[i - 1].second, pairs[i].second);
  }
}

std::filesystem::path makeDifferenceFile(const std::string& name) {
  return tests::makeOwnFile(name + ".mcap");
}

constexpr double kTick = 1.0 / 60;

/// Deviations from the default of a recorded walk.
struct Otherwise {
  double nearMiss = 0.3;      ///< metres
  std::uint64_t parent = 0;   ///< the tick at which a branch started
  std::string doorName = {};  ///< name of the body of the object "house/door"; empty: it is static
  std::string doorPath = "house/door";
};

/// A recorded walk of a given number of ticks. Ann arrives at tick 90; a contact is reported at
/// tick 10.
class Recorded {
 public:
  Recorded(const std::string& name, const v1::ContactEvent& contact,
           const Otherwise& otherwise = {})
      : file_(makeDifferenceFile(name)),
        writer_(file_, "test"),
        contact_(contact),
        tick_(otherwise.parent) {
    v1::RecordingStart start;
    start.mutable_lengths()->set_walkable_normal_y(0.6);
    start.mutable_lengths()->set_epsilon(5e-4);
    start.mutable_lengths()->set_near_miss(otherwise.nearMiss);
    start.mutable_lengths()->set_tick(kTick);
    for (const char* body : {"barrel", "crate"}) {
      v1::Body& free = *start.mutable_scene()->add_bodies();
      free.set_name(body);
      free.set_kind("rigid");
      free.add_objects(free.name() == "barrel" ? 2 : 3);
    }
    if (!otherwise.doorName.empty()) {
      v1::Body& door = *start.mutable_scene()->add_bodies();
      door.set_name(otherwise.doorName);
      door.set_kind("hinged");
      door.add_objects(1);
    }
    if (otherwise.parent > 0) start.mutable_parent()->set_tick(otherwise.parent);
    writer_.write(start, static_cast<double>(tick_) * kTick);
    v1::RecordedNames names;
    names.set_first_id(1);
    for (const auto& path : {otherwise.doorPath, std::string("barrel"), std::string("crate")}) {
      names.add_paths(path);
      names.add_global_ids(path == otherwise.doorPath ? "2O2Fr$t4X7Zf8NOew3FL7j" : "");
    }
    writer_.write(names);
  }

  Recorded& go(std::uint64_t ticks) {
    for (; tick_ < ticks; writeTick()) ++tick_;
    writer_.flush();
    return *this;
  }
  const std::filesystem::path& close() {
    writer_.close();
    return file_;
  }
  /// The file of a recording whose writer is killed now.
  std::filesystem::path copyCutOff() const {
    auto cut = file_;
    cut.replace_extension(".cut.mcap");
    std::filesystem::copy_file(file_, cut, std::filesystem::copy_options::overwrite_existing);
    return cut;
  }

 private:
  void writeTick() {
    v1::TickEvents events;
    events.set_tick(tick_);
    events.set_time(static_cast<double>(tick_) * kTick);
    if (tick_ == 10) {
      *events.add_contacts() = contact_;
      events.mutable_contacts(0)->set_tick(tick_);
      events.mutable_contacts(0)->set_time(events.time());
    }
    if (tick_ == 90) {
      v1::Notice& arrived = *events.add_notices();
      arrived.set_kind(v1::Notice::KIND_ARRIVED);
      arrived.set_avatar("ann");
      arrived.set_tick(tick_);
    }
    writer_.write(events);
    v1::State state;
    state.set_tick(tick_);
    state.set_time(events.time());
    writer_.write(state);
  }

  std::filesystem::path file_;
  protocol::RecordingWriter writer_;
  v1::ContactEvent contact_;
  std::uint64_t tick_ = 0;
};

/// `a` stands next to `b`, at x = 1, where the normal from a to b points along x by `sign`.
v1::ContactEvent touch(const char* a, const char* b, double sign) {
  v1::ContactEvent event;
  event.set_kind(v1::ContactEvent::KIND_BEGIN);
  event.set_a(5);
  event.set_b(6);
  event.set_a_name(a);
  event.set_b_name(b);
  event.mutable_point_a()->set_x(1);
  event.mutable_point_b()->set_x(1);
  event.mutable_normal()->set_x(sign);
  return event;
}

TEST(ComparedWalks, EventsAfterTheCutOfATruncatedRecordingAreNotWorse) {
  const v1::ContactEvent contact = touch("barrel", "crate", 1);
  const auto whole = Recorded("whole", contact).go(120).close();
  const auto cut = Recorded("killed", contact).go(50).copyCutOff();
  for (const auto& difference : {compareWalks(whole, cut, 1e-3), compareWalks(cut, whole, 1e-3)}) {
    EXPECT_TRUE(difference.isEmpty());
    EXPECT_EQ(difference.worse, 0u);
    EXPECT_EQ(difference.before.runs.back().ticks, 50u);
    EXPECT_EQ(difference.after.runs.back().ticks, 50u);
    EXPECT_NE(difference.before.closed, difference.after.closed);
  }
  // A walk that ended in order has its final state: Ann never arrived.
  const auto shorter = Recorded("shorter", contact).go(50).close();
  EXPECT_EQ(compareWalks(whole, shorter, 1e-3).worse, 1u);
}

TEST(ComparedWalks, TheOrderOfTwoDynamicBodiesIsNoDifference) {
  const auto before = Recorded("barrel_first", touch("barrel", "crate", 1)).go(20).close();
  const auto after = Recorded("crate_first", touch("crate", "barrel", -1)).go(20).close();
  EXPECT_TRUE(compareWalks(before, after, 1e-3).isEmpty());
}

TEST(ComparedWalks, HappeningsNameGlobalIds) {
  const std::string id = "2O2Fr$t4X7Zf8NOew3FNtn";
  v1::ContactEvent contact = touch("ann", "house/window", 1);
  const auto before = Recorded("without", touch("ann", "house/wall", 1)).go(20).close();
  contact.set_b_global_id(id);
  const auto after = Recorded("with", contact).go(20).close();
  const auto json = nlohmann::json::parse(formatDifferenceJson(compareWalks(before, after, 1e-3)));
  std::size_t named = 0;
  for (const auto& change : json.at("happenings")) {
    const auto& walked = change.at("after");
    if (!walked.is_object()) continue;
    EXPECT_EQ(walked.at("b_global_id"), id);
    EXPECT_FALSE(walked.contains("a_global_id"));
    ++named;
  }
  EXPECT_EQ(named, 1u);
}

v1::ContactEvent makeNearEvent(double distance, v1::ContactEvent::Phase phase) {
  v1::ContactEvent event = touch("ann", "house/door", 1);
  event.set_kind(v1::ContactEvent::KIND_NEAR);
  event.set_phase(phase);
  event.set_distance(distance);
  return event;
}

TEST(ComparedWalks, AClearanceIsTheMinimumAndNotTheFirstReport) {
  const auto recorded = [](const char* name, double distance, v1::ContactEvent::Phase phase,
                           double radius = 0.3) {
    return Recorded(name, makeNearEvent(distance, phase), {.nearMiss = radius}).go(20).close();
  };
  using Event = v1::ContactEvent;
  const auto atMinimum = recorded("near", 0.2, Event::PHASE_MIN);
  const auto nearer = compareWalks(atMinimum, recorded("nearer", 0.1, Event::PHASE_MIN), 1e-3);
  EXPECT_EQ(nearer.worse, 1u);
  ASSERT_EQ(nearer.clearances.size(), 1u);
  EXPECT_NEAR(nearer.clearances[0].minChange, -0.1, 1e-12);
  EXPECT_TRUE(compareWalks(recorded("first", 0.29, Event::PHASE_BEGIN),
                           recorded("later", 0.28, Event::PHASE_BEGIN), 1e-3)
                  .isEmpty());
  // A walk that reports only distances below 0.15 m would not have reported it.
  const auto blind = recorded("blind", 0.14, Event::PHASE_BEGIN, 0.15);
  EXPECT_TRUE(compareWalks(blind, atMinimum, 1e-3).isEmpty());
  EXPECT_TRUE(compareWalks(atMinimum, blind, 1e-3).isEmpty());
}

TEST(ComparedWalks, ABranchIsComparedFromWhereItLeft) {
  const v1::ContactEvent contact = touch("barrel", "crate", 1);
  const auto parent = Recorded("parent", contact).go(120).close();
  const auto branch = Recorded("branch", contact, {.parent = 50}).go(120).close();
  EXPECT_TRUE(compareWalks(parent, branch, 1e-3).isEmpty());
  EXPECT_TRUE(compareWalks(branch, parent, 1e-3).isEmpty());
  const auto late = Recorded("late", contact, {.parent = 100}).go(120).close();
  EXPECT_TRUE(compareWalks(parent, late, 1e-3).isEmpty());
}

TEST(ComparedWalks, ADoorIsTheSameWhateverItIsCalledAndWhetherItMoves) {
  const auto still = Recorded("still", touch("ann", "house/door", 1)).go(20).close();
  const auto body =
      Recorded("body", touch("ann", "front", 1), {.doorName = "front"}).go(20).close();
  const auto renamed = Recorded("renamed", touch("ann", "entrance", 1),
                                {.doorName = "entrance", .doorPath = "villa/door 1"})
                           .go(20)
                           .close();
  const auto none = [](const auto& before, const auto& after) {
    return compareWalks(before, after, 1e-3).isEmpty();
  };
  EXPECT_TRUE(none(still, body));
  EXPECT_TRUE(none(body, still));
  EXPECT_TRUE(none(body, renamed));
  EXPECT_TRUE(none(renamed, still));
  const auto other = Recorded("other", touch("ann", "crate", 1)).go(20).close();
  EXPECT_EQ(compareWalks(body, other, 1e-3).worse, 1u);
}

TEST(ComparedWalks, TimesThatDescendAreRefused) {
  std::vector<WalkEvent> list;
  for (int i = 0; i < 5000; ++i) list.push_back(makeEventAt(0, 5000 - i));
  EXPECT_THROW(alignEvents(list, list), protocol::mcap::RecordingError);
}

}  // namespace
}  // namespace enfilade::server
