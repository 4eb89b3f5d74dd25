// Tests of navigation through a connection, in scripts and by `enfilade route`.
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "server/navigation/navigation_service.hpp"
#include "tests/server/program_fixture.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

v1::Command go(const std::string& avatar, const v1::Vec3& to) {
  v1::Command command;
  command.set_avatar(avatar);
  *command.mutable_go()->mutable_to()->mutable_point() = to;
  return command;
}

class NavigationRequests : public ServedRoom {};

TEST_F(NavigationRequests, AnObserverMayAskAndTheReplyHasTheTick) {
  serve();
  auto ann = makeClient("ann");
  v1::ClientMessage step;
  step.mutable_step()->set_ticks(3);
  ann.request(std::move(step));
  v1::ClientMessage request;
  v1::NavigationQuery& query = *request.mutable_navigation();
  query.set_tick(3);
  *query.mutable_path()->mutable_from()->mutable_point() = makeVec(2, 0, 0);
  *query.mutable_path()->add_to()->mutable_point() = makeVec(8, 0, 0);
  query.mutable_path()->add_to()->set_name("room_column");
  const v1::NavigationReply reply = ann.request(request).navigation();
  EXPECT_EQ(reply.tick(), 3u);
  ASSERT_EQ(reply.paths_size(), 2);
  EXPECT_TRUE(reply.paths(0).found()) << reply.paths(0).reason();
  EXPECT_TRUE(reply.paths(1).found()) << reply.paths(1).reason();
  EXPECT_GE(reply.paths(0).points_size(), 3);
  EXPECT_EQ(reply.island_areas_size(), 1);
  query.set_tick(2);
  EXPECT_THROW(ann.request(request), protocol::ProtocolError);
}

