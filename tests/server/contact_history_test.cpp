// Tests of the events that the timeline of a recording shows.
#include "server/recording/contact_history.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/recording/recordable_world.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

using Event = v1::ContactEvent;

/// Records one avatar that passes the column slowly twice, and one that walks into the wall often.
void recordPassing(const std::filesystem::path& file) {
  scene::WorldSettings settings;
  settings.nearMissDistance = 2;
  RecordableWorld world{scene::World(makeSmallRoom(), settings)};
  RecordingOptions options;
  options.choice.file = file;
  options.model.file = "room.obj";
  world.record(options);
  world.submit(spawn("ann", -4, 0, 5));
  world.submit(spawn("bob", 4, 0, 0));
  world.submit(walkTo("ann", 3.5, 0, 5));
  world.submit(walkTo("ann", -4, 0, 4.9));
  for (int i = 0; i < 12; ++i) {
    world.submit(walkTo("bob", 8, 0, 0));
    world.submit(walkTo("bob", 4.4, 0, 0));
  }
  for (int tick = 0; tick < 1200; ++tick) world.tick();
  EXPECT_FALSE(world.recorder()->close());
}

TEST(ContactHistory, EventsOfATimelineAscendAndPagesLoseNone) {
  const tests::TemporaryFolder folder;
  const auto file = folder.getPath() / "passing.mcap";
  recordPassing(file);
  const ContactHistory history(file);
  const v1::RecordedEvents all = history.findEventsAfter(0, 1 << 20);
  EXPECT_TRUE(std::ranges::is_sorted(all.contacts(), {}, &Event::tick));
  EXPECT_GE(std::ranges::count(all.contacts(), Event::PHASE_MIN, &Event::phase), 2);
  EXPECT_GE(std::ranges::count(all.contacts(), Event::KIND_BLOCKED, &Event::kind), 1);
  const std::size_t bytesOfAbout2 = 2 * all.contacts(0).ByteSizeLong() + 32;
  std::vector<std::string> paged;
  std::uint64_t after = 0;
  for (int page = 0; page < all.contacts_size() + 1; ++page) {
    const v1::RecordedEvents reply = history.findEventsAfter(after, bytesOfAbout2);
    EXPECT_LE(reply.ByteSizeLong(), bytesOfAbout2 + 16);
    for (const Event& event : reply.contacts()) paged.push_back(event.ShortDebugString());
    if (reply.complete_to() == all.complete_to()) break;
    ASSERT_GT(reply.complete_to(), after);
    after = reply.complete_to();
  }
  std::vector<std::string> wanted;
  for (const Event& event : all.contacts()) wanted.push_back(event.ShortDebugString());
  EXPECT_EQ(paged, wanted);
}

}  // namespace
}  // namespace enfilade::server::testing
