// Tests of the report of a script run.
#include "server/runs/run_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

TEST(RunReport, WalksNameTheirObstacleAndItsGlobalId) {
  const tests::TemporaryFolder folder;
  RunReport report(folder.path());
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

}  // namespace
}  // namespace enfilade::server::testing
