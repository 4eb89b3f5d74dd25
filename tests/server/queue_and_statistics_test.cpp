// Tests of parts of the server that need no socket.
#include <gtest/gtest.h>

#include <random>

#include "server/base/host_port.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/messages/tick_statistics.hpp"

namespace enfilade::server::testing {
namespace {

Buffer bytes(std::size_t count) {
  return std::make_shared<const std::vector<std::uint8_t>>(count);
}

TEST(OutgoingQueues, ShareABudgetAndGiveItBack) {
  const auto message = [](std::size_t bytes) {
    return std::make_shared<const std::vector<std::uint8_t>>(bytes);
  };
  OutgoingLimits limits{1000, 2};
  limits.budget = std::make_shared<OutgoingBudget>(1500);
  const Buffer tooSlow = message(1);
  OutgoingQueue second(limits, tooSlow, [] {});
  {
    OutgoingQueue first(limits, tooSlow, [] {});
    first.push(message(900));
    second.push(message(500));
    EXPECT_EQ(limits.budget->bytes, 1400u);
    EXPECT_FALSE(second.overflowed());
    second.push(message(200));
    EXPECT_TRUE(second.overflowed()) << "1600 bytes of both";
    EXPECT_FALSE(first.overflowed());
    EXPECT_EQ(limits.budget->bytes, 900u);
    first.push(message(100));
    EXPECT_EQ(first.pop().message.size(), 900u);
    EXPECT_EQ(limits.budget->bytes, 100u);
  }
  EXPECT_EQ(limits.budget->bytes, 0u);
  EXPECT_EQ(second.pop().message.size(), 1u);
}

TEST(OutgoingQueue, KeepsRepliesInOrderAndOnlyTheLatestState) {
  int woken = 0;
  OutgoingQueue queue({1000, 2}, bytes(1), [&] { ++woken; });
  queue.push(bytes(10));
  queue.pushLatest(bytes(20));
  EXPECT_TRUE(queue.dropLatest());
  EXPECT_FALSE(queue.dropLatest());
  queue.pushLatest(bytes(21));
  queue.push(bytes(11));
  EXPECT_EQ(queue.pop().message.size(), 10u);
  EXPECT_EQ(queue.pop().message.size(), 21u);
  EXPECT_EQ(queue.pop().message.size(), 11u);
  EXPECT_FALSE(queue.pop().message);
  EXPECT_EQ(woken, 4);
}

TEST(OutgoingQueue, AboveItsBoundOnlyTheFinalMessageIsLeft) {
  OutgoingQueue queue({100, 2}, bytes(7), [] {});
  queue.push({bytes(10), bytes(50)});
  queue.push(bytes(40));
  EXPECT_FALSE(queue.overflowed());
  EXPECT_EQ(queue.pop().message.size(), 60u);
  queue.push(bytes(61));
  EXPECT_TRUE(queue.overflowed());
  const OutgoingQueue::Next next = queue.pop();
  EXPECT_EQ(next.message.size(), 7u);
  EXPECT_TRUE(next.last);
  queue.push(bytes(1));
  EXPECT_FALSE(queue.pop().message) << "nothing is said after the last words";
}

TEST(OutgoingQueue, CountsBothPiecesOfPictures) {
  OutgoingQueue queue({100, 9, 150}, bytes(7), [] {});
  queue.pushFrame({bytes(1), bytes(100)});
  EXPECT_FALSE(queue.overflowed());
  queue.pushFrame({bytes(1), bytes(100)});
  EXPECT_TRUE(queue.overflowed());
}

TEST(OutgoingQueue, CountsPicturesAndNotTheirBytes) {
  OutgoingQueue queue({100, 2}, bytes(7), [] {});
  queue.pushFrame(bytes(5000));
  queue.pushFrame(bytes(5000));
  EXPECT_FALSE(queue.overflowed());
  queue.pop();
  queue.pushFrame(bytes(5000));
  EXPECT_FALSE(queue.overflowed());
  queue.pushFrame(bytes(5000));
  EXPECT_TRUE(queue.overflowed());
}

TEST(OutgoingQueue, FinishingSendsPendingMessagesFirst) {
  OutgoingQueue queue({100, 2}, bytes(7), [] {});
  queue.push(bytes(1));
  queue.finish(bytes(2));
  queue.finish(bytes(3));
  EXPECT_FALSE(queue.pop().last);
  const OutgoingQueue::Next next = queue.pop();
  EXPECT_EQ(next.message.size(), 2u);
  EXPECT_TRUE(next.last);
  EXPECT_FALSE(queue.pop().message);
}

TEST(DurationHistogram, AgreesWithSortingWithinABucket) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> durations(-10, 1.5);
  DurationHistogram histogram;
  std::vector<double> all;
  for (int i = 0; i < 5000; ++i) {
    all.push_back(durations(random));
    histogram.record(all.back());
  }
  std::sort(all.begin(), all.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99}) {
    const double exact = all[static_cast<std::size_t>(fraction * 4999)];
    EXPECT_NEAR(histogram.quantile(fraction) / exact, 1, 0.011) << fraction;
  }
  EXPECT_EQ(histogram.max(), all.back());
  EXPECT_EQ(DurationHistogram{}.quantile(0.5), 0);
}

TEST(CommandLine, EndpointsAreHostAndPort) {
  EXPECT_EQ(parseHostPort("127.0.0.1:7878")->port, 7878);
  EXPECT_EQ(parseHostPort("[::1]:0")->host, "::1");
  EXPECT_EQ(parseHostPort("localhost:65535")->host, "localhost");
  for (const char* bad : {"", ":", "host", "host:", ":1", "host:x", "host:65536", "host:-1", "::1",
                          "host:1 ", "[]:1", "host:1:2"}) {
    EXPECT_FALSE(parseHostPort(bad)) << bad;
  }
}

}  // namespace
}  // namespace enfilade::server::testing
