#include "render/gl/egl_context.hpp"

#include <gtest/gtest.h>

#include <array>
#include <barrier>
#include <thread>
#include <vector>

namespace enfilade::render {
namespace {

TEST(EglContext, ThreadsThatBeginTogetherEachHaveOne) {
  constexpr std::size_t kThreads = 8;
  std::array<std::string, kThreads> names;
  std::barrier start(kThreads);
  std::vector<std::thread> threads;
  for (std::string& name : names) {
    threads.emplace_back([&] {
      start.arrive_and_wait();
      const EglContext first, second;
      first.makeCurrent();
      second.makeCurrent();
      if (first.deviceName() == second.deviceName()) name = first.deviceName();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_NE(names[0], "");
  for (const std::string& name : names) EXPECT_EQ(name, names[0]);
}

TEST(EglContext, DevicesAreTriedWhileOthersAreInUse) {
  std::array<std::size_t, 4> found{};
  std::barrier start(found.size());
  std::vector<std::thread> threads;
  for (std::size_t& count : found) {
    threads.emplace_back([&] {
      start.arrive_and_wait();
      const EglContext used;
      for (std::size_t i = 0; i < listDevices().count; ++i) count += probeDevice(i).failure.empty();
      used.makeCurrent();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(found[0], 1u);
  for (const std::size_t count : found) EXPECT_EQ(count, found[0]);
}

}  // namespace
}  // namespace enfilade::render
