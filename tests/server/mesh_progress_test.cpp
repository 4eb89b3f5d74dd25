// Progress of building navigation meshes: of orders, of queries that wait for others in their
// world, and of worlds that wait for another one.
#include <algorithm>
#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "server/hosting/query_service.hpp"
#include "server/navigation/shared_meshes.hpp"
#include "tests/server/eventually.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

v1::ClientMessage orderGo(bool progress) {
  v1::ClientMessage message;
  v1::Command& command = *message.mutable_command();
  command.set_avatar("ann");
  *command.mutable_go()->mutable_to()->mutable_point() = makeVec(8, 0, 0);
  command.mutable_go()->set_progress(progress);
  return message;
}

class MeshProgress : public ServedRoom {
 protected:
  /// The shares that a client receives before the reply to its order.
  std::vector<double> order(protocol::Client& client, const v1::ClientMessage& message) {
    const v1::ServerMessage reply = client.request(message);
    EXPECT_TRUE(reply.command().accepted()) << reply.command().error().message();
    std::vector<double> shares;
    for (const v1::ServerMessage& event : client.takeEvents()) {
      if (!event.has_navigation_progress()) continue;
      EXPECT_EQ(event.navigation_progress().request_id(), reply.reply_to());
      shares.push_back(event.navigation_progress().share());
    }
    return shares;
  }
};

TEST_F(MeshProgress, GoReportsItIfItIsAsked) {
  for (const bool isAsked : {false, true}) {
    serve();
    auto ann = makeClient("ann");
    ASSERT_FALSE(ann.command(spawn("ann", 2, 0, 0)));
    const std::vector<double> shares = order(ann, orderGo(isAsked));
    EXPECT_EQ(shares.empty(), !isAsked);
    if (!isAsked) continue;
    EXPECT_TRUE(std::ranges::is_sorted(shares));
    EXPECT_LE(shares.front(), scene::Navigation::kTileShare);
    EXPECT_EQ(shares.back(), 1);
    EXPECT_TRUE(order(ann, orderGo(true)).empty()) << "the meshes are there";
  }
}

/// The first query holds the thread until the others wait.
TEST(QueryService, AQueryReportsTheMeshesOfThoseBeforeIt) {
  const auto scene = makeSmallRoom();
  const scene::World world(scene);
  const auto makeQuery = [&](double radius) {
    SceneQuery query{world.snapshot(), {}, world.settings(), {}};
    query.message.mutable_navigation()->set_radius(radius);
    query.message.mutable_navigation()->mutable_islands()->set_count(1);
    return query;
  };
  QueryService service(scene);
  std::promise<void> allWait;
  service.submit(makeQuery(-1), [&](const auto&) { allWait.get_future().wait(); });
  std::vector<double> shares;
  std::size_t before = 0;
  service.submit(makeQuery(0.3), [&](const auto&) { before = shares.size(); });
  SceneQuery last = makeQuery(0.4);
  last.progress = [&](double share) { shares.push_back(share); };
  service.submit(std::move(last), [](const auto&) {});
  allWait.set_value();
  service.finish();
  ASSERT_GT(before, 2u);
  EXPECT_EQ(shares[before - 1], 1);
  ASSERT_GT(shares.size(), before);
  EXPECT_LE(shares[before], scene::Navigation::kTileShare) << "its own begin";
  EXPECT_EQ(shares.back(), 1);
}

/// The first world continues when the second one knows its share.
TEST(SharedMeshes, AWorldReportsTheMeshesThatAnotherOneBuilds) {
  const auto scene = makeSmallRoom();
  const MeshRequest request{scene, {}, {}, false, scene::World(scene).snapshot()};
  std::atomic<double> built{0}, known{0};
  std::atomic<int> unknown{0};
  std::jthread first([&] {
    makeNavigation(request, [&](double share) {
      built = share;
      if (unknown > 0) return;  // one failure takes 20 s
      const double seen = share * scene::Navigation::kTileShare;
      if (!becomesTrue([&] { return known >= seen; })) ++unknown;
    });
  });
  ASSERT_TRUE(becomesTrue([&] { return built > 0; }));
  std::vector<double> shares;
  const auto navigation = makeNavigation(request, [&](double share) {
    known = share;
    shares.push_back(share);
  });
  first.join();
  EXPECT_EQ(unknown, 0);
  EXPECT_EQ(navigation->islands().size(), 1u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_LE(shares.front(), scene::Navigation::kTileShare);
  EXPECT_EQ(shares.back(), 1);
}

TEST(SharedMeshes, AfterAFailureTheWorldThatWaitsBuildsThem) {
  const auto scene = makeSmallRoom();
  const MeshRequest request{scene, {}, {}, false, scene::World(scene).snapshot()};
  std::atomic<bool> begun{false}, waits{false};
  std::jthread first([&] {
    const auto fail = [&](double) {
      begun = true;
      becomesTrue([&] { return waits.load(); });
      throw std::runtime_error("no memory");
    };
    EXPECT_THROW(makeNavigation(request, fail), std::runtime_error);
  });
  ASSERT_TRUE(becomesTrue([&] { return begun.load(); }));
  const auto navigation = makeNavigation(request, [&](double) { waits = true; });
  EXPECT_EQ(navigation->islands().size(), 1u);
}

}  // namespace
}  // namespace enfilade::server::testing
