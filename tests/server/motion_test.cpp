// Tests of motion settings from the command line to WorldSettings, and of avatar orders from
// messages.
#include <gtest/gtest.h>

#include <cmath>

#include "server/app/command_line.hpp"
#include "server/base/server_limits.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/in_process_driver.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {
namespace {

std::variant<ProgramCommand, ExitCode> read(std::vector<const char*> options) {
  std::vector<const char*> arguments{"enfilade",   "replay", "room.obj",
                                     "walk.jsonl", "--out",  "out"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return readCommandLine(static_cast<int>(arguments.size()), arguments.data());
}

scene::WorldSettings readSettings(std::vector<const char*> options) {
  return std::get<ReplayCommand>(std::get<ProgramCommand>(read(std::move(options)))).settings;
}

TEST(MotionOptions, SetTheWorldSettingsAndArePolicies) {
  const scene::WorldSettings settings =
      readSettings({"--step-height", "0.2", "--epsilon", "0.001", "--slope", "30", "--sliding",
                    "stop", "--speed-limit", "2.5"});
  EXPECT_EQ(settings.stepHeight, 0.2);
  EXPECT_EQ(settings.contactOffset, 0.001);
  EXPECT_EQ(settings.maxSpeed, 2.5);
  const v1::Policies policies = toProto(settings);
  EXPECT_EQ(policies.speed_limit(), 2.5);
  EXPECT_NEAR(policies.walkable_slope(), 30 * 3.14159265358979 / 180, 1e-12);
  EXPECT_EQ(policies.sliding(), "stop");
  EXPECT_GT(policies.jump_limit(), 0);
  EXPECT_EQ(toProto(readSettings({})).sliding(), "slide");
  EXPECT_EQ(readSettings({}).stepHeight, scene::WorldSettings().stepHeight);
}

TEST(MotionOptions, SettingsOutOfRangeAreUsageErrors) {
  for (const auto& bad : std::vector<std::vector<const char*>>{{"--step-height", "nan"},
                                                               {"--step-height", "-0.1"},
                                                               {"--step-height", "3"},
                                                               {"--epsilon", "0"},
                                                               {"--epsilon", "1"},
                                                               {"--epsilon", "1mm"},
                                                               {"--slope", "90"},
                                                               {"--slope", "inf"},
                                                               {"--speed-limit", "0"},
                                                               {"--sliding", "glide"}}) {
    const auto refused = read(bad);
    ASSERT_TRUE(std::holds_alternative<ExitCode>(refused)) << bad[0] << " " << bad[1];
    EXPECT_EQ(std::get<ExitCode>(refused), ExitCode::usageError);
  }
}

class AvatarOrders : public ::testing::Test {
 protected:
  RecordableWorld world{scene::World(makeSmallRoom())};
  InProcessDriver driver{world, nullptr};

  static v1::Command armAt(double x, double y, double z) {
    v1::Command command;
    command.set_avatar("arm");
    v1::Spawn& spawn = *command.mutable_spawn();
    spawn.mutable_at()->set_x(x);
    spawn.mutable_at()->set_y(y);
    spawn.mutable_at()->set_z(z);
    v1::Link& link = *spawn.add_links();
    link.mutable_joint()->mutable_anchor()->set_y(1.9);
    link.mutable_joint()->mutable_axis()->set_y(2);
    v1::Box& box = *link.mutable_part()->mutable_box();
    box.mutable_max()->set_x(0.5);
    box.mutable_max()->set_y(0.1);
    box.mutable_max()->set_z(0.1);
    return command;
  }
};

TEST_F(AvatarOrders, AnArmIsSpawnedDrivenAndReported) {
  ASSERT_FALSE(driver.submit(armAt(0, 0.01, 0)));
  v1::Command drive;
  drive.set_avatar("arm");
  drive.mutable_drive_joints()->add_to()->set_value(0.5);
  drive.mutable_drive_joints()->set_speed(3);
  ASSERT_FALSE(driver.submit(drive));
  protocol::StepOutcome outcome = driver.step();
  for (int i = 0; i < 60 && !outcome.idle; ++i) outcome = driver.step();
  ASSERT_EQ(outcome.avatars.size(), 1u);
  ASSERT_EQ(outcome.avatars[0].joints_size(), 1);
  EXPECT_EQ(outcome.avatars[0].joints(0).value(), 0.5);
}

TEST_F(AvatarOrders, ADriveIntoAWallReportsDisplacementAndObstacle) {
  v1::Command spawn = armAt(0, 0.01, 0);
  spawn.mutable_spawn()->clear_links();
  ASSERT_FALSE(driver.submit(spawn));
  driver.step();
  v1::Command drive;
  drive.set_avatar("arm");
  drive.mutable_drive()->mutable_velocity()->set_x(300);
  ASSERT_FALSE(driver.submit(drive));
  driver.step();
  const protocol::StepOutcome outcome = driver.step();
  const v1::MoveResult& move = outcome.avatars.at(0).move();
  EXPECT_EQ(move.asked().x(), 5);
  EXPECT_LT(std::abs(move.made().x()), 0.01);
  EXPECT_EQ(move.stopped_by_name(), "room_wall");
  EXPECT_EQ(outcome.avatars.at(0).last_stopped_tick(), world.snapshot()->tick);
  EXPECT_EQ(move.verdict(), v1::VERDICT_SEPARATED);
  EXPECT_LT(move.distance(), 0.001);
}

TEST_F(AvatarOrders, InvalidOrdersAreRefusedWithTheirFieldAndChangeNothing) {
  const double nan = std::nan("");
  const auto field = [&](const v1::Command& command) {
    const auto error = driver.submit(command);
    return error ? error->field() : "taken";
  };
  v1::Command bad = armAt(0, 0, 0);
  bad.mutable_spawn()->mutable_links(0)->mutable_joint()->mutable_axis()->set_y(0);
  EXPECT_EQ(field(bad), "spawn.links[0].axis");
  bad = armAt(0, 0, 0);
  bad.mutable_spawn()->mutable_links(0)->mutable_joint()->clear_axis();
  EXPECT_EQ(field(bad), "spawn.links[0].joint.axis");
  bad = armAt(0, 0, 0);
  bad.mutable_spawn()->add_parts()->add_points()->set_x(nan);
  EXPECT_EQ(field(bad), "spawn.parts[0][0].x");
  v1::Command order;
  order.set_avatar("arm");
  order.mutable_jump()->set_height(nan);
  EXPECT_EQ(field(order), "jump.height");
  order.mutable_crouch()->set_height(nan);
  EXPECT_EQ(field(order), "crouch.height");
  order.mutable_drive_joints()->add_to()->set_value(nan);
  EXPECT_EQ(field(order), "drive_joints.to[0]");
  EXPECT_TRUE(driver.step().idle);
  EXPECT_TRUE(world.snapshot()->avatars.empty());
}

TEST(CommandLine, MoreScenesThanAServerHasWorldsAreRefused) {
  std::vector<const char*> arguments{"enfilade", "serve"};
  const auto read = [&] {
    return readCommandLine(static_cast<int>(arguments.size()), arguments.data());
  };
  for (std::uint32_t i = 0; i < ServerLimits().worlds; ++i) arguments.push_back("room.obj");
  EXPECT_TRUE(std::holds_alternative<ProgramCommand>(read()));
  arguments.push_back("room.obj");
  ASSERT_TRUE(std::holds_alternative<ExitCode>(read()));
  EXPECT_EQ(std::get<ExitCode>(read()), ExitCode::usageError);
}

}  // namespace
}  // namespace enfilade::server::testing
