// Tests of runs that SIGINT and SIGTERM end.
#include "server/base/signal_handling.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <thread>

namespace enfilade::server::testing {
namespace {

/// The kernel may run the handler in any thread; ThreadSanitizer checks the flag that it sets.
TEST(SignalHandling, AnySignalInAnyThreadEndsARun) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // the run has a thread of its own
  for (const int signal : {SIGINT, SIGTERM}) {
    const auto run = [&] {
      std::thread thread;
      const ExitCode code = runInterruptible(
          [&]() -> ExitCode {
            thread = std::thread([&] { std::raise(signal); });
            while (!isInterrupted()) std::this_thread::yield();
            throw Interrupted{};
          },
          "run it again");
      thread.join();
      std::exit(static_cast<int>(code));
    };
    EXPECT_EXIT(run(), ::testing::ExitedWithCode(130), "interrupted; run it again");
  }
}

}  // namespace
}  // namespace enfilade::server::testing
