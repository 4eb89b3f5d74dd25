// Tests of `enfilade doctor`: the self-test image, EGL's vendor files and calls in a child process.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "server/commands/child_call.hpp"
#include "server/commands/egl_vendors.hpp"
#include "server/commands/self_test_scene.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server {
namespace {

TEST(Doctor, TheProofPictureIsTheGoldenOneAtEverySize) {
  render::GlRenderer renderer(makeSelfTestScene());
  EXPECT_EQ(validateSelfTestFrame(renderer.render({}, makeSelfTestCamera(640, 480))), "");
  EXPECT_EQ(validateSelfTestFrame(renderer.render({}, makeSelfTestCamera(320, 240))), "");
}

TEST(Doctor, RaysProveIdsAndDepthOfTheGoldenPicture) {
  render::RayRenderer rays(makeSelfTestScene());
  const std::string problem = validateSelfTestFrame(rays.render({}, makeSelfTestCamera(640, 480)));
  EXPECT_EQ(problem.find("ids"), std::string::npos) << problem;
  EXPECT_EQ(problem.find("depth"), std::string::npos) << problem;
}

TEST(Doctor, AWrongPictureIsFound) {
  render::GlRenderer renderer(makeSelfTestScene());
  const render::Frame right = renderer.render({}, makeSelfTestCamera(320, 240));
  render::Frame frame = right;
  for (std::size_t i = 0; i < frame.rgb.size(); i += 3) std::swap(frame.rgb[i], frame.rgb[i + 2]);
  EXPECT_NE(validateSelfTestFrame(frame).find("colour"), std::string::npos);
  frame = right;
  std::reverse(frame.ids.begin(), frame.ids.end());
  EXPECT_NE(validateSelfTestFrame(frame).find("ids"), std::string::npos);
  frame = right;
  for (float& depth : frame.depth) depth *= 1.01f;
  EXPECT_NE(validateSelfTestFrame(frame).find("depth"), std::string::npos);
}

TEST(Doctor, VendorFilesAreReadAndMissingFieldsReported) {
  const tests::TemporaryFolder folder;
  folder.write("a.json", R"({"ICD":{"library_path":"libc.so.6"}})");
  folder.write("b.json", R"({"ICD":{"library_path":"libEGL_missing.so.0"}})");
  folder.write("c.json", "{");
  ::setenv("__EGL_VENDOR_LIBRARY_DIRS", folder.getPath().c_str(), 1);
  const std::vector<EglVendor> vendors = listEglVendors();
  ::unsetenv("__EGL_VENDOR_LIBRARY_DIRS");
  ASSERT_EQ(vendors.size(), 3u);
  EXPECT_EQ(vendors[0].failure, "");
  EXPECT_NE(vendors[1].failure.find("libEGL_missing"), std::string::npos);
  EXPECT_EQ(vendors[1].library, "libEGL_missing.so.0");
  EXPECT_NE(vendors[2].failure, "");
}

TEST(ChildCall, AnswersWithWhatTheChildSentAlsoBeforeACrash) {
  const std::string big(1 << 20, 'a');
  const ChildAnswer whole = callInChild([&](const Send& send) {
    send("first ");
    send(big);
  });
  EXPECT_EQ(whole.failure, "");
  EXPECT_TRUE(whole.text == "first " + big);
  const ChildAnswer crashed = callInChild([](const Send& send) {
    send("before");
    std::abort();
  });
  EXPECT_EQ(crashed.failure, "crashed (Aborted)");
  EXPECT_EQ(crashed.text, "before");
  const ChildAnswer thrown =
      callInChild([](const Send&) { throw std::runtime_error("an error of the child"); });
  EXPECT_EQ(thrown.failure, "failed");
  EXPECT_EQ(thrown.text, "an error of the child");
}

TEST(ChildCall, KillsAChildThatHangs) {
  const ChildAnswer answer = callInChild(
      [](const Send& send) {
        send("before");
        for (;;) pause();
      },
      std::chrono::seconds(1));
  EXPECT_EQ(answer.failure, "did not answer within 1 s");
  EXPECT_EQ(answer.text, "before");
}

TEST(ChildCall, AnswersAlsoIfTheParentIgnoredTheEndsOfChildren) {
  std::signal(SIGCHLD, SIG_IGN);
  EXPECT_EQ(callInChild([](const Send& send) { send("text"); }).text, "text");
}

}  // namespace
}  // namespace enfilade::server