TEST_F(NavigationRequests, GoIsAWalkAfterTheQueuedOrders) {
  serve();
  auto ann = makeClient("ann");
  v1::Subscribe subscription;
  subscription.set_notices(true);
  ann.subscribe(subscription);
  EXPECT_FALSE(ann.command(spawn("ann", 2, 0, 0)));
  EXPECT_FALSE(ann.command(go("ann", makeVec(8, 0, 0))));
  EXPECT_FALSE(ann.command(go("ann", makeVec(2, 0, 0))));
  const auto refused = ann.command(go("ann", makeVec(5.1, 1, 0)));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->field(), "go.to");
  EXPECT_TRUE(ann.command(go("bob", makeVec(2, 0, 0))));
  int arrived = 0;
  for (int i = 0; i < 60 && arrived < 2; ++i) {
    ann.step(60);
    for (const v1::ServerMessage& message : ann.takeEvents()) {
      for (const v1::Notice& notice : message.events().notices()) {
        EXPECT_NE(notice.kind(), v1::Notice::KIND_BLOCKED) << notice.text();
        arrived += notice.kind() == v1::Notice::KIND_ARRIVED ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(arrived, 2);
}

/// The log lines of an answer.
std::string captureLogOfAnswer(const std::shared_ptr<const scene::Scene>& scene,
                               const std::string& goal, std::string& error) {
  std::ostringstream log;
  const auto usual = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "answer", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  v1::NavigationQuery query;
  *query.mutable_path()->mutable_from()->mutable_point() = makeVec(2, 0, 0);
  query.mutable_path()->add_to()->set_name(goal);
  std::vector<std::uint8_t> attachment;
  NavigationService service(scene);
  const auto answer = service.answer(query, {scene::World(scene).snapshot(), {}}, attachment);
  spdlog::set_default_logger(usual);
  const auto* refused = std::get_if<v1::Error>(&answer);
  error = refused ? refused->message() : "";
  return log.str();
}

TEST(NavigationPlaces, AnUnknownNameIsRefusedBeforeMeshesAreBuilt) {
  const auto scene = makeSmallRoom();
  std::string error;
  EXPECT_EQ(captureLogOfAnswer(scene, "room:attic", error), "");
  EXPECT_NE(error.find("'room:attic'"), std::string::npos) << error;
  const std::string log = captureLogOfAnswer(scene, scene->model().objects.back().path, error);
  EXPECT_NE(log.find("built in"), std::string::npos) << log;
  EXPECT_EQ(error, "");
}

class Route : public ProgramFixture {};

TEST_F(Route, PrintsAPathItsLengthAndItsNarrowestPlace) {
  const Ended ended = run({"route", getPath("room.obj"), "2,0,0", "8,0,0", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto report = nlohmann::json::parse(ended.out);
  EXPECT_TRUE(report.at("found").get<bool>());
  EXPECT_GT(report.at("length").get<double>(), 10);
  EXPECT_GE(report.at("points").size(), 3u);
  const Ended text = run({"route", getPath("room.obj"), "2,0,0", "object:room_column"});
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find(" m from 2,0,0 to object:room_column"), std::string::npos) << text.out;
}

TEST_F(Route, WithoutAPathItExitsWithThreeAndTheReason) {
  const Ended ended = run({"route", getPath("room.obj"), "2,0,0", "5.1,3.05,0", "--json"});
  EXPECT_EQ(ended.code, 3) << ended.err;
  const auto report = nlohmann::json::parse(ended.out);
  EXPECT_FALSE(report.at("found").get<bool>());
  EXPECT_FALSE(report.at("reason").get<std::string>().empty());
  const Ended unknown = run({"route", getPath("room.obj"), "2,0,0", "attic"});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_NE(unknown.err.find("TO: 'attic'"), std::string::npos) << unknown.err;
  EXPECT_NE(unknown.err.find("inspect --objects"), std::string::npos) << unknown.err;
}

/// The wall is a gate, which rises by 3.2 m.
constexpr const char* kGate =
    R"({"walk":1,"bodies":[{"name":"gate","kind":"sliding","objects":["room_wall"],"axis":[0,1,0],)"
    R"("limits":[0,3.2],"speed":1.6}]})";

TEST_F(Route, DoorsAreLegsAndStandWhereTheWalkerMeetsThem) {
  write(getPath("room.walk.json"), kGate);
  const Ended ended = run({"route", getPath("room.obj"), "2,0,0", "8,0,0", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto report = nlohmann::json::parse(ended.out);
  ASSERT_EQ(report.at("doors").size(), 1u);
  EXPECT_NEAR(report.at("doors")[0].at("distance").get<double>(), 5 - 0.3 - 2, 0.02);
  EXPECT_NEAR(report.at("doors")[0].at("seconds_to_open").get<double>(), 2, 1e-6);
  double seconds = 0;
  int doors = 0;
  for (const auto& leg : report.at("legs")) {
    seconds += leg.at("seconds").get<double>();
    doors += leg.at("kind") == "door" && leg.at("name") == "gate" ? 1 : 0;
  }
  EXPECT_EQ(doors, 1);
  EXPECT_NEAR(seconds, report.at("seconds").get<double>(), 1e-9);
  const Ended text = run({"route", getPath("room.obj"), "2,0,0", "8,0,0"});
  EXPECT_NE(text.out.find("door: gate, after 2.7"), std::string::npos) << text.out;
}

TEST_F(Route, ThePlanShowsThePathOrWhatIsInTheWay) {
  const std::string plan = getPath("plan.png");
  EXPECT_EQ(run({"route", getPath("room.obj"), "2,0,0", "8,0,0", "--plan", plan}).code, 0);
  const std::string found = readText(plan);
  EXPECT_EQ(found.substr(1, 3), "PNG");
  const Ended refused = run({"route", getPath("room.obj"), "2,0,0", "5.1,3.05,0", "--plan", plan});
  EXPECT_EQ(refused.code, 3);
  const std::string none = readText(plan);
  EXPECT_EQ(none.substr(1, 3), "PNG");
  EXPECT_NE(none, found);
  for (const char* wrong : {"plan.svg", "plan", "nowhere/plan.png"}) {
    const Ended ended =
        run({"route", getPath("room.obj"), "2,0,0", "8,0,0", "--plan", getPath(wrong)});
    EXPECT_EQ(ended.code, 2) << wrong;
    EXPECT_NE(ended.err.find("--plan"), std::string::npos) << ended.err;
  }
}

TEST_F(Route, AScriptGoesAroundTheWall) {
  write(getPath("walk.jsonl"),
        "{\"spawn\":\"ann\",\"at\":[2,0,0]}\n{\"go\":\"ann\",\"to\":[8,0,0]}\n"
        "{\"go\":\"ann\",\"to\":\"room_column\"}\n");
  const Ended ended = run(
      {"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("out"), "--strict"});
  EXPECT_EQ(ended.code, 0) << ended.err << ended.out;
  write(getPath("bad.jsonl"),
        "{\"spawn\":\"ann\",\"at\":[2,0,0]}\n{\"go\":\"ann\",\"to\":\"attic\"}\n");
  const Ended refused = run(
      {"replay", getPath("room.obj"), getPath("bad.jsonl"), "--out", getPath("out"), "--strict"});
  EXPECT_EQ(refused.code, 3);
  EXPECT_NE((refused.err + refused.out).find("'attic'"), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace enfilade::server::testing
