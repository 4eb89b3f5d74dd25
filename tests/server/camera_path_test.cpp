#include "server/capture/path/camera_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/capture/path/json_path.hpp"
#include "server/capture/path/tum_path.hpp"

namespace enfilade::server {
namespace {

constexpr double kFps = 10;

/// The error message; "" if parsing succeeds.
template <class Parse>
std::string catchPathError(const Parse& parse) {
  try {
    parse();
  } catch (const CameraPathError& error) {
    return error.what();
  }
  return "";
}

std::string catchTumError(const std::string& text) {
  return catchPathError([&] { parseTumPath(text, "path.txt", CameraAxes::opengl); });
}
std::string catchJsonError(const std::string& text) {
  return catchPathError([&] { parseJsonPath(text, "path.json", CameraAxes::opengl, kFps); });
}

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(JsonPath, DeeplyNestedBracketsAreAnError) {
  const std::string nest = std::string(200'000, '[') + std::string(200'000, ']');
  EXPECT_TRUE(holds(catchJsonError(R"({"frames":[)" + nest + "]}"), "a too deeply nested value"));
}

TEST(TumPath, LinesAreTimePlaceAndRotation) {
  const CameraPath path = parseTumPath(
      "# ground truth\n\n0.5 1 2 3 0 0 0 1 # here\r\n\t0.75  4 5 6  0 0.70710678 0 0.70710678\n",
      "path.txt", CameraAxes::opengl);
  ASSERT_EQ(path.poses.size(), 2U);
  EXPECT_EQ(path.poses[0].time, 0.5);
  EXPECT_EQ(path.poses[0].eye, Vec3(1, 2, 3));
  EXPECT_LT((-path.poses[0].rotation.col(2) + Vec3::UnitZ()).norm(), 1e-12);  // looks along -z
  // A quarter turn to the left about y: along -x.
  EXPECT_LT((-path.poses[1].rotation.col(2) + Vec3::UnitX()).norm(), 1e-8);
  EXPECT_FALSE(path.lens);
}

TEST(TumPath, OpenCvsCameraLooksAlongItsOwnZWithYDown) {
  const CameraPath path = parseTumPath("0 0 0 0 0 0 0 1", "path.txt", CameraAxes::opencv);
  EXPECT_LT((-path.poses[0].rotation.col(2) - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_LT((path.poses[0].rotation.col(1) + Vec3::UnitY()).norm(), 1e-12);
  EXPECT_NEAR(path.poses[0].rotation.determinant(), 1, 1e-12);
}

TEST(TumPath, WrongLinesAreReportedWithFileLineAndValue) {
  const std::string good = "0 0 0 0 0 0 0 1\n";
  EXPECT_TRUE(holds(catchTumError(good + "\n1 0 0 x 0 0 0 1"), "path.txt:3: 'x'"));
  EXPECT_TRUE(holds(catchTumError(good + "1 0 0 nan 0 0 0 1"), "path.txt:2: 'nan'"));
  EXPECT_TRUE(holds(catchTumError(good + "1 0 0 inf 0 0 0 1"), "path.txt:2: 'inf'"));
  EXPECT_TRUE(holds(catchTumError(good + "1 0 0 0 0 0 1"), "path.txt:2: 7 numbers"));
  EXPECT_TRUE(holds(catchTumError(good + "1 0 0 0 0 0 0 1 9"), "path.txt:2: more than eight"));
  EXPECT_TRUE(
      holds(catchTumError(good + "1 0 0 0 0 0 0 0"), "path.txt:2: the quaternion's length"));
  EXPECT_TRUE(holds(catchTumError(good + "0 0 0 0 0 0 0 1"), "path.txt:2: time"));
  EXPECT_TRUE(holds(catchTumError(good + "1 2e9 0 0 0 0 0 1"), "path.txt:2: the position"));
  EXPECT_TRUE(holds(catchTumError("# nothing\n\n"), "path.txt: contains no pose"));
  EXPECT_TRUE(
      holds(catchTumError("#t [ns],p,q\n1403636579763555584,1,2,3,1,0,0,0"), "path.txt:2: commas"));
}

TEST(Quaternions, ComeBackFromTheirRotation) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    Eigen::Vector4d q(normal(random), normal(random), normal(random), normal(random));
    q.normalize();
    if (q[3] < 0) q = -q;
    const auto back = toQuaternion(toRotation({q[0], q[1], q[2], q[3]}));
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(back[k], q[static_cast<Eigen::Index>(k)], 1e-12);
  }
}

TEST(JsonPath, APoseHasPositionAndDirection) {
  const CameraPath path = parseJsonPath(
      R"([{"eye":[0,1,0],"look_at":[5,1,0]},
          {"eye":[0,1,0],"forward":[0,-1,0],"up":[1,0,0],"fov":90},
          {"time":3,"eye":[0,1,0],"quaternion":[0,0,0,1]}])",
      "path.json", CameraAxes::opengl, kFps);
  ASSERT_EQ(path.poses.size(), 3U);
  EXPECT_LT((-path.poses[0].rotation.col(2) - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_LT((path.poses[0].rotation.col(1) - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_EQ(path.poses[1].time, 0.1);
  EXPECT_NEAR(path.poses[1].fovY.value(), std::acos(-1) / 2, 1e-12);
  EXPECT_LT((path.poses[1].rotation.col(1) - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_EQ(path.poses[2].time, 3);
  for (const CameraPose& pose : path.poses) EXPECT_NEAR(pose.rotation.determinant(), 1, 1e-12);
}

TEST(JsonPath, NerfstudiosTransformsGiveMatrixAndLens) {
  const CameraPath path = parseJsonPath(
      R"({"w":640,"h":480,"fl_x":500,"cx":300,"k1":0,"frames":[
          {"file_path":"a.png","transform_matrix":[[0,0,-1,1],[0,1,0,2],[1,0,0,3],[0,0,0,1]]},
          {"fl_x":250,"transform_matrix":[[1,0,0,1],[0,1,0,2],[0,0,1,3]]}]})",
      "transforms.json", CameraAxes::opengl, kFps);
  ASSERT_TRUE(path.lens);
  EXPECT_EQ(path.lens->width, 640);
  EXPECT_EQ(path.lens->pinhole.fx, 500);
  EXPECT_EQ(path.lens->pinhole.fy, 500);
  EXPECT_EQ(path.lens->pinhole.cx, 300);
  EXPECT_EQ(path.lens->pinhole.cy, 240);
  EXPECT_EQ(path.poses[0].eye, Vec3(1, 2, 3));
  EXPECT_EQ(-path.poses[0].rotation.col(2), Vec3(1, 0, 0));
  EXPECT_FALSE(path.poses[0].lens);
  ASSERT_TRUE(path.poses[1].lens);
  EXPECT_EQ(path.poses[1].lens->pinhole.fx, 250);
  EXPECT_EQ(path.poses[1].lens->pinhole.cx, 300);
}

TEST(JsonPath, BlendersAngleIsTheOpeningFromSideToSide) {
  const std::string frames = R"("frames":[{"transform_matrix":[[1,0,0,1],[0,1,0,2],[0,0,1,3]]}]})";
  const auto read = [&](const std::string& head) {
    return parseJsonPath("{" + head + "," + frames, "t.json", CameraAxes::opengl, kFps);
  };
  const CameraPath free = read(R"("camera_angle_x":1.2)");
  EXPECT_FALSE(free.lens);
  EXPECT_EQ(free.fovX, 1.2);
  const CameraPath sized = read(R"("camera_angle_x":1.2,"w":64,"h":48)");
  ASSERT_TRUE(sized.lens);
  EXPECT_NEAR(sized.lens->pinhole.fx, 46.7742, 1e-4);  // 32 / tan 0.6
  EXPECT_EQ(sized.lens->pinhole.fy, sized.lens->pinhole.fx);
  EXPECT_EQ(sized.lens->pinhole.cy, 24);
  EXPECT_TRUE(holds(catchJsonError(R"({"camera_angle_x":3.2,)" + frames), "between 0 and pi"));
}

TEST(JsonPath, ErrorsAreReportedWithTheirPlace) {
  EXPECT_TRUE(holds(catchJsonError("{"), "path.json: byte"));
  EXPECT_TRUE(holds(catchJsonError(R"([{"eye":[0,0,1e999],"look_at":[1,0,0]}])"),
                    "path.json: a number exceeds the range of a double"));
  EXPECT_TRUE(holds(catchJsonError("{}"), "list of poses"));
  EXPECT_TRUE(holds(catchJsonError("[]"), "0 poses"));
  EXPECT_TRUE(holds(catchJsonError("[7]"), "pose[0]: must be an object"));
  EXPECT_TRUE(
      holds(catchJsonError(R"([{"eye":[0,0,0],"look":[1,0,0]}])"), "\"look\" is not a key"));
  EXPECT_TRUE(holds(catchJsonError(R"([{"eye":[0,0],"look_at":[1,0,0]}])"), "pose[0].eye"));
  EXPECT_TRUE(holds(catchJsonError(R"([{"eye":[0,0,null],"look_at":[1,0,0]}])"), "pose[0].eye[2]"));
  EXPECT_TRUE(holds(catchJsonError(R"([{"eye":[0,0,0]}])"), "has no direction"));
  EXPECT_TRUE(
      holds(catchJsonError(R"([{"eye":[0,0,0],"look_at":[0,3,0]}])"), "zero or parallel to"));
  EXPECT_TRUE(
      holds(catchJsonError(R"([{"eye":[0,0,0],"look_at":[0,0,0]}])"), "zero or parallel to"));
  EXPECT_TRUE(holds(catchJsonError(R"([{"eye":[0,0,0],"quaternion":[0,0,0,2]}])"), "length is 2"));
  EXPECT_TRUE(
      holds(catchJsonError(R"({"frames":[{"transform_matrix":[[2,0,0,0],[0,2,0,0],[0,0,2,0]]}]})"),
            "frames[0].transform_matrix: its left 3x3"));
  EXPECT_TRUE(
      holds(catchJsonError(R"({"frames":[{"transform_matrix":[[-1,0,0,0],[0,1,0,0],[0,0,1,0]]}]})"),
            "is a reflection"));
  EXPECT_TRUE(holds(catchJsonError(R"({"k1":0.2,"frames":[{}]})"), "distortion"));
  EXPECT_TRUE(holds(catchJsonError(R"([{"time":1,"eye":[0,0,0],"look_at":[1,0,0]},
                                   {"time":1,"eye":[0,0,0],"look_at":[1,0,0]}])"),
                    "pose[1].time"));
}

}  // namespace
}  // namespace enfilade::server
