// Replaces each number of every request by NaN, infinity and absurd values. All are refused, and
// the world continues as if no request had been made.
#include <google/protobuf/message.h>

#include <cmath>
#include <limits>

#include "tests/server/body_room.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// Calls `visit` once for each number of the message and its submessages, while it is set to `bad`.
template <class Visit>
void spoilEach(Message& part, const std::string& path, double bad, const Visit& visit) {
  const auto* reflection = part.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection->ListFields(part, &fields);
  for (const FieldDescriptor* field : fields) {
    const std::string name = path + "." + field->name();
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
      const double good = reflection->GetDouble(part, field);
      reflection->SetDouble(&part, field, bad);
      visit(name);
      reflection->SetDouble(&part, field, good);
    }
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      spoilEach(*reflection->MutableMessage(&part, field), name, bad, visit);
      continue;
    }
    for (int i = 0; i < reflection->FieldSize(part, field); ++i)
      spoilEach(*reflection->MutableRepeatedMessage(&part, field, i),
                name + "[" + std::to_string(i) + "]", bad, visit);
  }
}

v1::Command makeCommand(const std::string& avatar) {
  v1::Command command;
  command.set_avatar(avatar);
  return command;
}

/// No coordinate is 0, since a proto3 message omits zeros.
v1::Vec3 makePoint() {
  return makeVec(-4, 0.125, 1);
}

v1::Command makeFullSpawn() {
  v1::Command command = makeCommand("bob");
  v1::Spawn& spawn = *command.mutable_spawn();
  *spawn.mutable_at() = makePoint();
  spawn.set_facing(30);
  spawn.set_radius(0.25);
  spawn.set_height(1.5);
  v1::ConvexPart& part = *spawn.add_parts();
  for (const auto& corner :
       {makeVec(0.1, 0.1, 0.1), makeVec(0.2, 0.1, 0.1), makeVec(0.1, 0.2, 0.1)})
    *part.add_points() = corner;
  *spawn.add_parts()->mutable_box()->mutable_min() = makeVec(-0.1, -0.1, -0.1);
  *spawn.mutable_parts(1)->mutable_box()->mutable_max() = makeVec(0.1, 0.1, 0.1);
  v1::Link& link = *spawn.add_links();
  *link.mutable_joint()->mutable_anchor() = makeVec(0.1, 1, 0.1);
  *link.mutable_joint()->mutable_axis() = makeVec(0.1, 1, 0.1);
  link.mutable_joint()->set_low(-1);
  link.mutable_joint()->set_high(1);
  link.set_value(0.5);
  *link.mutable_part()->mutable_box()->mutable_min() = makeVec(-0.05, -0.05, -0.05);
  *link.mutable_part()->mutable_box()->mutable_max() = makeVec(0.3, 0.05, 0.05);
  return command;
}

std::vector<v1::Command> makeAllOrders() {
  std::vector<v1::Command> orders(7, makeCommand("ann"));
  orders[0] = makeFullSpawn();
  *orders[1].mutable_walk()->add_along() = makePoint();
  *orders[1].mutable_walk()->add_along() = makePoint();
  orders[1].mutable_walk()->set_speed(1.5);
  *orders[2].mutable_look()->mutable_at() = makePoint();
  orders[3].mutable_wait()->set_seconds(1);
  *orders[4].mutable_drive()->mutable_velocity() = makePoint();
  orders[5].mutable_jump()->set_height(0.5);
  *orders[5].mutable_jump()->mutable_velocity() = makePoint();
  orders[6].mutable_crouch()->set_height(1);
  orders.push_back(makeCommand("ann"));
  orders[7].mutable_drive_joints()->add_to()->set_value(0.25);
  orders[7].mutable_drive_joints()->set_speed(2);
  orders.push_back(makeCommand("ann"));
  *orders[8].mutable_go()->mutable_to()->mutable_point() = makePoint();
  orders[8].mutable_go()->set_speed(2);
  return orders;
}

std::vector<v1::RayQuery> makeAllRayQueries() {
  std::vector<v1::RayQuery> queries(2);
  v1::Ray& ray = *queries[0].add_rays();
  *ray.mutable_origin() = makePoint();
  *ray.mutable_direction() = makePoint();
  ray.set_reach(3);
  v1::RangeScan& scan = *queries[1].mutable_scan();
  *scan.mutable_at() = makePoint();
  *scan.mutable_forward() = makeVec(1, 0.1, 0.1);
  *scan.mutable_up() = makeVec(0.1, 1, 0.1);
  scan.set_width(1);
  scan.set_height(1);
  scan.set_columns(2);
  scan.set_rows(2);
  scan.set_reach(3);
  return queries;
}

