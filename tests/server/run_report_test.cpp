// Tests of the report of a script run.
#include "server/runs/run_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/messages/event_names.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

template <class Enum>
std::string joinNames() {
  std::string names;
  const auto* values = google::protobuf::GetEnumDescriptor<Enum>();
  for (int i = 0; i < values->value_count(); ++i)
    names += toString(static_cast<Enum>(values->value(i)->number())) + " ";
  return names;
}

TEST(EventNames, AreThoseOfThePagesForEachValueOfTheSchema) {
  EXPECT_EQ(joinNames<v1::ContactEvent::Kind>(),
            "unknown begin end near blocked enter leave left_world persist ");
  EXPECT_EQ(joinNames<v1::ContactEvent::Reason>(), "unknown parted left shutdown restart seek ");
  EXPECT_EQ(joinNames<v1::ContactEvent::Phase>(), "unknown begin min end ");
  EXPECT_EQ(joinNames<v1::Verdict>(), "unknown separated touching penetrating ");
  EXPECT_EQ(joinNames<v1::Feature>(), "unknown vertex edge face ");
  EXPECT_EQ(joinNames<v1::Notice::Kind>(),
            "other spawned refused arrived blocked done capture left dropped ");
  EXPECT_EQ(toString(static_cast<v1::Notice::Kind>(1000)), "other");
}

TEST(RunReport, WalksNameTheirObstacleAndItsGlobalId) {
  const tests::TemporaryFolder folder;
  RunReport report(folder.getPath());
  protocol::StepOutcome outcome;
  v1::Notice& blocked = outcome.notices.emplace_back();
  blocked.set_kind(v1::Notice::KIND_BLOCKED);
  blocked.set_avatar("ann");
  blocked.set_obstacle_name("house/wall");
  blocked.set_obstacle_global_id("2O2Fr$t4X7Zf8NOew3FNtn");
  outcome.notices.emplace_back().set_kind(v1::Notice::KIND_ARRIVED);
  report.add(outcome);
  const auto walks = nlohmann::json::parse(report.writeSummary({}, {})).at("walks");
  ASSERT_EQ(walks.size(), 2u);
  EXPECT_EQ(walks[0].at("obstacle"), "house/wall");
  EXPECT_EQ(walks[0].at("obstacle_global_id"), "2O2Fr$t4X7Zf8NOew3FNtn");
  EXPECT_FALSE(walks[1].contains("obstacle_global_id"));
}

TEST(RunReport, TheSummaryContainsTheWorkOfTheTicksAndTheCostliestAvatar) {
  const tests::TemporaryFolder folder;
  RunReport report(folder.getPath());
  RunSummary run;
  run.metrics.set_narrow_queries(101);
  run.metrics.set_vertices_looked_at(102);
  run.metrics.set_part_boxes_made(103);
  run.metrics.set_parts_looked_at(104);
  const auto read = [&] { return nlohmann::json::parse(report.writeSummary(run, {})); };
  EXPECT_FALSE(read().contains("costliest_avatar")) << "a run without avatars";
  v1::AvatarWork& work = *run.metrics.mutable_costliest_avatar();
  work.set_id(7);
  work.set_tick(8);
  work.set_narrow_queries(9);
  work.set_parts_looked_at(10);
  work.mutable_position()->set_x(1.5);
  work.mutable_position()->set_z(-2);
  const nlohmann::json summary = read();
  EXPECT_EQ(summary.at("narrow_queries"), 101);
  EXPECT_EQ(summary.at("vertices_looked_at"), 102);
  EXPECT_EQ(summary.at("part_boxes_made"), 103);
  EXPECT_EQ(summary.at("parts_looked_at"), 104);
  EXPECT_EQ(summary.at("costliest_avatar"),
            nlohmann::json::parse(R"({"id": 7, "tick": 8, "narrow_queries": 9,
                                      "parts_looked_at": 10, "position": [1.5, 0.0, -2.0]})"));
  EXPECT_EQ(nlohmann::json::parse(tests::readContent(folder.getPath() / "summary.json")), summary);
}

TEST(RunReport, TheMapShowsBlockedWalksAndRefusedOrders) {
  const tests::TemporaryFolder folder;
  RunReport report(folder.getPath());
  protocol::StepOutcome outcome;
  outcome.avatars.emplace_back().set_name("ann");
  for (const auto kind : {v1::Notice::KIND_BLOCKED, v1::Notice::KIND_REFUSED,
                          v1::Notice::KIND_ARRIVED, v1::Notice::KIND_REFUSED}) {
    v1::Notice& notice = outcome.notices.emplace_back();
    notice.set_kind(kind);
    notice.mutable_position()->set_x(3);
  }
  outcome.notices.back().clear_position();  // a body's order, for example
  report.add(outcome);
  EXPECT_EQ(report.trace().blockedWalks.size(), 1u);
  ASSERT_EQ(report.trace().refusedOrders.size(), 1u);
  EXPECT_EQ(report.trace().refusedOrders[0].point.x(), 3);
}

}  // namespace
}  // namespace enfilade::server::testing
