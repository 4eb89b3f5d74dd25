// Tests of --audit: metrics, log and exit code.
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include "scene/world/data/world_data.hpp"
#include "server/app/command_line.hpp"
#include "server/runs/in_process_driver.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

/// Captures the log for the lifetime of the object.
class Log {
 public:
  Log() : before_(spdlog::default_logger()) {
    auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(text_);
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", std::move(sink)));
  }
  ~Log() { spdlog::set_default_logger(before_); }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
  std::string getText() const { return text_.str(); }

 private:
  std::shared_ptr<spdlog::logger> before_;
  std::ostringstream text_;
};

/// Makes the broad phase miss the wall.
void withholdTheWall(scene::World& world) {
  std::vector<scene::Aabb> boxes = world.scene().staticBoxes();
  boxes[kWall - 1] = {scene::Vec3::Constant(500), scene::Vec3::Constant(501)};
  world.data().broadPhase = collision::SortAndSweep(boxes);
}

std::variant<ProgramCommand, ExitCode> readArguments(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "enfilade");
  return readCommandLine(static_cast<int>(arguments.size()), arguments.data());
}

TEST(AuditOption, IsAWholeNumberOfTicksAndOffWithoutIt) {
  const auto replay = [](std::vector<const char*> audit) {
    std::vector<const char*> arguments{"replay", "room.obj", "walk.jsonl", "--out", "out"};
    arguments.insert(arguments.end(), audit.begin(), audit.end());
    return readArguments(arguments);
  };
  const auto every = [&](const char* ticks) {
    return std::get<ReplayCommand>(std::get<ProgramCommand>(replay({"--audit", ticks}))).auditEvery;
  };
  EXPECT_EQ(std::get<ReplayCommand>(std::get<ProgramCommand>(replay({}))).auditEvery, 0u);
  EXPECT_EQ(every("0"), 0u);
  EXPECT_EQ(every("10"), 10u);
  EXPECT_EQ(every("010"), 10u) << "decimal, not octal";
  EXPECT_EQ(every("1000000"), 1'000'000u);
  for (const char* bad : {"-1", "1.5", "x", "", "1000001", "99999999999", "1 "}) {
    const auto refused = replay({"--audit", bad});
    ASSERT_TRUE(std::holds_alternative<ExitCode>(refused)) << bad;
    EXPECT_EQ(std::get<ExitCode>(refused), ExitCode::usageError);
  }
  const auto serve = std::get<ProgramCommand>(readArguments({"serve", "room.obj", "--audit", "7"}));
  EXPECT_EQ(std::get<ServeCommand>(serve).auditEvery, 7u);
}

TEST(AuditOfAWalk, AMissedPairIsCountedLoggedAndAViolation) {
  scene::World blind(makeSmallRoom());
  withholdTheWall(blind);
  scene::setAuditInterval(blind, 2);
  RecordableWorld world(std::move(blind));
  InProcessDriver driver(world, nullptr);
  const Log log;
  ASSERT_FALSE(driver.submit(spawn("ann", 4.8, 0.01, 0)));
  driver.step();
  EXPECT_EQ(log.getText(), "") << "the first tick is not audited";
  driver.step();
  const v1::Audit audit = driver.metrics().audit();
  EXPECT_EQ(audit.ticks(), 1u);
  EXPECT_EQ(audit.pairs(), 2u) << "the floor and the wall";
  EXPECT_EQ(audit.missed(), 1u);
  EXPECT_EQ(audit.extra(), 0u);
  EXPECT_GT(audit.timing().max_us(), 0);
  for (const char* word : {"error", "tick 2", "missed", "'ann'", "'room_wall'", "(5, 0, -4)"}) {
    EXPECT_NE(log.getText().find(word), std::string::npos) << word << " in " << log.getText();
  }
  EXPECT_EQ(computeExitCode({}, driver.metrics(), false), ExitCode::violations);
}

TEST(AuditOfAWalk, ManyFindingsOfATickAreCountedAndTheFirstLogged) {
  scene::World world(makeSmallRoom());
  scene::TickReport report;
  report.snapshot = world.snapshot();
  report.audit.emplace();
  report.audit->findings.resize(20);
  AuditTotals totals;
  totals.addTick(*report.audit);
  EXPECT_EQ(totals.missed, 20u);
  EXPECT_FALSE(totals.isClean());
  const Log log;
  logFindings(world, report);
  EXPECT_NE(log.getText().find("12 more"), std::string::npos) << log.getText();
}

TEST(AuditOfAWalk, ACorrectTickIsNoViolation) {
  v1::Metrics metrics;
  EXPECT_EQ(computeExitCode({}, metrics, true), ExitCode::success);
  metrics.mutable_audit()->set_pairs(5);
  EXPECT_EQ(computeExitCode({}, metrics, true), ExitCode::success);
  metrics.mutable_audit()->set_extra(1);
  EXPECT_EQ(computeExitCode({}, metrics, false), ExitCode::violations);
}

class AuditedServer : public ServedRoom {};

TEST_F(AuditedServer, ReportsItsAuditInTheMetricsAndAtItsEnd) {
  ServerOptions options;
  options.world.auditEvery = 5;
  server_ = std::make_unique<Server>(makeSmallRoom(), HostPort{"127.0.0.1", 0}, std::move(options));
  v1::Audit audit;
  {
    protocol::Client ann = makeClient("ann");
    ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
    ASSERT_FALSE(ann.command(walkTo("ann", 8, 0, 0)));
    ann.step(60);
    audit = ann.metrics().audit();
  }
  EXPECT_EQ(audit.ticks(), 12u);
  EXPECT_GE(audit.pairs(), 12u) << "the floor, at least";
  EXPECT_EQ(audit.missed(), 0u);
  EXPECT_EQ(audit.extra(), 0u);
  server_->stop();
  EXPECT_EQ(server_->auditTotals().ticks, 12u);
  EXPECT_EQ(server_->auditTotals().pairs, audit.pairs());
  EXPECT_TRUE(server_->auditTotals().isClean());
}

TEST_F(AuditedServer, ReportsNoAuditByDefault) {
  serve();
  protocol::Client ann = makeClient("ann");
  ann.step(10);
  EXPECT_FALSE(ann.metrics().has_audit());
}

}  // namespace
}  // namespace enfilade::server::testing