std::vector<v1::NavigationQuery> makeAllNavigationQueries() {
  std::vector<v1::NavigationQuery> queries(6);
  for (v1::NavigationQuery& query : queries) {
    query.set_radius(0.3);
    query.set_height(1.5);
    query.set_speed(1.5);
  }
  *queries[0].mutable_path()->mutable_from()->mutable_point() = makePoint();
  *queries[0].mutable_path()->add_to()->mutable_point() = makePoint();
  v1::NavigationQuery::Random& random = *queries[1].mutable_random();
  random.set_count(1);
  *random.mutable_near() = makePoint();
  random.set_max_distance(2);
  *random.mutable_away_from() = makePoint();
  random.set_min_distance(0.5);
  *queries[2].mutable_snap()->add_points() = makePoint();
  queries[2].mutable_snap()->set_max_distance(1);
  auto& step = *queries[3].mutable_steps()->add_steps();
  *step.mutable_from() = makePoint();
  *step.mutable_to() = makePoint();
  *queries[4].mutable_clearance()->add_points() = makePoint();
  queries[4].mutable_clearance()->set_max_distance(1);
  queries[5].mutable_map()->set_cell(0.5);
  queries[5].mutable_map()->set_height(0.1);
  return queries;
}

std::vector<v1::FrameRequest> makeAllFrameRequests() {
  std::vector<v1::FrameRequest> requests(3);
  for (v1::FrameRequest& request : requests) {
    request.set_width(8);
    request.set_height(8);
  }
  v1::AvatarEyes& eyes = *requests[0].mutable_eyes();
  eyes.set_avatar("ann");
  eyes.set_fov_y(1);
  eyes.set_near(0.1);
  eyes.set_far(50);
  for (const std::size_t i : {1u, 2u}) {
    v1::FreeCamera& camera = *requests[i].mutable_free();
    *camera.mutable_eye() = makePoint();
    *camera.mutable_up() = makeVec(0.1, 1, 0.1);
    camera.set_near(0.1);
    camera.set_far(50);
  }
  *requests[1].mutable_free()->mutable_forward() = makePoint();
  requests[1].mutable_free()->set_fov_y(1);
  *requests[2].mutable_free()->mutable_target() = makeVec(4, 1, 1);
  requests[2].mutable_free()->set_height_y(3);
  return requests;
}

/// One valid request of each kind with numbers.
std::vector<v1::ClientMessage> makeAllRequests(bool frames) {
  std::vector<v1::ClientMessage> all;
  for (const v1::Command& order : makeAllOrders()) *all.emplace_back().mutable_command() = order;
  v1::BodyCommand& body = *all.emplace_back().mutable_body_command();
  body.set_body("door");
  body.set_to(0.5);
  body.set_speed(1);
  for (const v1::RayQuery& query : makeAllRayQueries()) *all.emplace_back().mutable_rays() = query;
  for (const v1::NavigationQuery& query : makeAllNavigationQueries())
    *all.emplace_back().mutable_navigation() = query;
  all.emplace_back().mutable_subscribe()->set_state_rate(10);
  all.emplace_back().mutable_floor_plan()->set_floor(0.125);
  all.emplace_back().mutable_set_clock()->mutable_free_run()->set_speed(1);
  if (!frames) return all;
  for (const auto& request : makeAllFrameRequests()) *all.emplace_back().mutable_frame() = request;
  return all;
}

/// The error reply; nullopt if the request was done.
std::optional<v1::Error> catchRefusal(protocol::Client& client, const v1::ClientMessage& request) {
  try {
    const v1::ServerMessage reply = client.request(request);
    if (!reply.has_command() || reply.command().accepted()) return std::nullopt;
    return reply.command().error();
  } catch (const protocol::ProtocolError& error) {
    v1::Error refusal;
    refusal.set_message(error.what());
    refusal.set_field(error.field);
    return refusal;
  }
}

class RefusedNumbers : public ServedRoom {
 protected:
  void SetUp() override { serve({}, makeBodyRoom()); }

  /// The same walk each time; `between` is called before each of its steps.
  template <class Between>
  std::vector<std::uint64_t> walk(protocol::Client& ann, const Between& between) {
    std::vector<std::uint64_t> hashes;
    EXPECT_FALSE(ann.command(spawn("ann", -4, 0.001, 0)));
    EXPECT_FALSE(ann.command(walkTo("ann", 0, 0, 0)));
    for (int i = 0; i < 6; ++i) {
      hashes.push_back(ann.step(12).state_hash());
      between(i);
    }
    return hashes;
  }
};

TEST_F(RefusedNumbers, OfEachRequestAreReportedByFieldAndChangeNothing) {
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<std::uint64_t> quiet;
  {
    protocol::Client ann = makeClient("ann");
    quiet = walk(ann, [](int) {});
  }
  serve({}, makeBodyRoom());
  protocol::Client ann = makeClient("ann");
  int spoilt = 0;
  const std::array<double, 6> bad{std::nan(""), inf, -inf, -std::nan(""), 1e300, -1e300};
  const auto disturbed = walk(ann, [&](int step) {
    const double number = bad.at(static_cast<std::size_t>(step));
    for (v1::ClientMessage& request : makeAllRequests(!server_->rendererName().empty())) {
      spoilEach(request, "", number, [&](const std::string& path) {
        ++spoilt;
        const auto error = catchRefusal(ann, request);
        ASSERT_TRUE(error) << path << " = " << number << " was taken";
        EXPECT_FALSE(error->field().empty()) << path << " = " << number << error->message();
        EXPECT_GT(error->message().size(), 10u) << path;
      });
    }
  });
  EXPECT_EQ(disturbed, quiet);
  EXPECT_GT(spoilt, 300);
}

}  // namespace
}  // namespace enfilade::server::testing
