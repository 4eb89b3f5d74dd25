// Tests of rays through a connection: hits are the world's objects.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>

#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

class Rays : public ServedRoom {
 protected:
  void SetUp() override { serve(); }
};

v1::RayQuery makeRayQuery(const v1::Vec3& origin, const v1::Vec3& direction, double reach = 0) {
  v1::RayQuery query;
  v1::Ray& ray = *query.add_rays();
  *ray.mutable_origin() = origin;
  *ray.mutable_direction() = direction;
  ray.set_reach(reach);
  return query;
}

protocol::ProtocolError catchRefusal(protocol::Client& client, const v1::RayQuery& query) {
  try {
    client.rays(query);
  } catch (const protocol::ProtocolError& error) {
    return error;
  }
  ADD_FAILURE() << "it was taken";
  return {v1::ERROR_UNSPECIFIED, "taken"};
}

TEST_F(Rays, ReportTheHitEntityAndPoint) {
  protocol::Client ann = makeClient("ann");
  const v1::RayReply reply = ann.rays(makeRayQuery(makeVec(0, 1, 0), makeVec(2, 0, 0)));
  ASSERT_EQ(reply.hits_size(), 1);
  const v1::RayHit& hit = reply.hits(0);
  EXPECT_TRUE(hit.met());
  EXPECT_EQ(hit.entity(), kWall);
  EXPECT_EQ(hit.name(), "room_wall");
  EXPECT_DOUBLE_EQ(hit.distance(), 5);
  EXPECT_DOUBLE_EQ(hit.point().x(), 5);
  EXPECT_DOUBLE_EQ(hit.normal().x(), -1);
  EXPECT_FALSE(ann.rays(makeRayQuery(makeVec(0, 1, 0), makeVec(2, 0, 0), 4.9)).hits(0).met());
}

TEST_F(Rays, HitAnAvatarAtItsPoseButNotTheObserver) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  const v1::StepReply step = ann.step(1);
  v1::RayQuery query = makeRayQuery(makeVec(-2, 1, 0), makeVec(1, 0, 0), 20);
  query.set_tick(step.tick());
  const v1::RayHit hit = ann.rays(query).hits(0);
  EXPECT_EQ(hit.name(), "ann");
  EXPECT_NEAR(hit.distance(), 1.7, 0.05);
  query.set_through_avatar("ann");
  EXPECT_EQ(ann.rays(query).hits(0).entity(), kWall);
  query.clear_through_avatar();
  query.set_only_blocked(true);
  EXPECT_TRUE(ann.rays(query).hits(0).met());
  query.mutable_rays(0)->set_reach(1.5);
  EXPECT_FALSE(ann.rays(query).hits(0).met());
}

TEST_F(Rays, AScanFromTheEyesGivesDistancesAndEntitiesRowByRow) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(1);
  v1::RayQuery query;
  v1::RangeScan& scan = *query.mutable_scan();
  scan.set_avatar("ann");
  scan.set_width(0.2);
  scan.set_height(std::numbers::pi);
  scan.set_columns(3);
  scan.set_rows(3);
  protocol::ReceivedScan seen;
  const v1::RayReply reply = ann.rays(query, &seen);
  EXPECT_EQ(reply.columns(), 3u);
  EXPECT_EQ(reply.rows(), 3u);
  EXPECT_EQ(reply.hits_size(), 0);
  ASSERT_EQ(seen.distances.size(), 9u);
  EXPECT_TRUE(std::isnan(seen.distances[1])) << "the sky, straight above";
  EXPECT_EQ(seen.entities[1], 0u);
  EXPECT_NEAR(seen.distances[4], 5, 1e-6) << "the wall, straight ahead";
  EXPECT_EQ(seen.entities[4], kWall);
  EXPECT_GT(seen.distances[3], 5) << "to the left the wall is farther";
  EXPECT_NEAR(seen.distances[7], 1.6, 0.01) << "the floor below the eyes";
  EXPECT_EQ(seen.entities[7], kFloor);
}

