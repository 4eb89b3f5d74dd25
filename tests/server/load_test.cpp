// A small load test; `./dev bench server` does the same with hundreds of clients for seconds.
#include <array>
#include <cstdio>

#include "tests/server/eventually.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/server_load.hpp"

namespace enfilade::server::testing {
namespace {

class Load : public ServedRoom {};

std::string listFaults(const std::vector<std::string>& faults) {
  std::string all;
  for (const std::string& fault : faults) all += fault + "\n";
  return all;
}

TEST_F(Load, TwentyClientsHearEveryEventOnce) {
  constexpr int kClients = 20;
  const auto room = makeSmallRoom();
  serve({}, room);
  tests::LoadOptions options;
  options.port = server_->port();
  options.places = tests::findStandingPlaces(room, kClients, 1);
  ASSERT_EQ(options.places.size(), std::size_t{kClients});
  const tests::LoadResult result = tests::runLoad(
      options, [] {}, [this] { server_->stop(); });
  EXPECT_TRUE(result.faults.empty()) << listFaults(result.faults);
  EXPECT_EQ(result.welcomed, result.clients);
  EXPECT_EQ(result.spawned, result.clients);
  EXPECT_EQ(result.closedInPeace, result.clients);
  EXPECT_EQ(result.replies, result.commands);
  EXPECT_EQ(result.refused, 0u);
  EXPECT_GT(result.begins, 0u) << "no avatar had a contact";
  EXPECT_EQ(result.begins, result.ends) << "all hear of all contacts, and all end with the server";
  EXPECT_FALSE(result.acceptedToShown.empty());
}

TEST_F(Load, VisitorsLeaveNothingBehind) {
  serve();
  protocol::Client other = makeClient("other");
  v1::SetClock freely;  // so that avatars spawn, and leave with their clients
  freely.mutable_free_run()->set_speed(10);
  other.setClock(freely);
  tests::visitRudely(server_->port(), 20, 1);  // warms up one-time allocations
  const auto alone = [&] {
    return other.metrics().clients() == 1 && other.metrics().avatars() == 0;
  };
  ASSERT_TRUE(becomesTrue(alone));
  const tests::Footprint before = tests::measureFootprint();
  tests::visitRudely(server_->port(), 100, 2);
  {
    protocol::Client visitor = makeClient("visitor");  // in the world for certain
    ASSERT_FALSE(visitor.command(spawn("guest", 3, 0.01, 0)));
    ASSERT_TRUE(becomesTrue([&] { return other.metrics().contacts() > 0; }));
  }
  ASSERT_TRUE(becomesTrue(alone));
  EXPECT_EQ(tests::measureFootprint().threads, before.threads);
  // A session leaves the world a moment before its socket is closed.
  EXPECT_TRUE(
      becomesTrue([&] { return tests::measureFootprint().descriptors <= before.descriptors; }));
}

TEST_F(Load, TheExampleClientWalksUntilTheWallStopsIt) {
  serve();
  const std::string command =
      std::string(ENFILADE_EXAMPLE_CLIENT) + " " + std::to_string(server_->port());
  const std::unique_ptr<FILE, int (*)(FILE*)> output(::popen(command.c_str(), "r"), &::pclose);
  ASSERT_TRUE(output);
  std::string text;
  std::array<char, 4096> some{};
  while (std::fgets(some.data(), some.size(), output.get())) text += some.data();
  EXPECT_NE(text.find("KIND_BEGIN ann room_floor"), std::string::npos) << text;
  EXPECT_NE(text.find("KIND_BLOCKED ann room_wall"), std::string::npos) << text;
}

}  // namespace
}  // namespace enfilade::server::testing
