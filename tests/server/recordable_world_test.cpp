// Tests of recording a world: the file contains all commands and events of the world, and every
// flipped bit is detected.
#include "server/recording/recordable_world.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <random>

#include "tests/server/served_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

std::filesystem::path makeRecordingFile(const std::string& name) {
  return tests::makeOwnFile(name + ".mcap");
}

RecordingOptions makeRecordingOptions(const std::filesystem::path& file) {
  RecordingOptions options;
  options.choice.file = file;
  options.model.file = "room.obj";
  return options;
}

std::string readBytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Items as pairs of kind and bytes.
struct Items {
  std::vector<std::string> items;
  bool closed = false;
  std::string error;
};

Items readItems(const std::filesystem::path& file) {
  Items read;
  try {
    protocol::RecordingReader reader(file);
    while (const auto item = reader.next())
      read.items.push_back(
          std::to_string(item->index()) +
          std::visit([](const auto& message) { return message.SerializeAsString(); }, *item));
    read.closed = reader.closed();
  } catch (const protocol::mcap::RecordingError& error) {
    read.error = error.what();
  }
  return read;
}

/// Walks about in the small room, restarts, and closes.
void recordWalk(const std::filesystem::path& file) {
  RecordableWorld world{scene::World(makeSmallRoom())};
  world.record(makeRecordingOptions(file));
  world.submit(spawn("ann", 0, 0, 0));
  world.submit(walkTo("ann", 8, 0, 0));
  for (int i = 0; i < 60; ++i) world.tick();
  world.endContacts(v1::ContactEvent::REASON_RESTART, "again");
  world.reset(scene::World(makeSmallRoom()));
  world.submit(spawn("bob", 4, 0, 0));
  world.submit(walkTo("bob", 9, 0, 0));
  for (int i = 0; i < 60; ++i) world.tick();
  world.endContacts(v1::ContactEvent::REASON_SHUTDOWN);
  ASSERT_FALSE(world.recorder()->close());
}

TEST(RecordableWorld, TheFileHasAcceptedCommandsOnly) {
  const auto file = makeRecordingFile("taken");
  RecordableWorld world{scene::World(makeSmallRoom())};
  world.record(makeRecordingOptions(file));
  EXPECT_TRUE(world.submit(spawn("ann", std::nan(""), 0, 0)));
  EXPECT_FALSE(world.submit(spawn("ann", 0, 0, 0)));
  world.tick();
  ASSERT_FALSE(world.recorder()->close());
  protocol::RecordingReader reader(file);
  int commands = 0;
  while (const auto item = reader.next())
    if (const auto* taken = std::get_if<v1::RecordedCommands>(&*item)) {
      commands += taken->commands_size();
      EXPECT_EQ(taken->tick(), 1u);
      EXPECT_EQ(taken->commands(0).avatar().spawn().at().x(), 0);
    }
  EXPECT_EQ(commands, 1);
}

TEST(RecordableWorld, TheFileHasTheCommandsOfAFailedTick) {
  const auto file = makeRecordingFile("failed");
  RecordableWorld world{scene::World(makeSmallRoom())};
  world.record(makeRecordingOptions(file));
  world.tick();
  EXPECT_FALSE(world.submit(spawn("ann", 0, 0, 0)));
  world.recorder()->onTickFailed(world);
  protocol::RecordingReader reader(file);
  std::uint64_t tick = 0;
  while (const auto item = reader.next())
    if (const auto* commands = std::get_if<v1::RecordedCommands>(&*item)) tick = commands->tick();
  EXPECT_EQ(tick, 2u);
}

TEST(RecordableWorld, ARestartDropsPendingCommands) {
  const auto file = makeRecordingFile("void");
  RecordableWorld world{scene::World(makeSmallRoom())};
  world.record(makeRecordingOptions(file));
  world.tick();
  EXPECT_FALSE(world.submit(spawn("ann", 0, 0, 0)));
  world.reset(scene::World(makeSmallRoom()));
  world.tick();
  ASSERT_FALSE(world.recorder()->close());
  protocol::RecordingReader reader(file);
  while (const auto item = reader.next())
    EXPECT_FALSE(std::holds_alternative<v1::RecordedCommands>(*item));
}

/// ENFILADE_FLIPS sets a larger number of flips.
TEST(RecordableWorld, AFlippedBitIsReportedOrHarmless) {
  const auto file = makeRecordingFile("whole"), spoilt = makeRecordingFile("spoilt");
  recordWalk(file);
  const std::string bytes = readBytes(file);
  const Items whole = readItems(file);
  ASSERT_TRUE(whole.closed);
  ASSERT_GT(whole.items.size(), 120u);
  const char* asked = std::getenv("ENFILADE_FLIPS");
  const int flips = asked ? std::atoi(asked) : 600;
  std::mt19937 random(23);
  int reported = 0;
  for (int i = 0; i < flips; ++i) {
    std::string other = bytes;
    const std::size_t at = random() % bytes.size();
    other[at] = static_cast<char>(other[at] ^ (1 << (random() % 8)));
    std::ofstream(spoilt, std::ios::binary) << other;
    const Items read = readItems(spoilt);
    const bool failed = !read.error.empty() || !read.closed;
    reported += failed;
    ASSERT_LE(read.items.size(), whole.items.size()) << "byte " << at;
    ASSERT_TRUE(std::equal(read.items.begin(), read.items.end(), whole.items.begin()))
        << "byte " << at;
    ASSERT_TRUE(failed || read.items.size() == whole.items.size()) << "byte " << at;
  }
  EXPECT_GE(reported, flips * 99 / 100);
  RecordProperty("reported", reported);
  RecordProperty("flips", flips);
}

TEST(RecordableWorld, WithoutARecorderItIsTheSameWorld) {
  RecordableWorld bare{scene::World(makeSmallRoom())}, recorded{scene::World(makeSmallRoom())};
  recorded.record(makeRecordingOptions(makeRecordingFile("same")));
  for (RecordableWorld* world : {&bare, &recorded}) {
    world->submit(spawn("ann", 0, 0, 0));
    world->submit(walkTo("ann", 8, 0, 0));
    for (int i = 0; i < 100; ++i) world->tick();
  }
  EXPECT_EQ(bare.snapshot()->stateHash, recorded.snapshot()->stateHash);
}

}  // namespace
}  // namespace enfilade::server::testing