TEST_F(Rays, PackedRaysEqualUnpackedOnes) {
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 2, 0.001, 0)));
  ann.step(1);
  const auto capabilities = ann.welcome().capabilities();
  EXPECT_EQ(std::count(capabilities.begin(), capabilities.end(), "packed_rays"), 1);
  v1::RayQuery query = makeRayQuery(makeVec(0, 1, 0), makeVec(2, 0, 0));
  *query.add_rays() = makeRayQuery(makeVec(0, 1, 0), makeVec(0, 1, 0)).rays(0);
  *query.add_rays() = makeRayQuery(makeVec(0, 1, 2), makeVec(1, -0.25, 0.125)).rays(0);
  *query.add_rays() = makeRayQuery(makeVec(0, 1, 2), makeVec(1, -0.25, 0.25)).rays(0);
  const v1::RayReply plain = ann.rays(query);
  query.set_packed(true);
  v1::ClientMessage asked;
  *asked.mutable_rays() = query;
  std::vector<std::uint8_t> attachment;
  const v1::RayReply packed = ann.request(asked, &attachment).rays();
  const int count = plain.hits_size();
  ASSERT_EQ(attachment.size(), 60 * static_cast<std::size_t>(count));
  EXPECT_EQ(packed.hits_size(), 0);
  EXPECT_EQ(packed.tick(), plain.tick());
  std::map<std::uint32_t, std::string> names;
  for (const v1::Entity& entity : packed.met()) names[entity.id()] = entity.name();
  EXPECT_EQ(names.size(), 2u) << "ann, and the floor twice";
  std::vector<double> numbers(7 * static_cast<std::size_t>(count));
  std::vector<std::uint32_t> entities(static_cast<std::size_t>(count));
  std::memcpy(numbers.data(), attachment.data(), 8 * numbers.size());
  std::memcpy(entities.data(), attachment.data() + 8 * numbers.size(), 4 * entities.size());
  for (std::size_t i = 0; i < entities.size(); ++i) {
    const v1::RayHit& hit = plain.hits(static_cast<int>(i));
    EXPECT_EQ(entities[i], hit.entity());
    EXPECT_EQ(names[entities[i]], hit.name());
    const double* of = &numbers[7 * i];
    if (!hit.met()) {
      EXPECT_TRUE(std::all_of(of, of + 7, [](double number) { return std::isnan(number); }));
      continue;
    }
    const std::vector<double> expected{hit.distance(),  hit.point().x(),  hit.point().y(),
                                       hit.point().z(), hit.normal().x(), hit.normal().y(),
                                       hit.normal().z()};
    EXPECT_EQ(std::vector<double>(of, of + 7), expected) << "to the last bit";
  }
  EXPECT_FALSE(plain.hits(1).met()) << "straight up is nothing";
}

TEST_F(Rays, InvalidRaysAreRefusedByTheirField) {
  ServerLimits limits;
  limits.rays = 2;
  limits.scanRays = 100;
  serve(limits);
  protocol::Client ann = makeClient("ann");
  EXPECT_EQ(catchRefusal(ann, {}).field, "rays");
  v1::RayQuery query = makeRayQuery(makeVec(0, std::nan(""), 0), makeVec(1, 0, 0));
  EXPECT_EQ(catchRefusal(ann, query).field, "rays.rays[0].origin");
  EXPECT_EQ(catchRefusal(ann, makeRayQuery(makeVec(0, 1, 0), makeVec(0, 0, 0))).field,
            "rays.rays[0].direction");
  EXPECT_EQ(catchRefusal(ann, makeRayQuery(makeVec(0, 1, 0), makeVec(1, 0, 0), -1)).field,
            "rays.rays[0].reach");
  query = makeRayQuery(makeVec(0, 1, 0), makeVec(1, 0, 0));
  query.set_tick(7);
  EXPECT_EQ(catchRefusal(ann, query).code, v1::ERROR_TICK_GONE);
  query.clear_tick();
  query.set_through_avatar("bob");
  EXPECT_EQ(catchRefusal(ann, query).code, v1::ERROR_UNKNOWN_AVATAR);
  for (int i = 0; i < 2; ++i) *query.add_rays() = query.rays(0);
  EXPECT_EQ(catchRefusal(ann, query).code, v1::ERROR_TOO_LARGE);
  v1::RayQuery scan;
  scan.mutable_scan()->set_columns(1);
  EXPECT_EQ(catchRefusal(ann, scan).field, "rays.scan");
  *scan.mutable_scan()->mutable_at() = makeVec(0, 1, 0);
  *scan.mutable_scan()->mutable_up() = makeVec(3, 0, 0);
  EXPECT_EQ(catchRefusal(ann, scan).field, "rays.scan.up");
  scan.mutable_scan()->clear_up();
  scan.mutable_scan()->set_columns(4'000'000'000u);
  scan.mutable_scan()->set_rows(4'000'000'000u);
  EXPECT_EQ(catchRefusal(ann, scan).code, v1::ERROR_TOO_LARGE);
  EXPECT_EQ(ann.rays(makeRayQuery(makeVec(0, 1, 0), makeVec(1, 0, 0))).hits(0).entity(), kWall)
      << "still answers";
}

}  // namespace
}  // namespace enfilade::server::testing
