// Tests of recording messages, and of the first difference between two states.
#include "protocol/recording/recording.hpp"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace enfilade::protocol {
namespace {

v1::State makeState(std::uint64_t tick) {
  v1::State state;
  state.set_tick(tick);
  state.set_time(static_cast<double>(tick) / 60);
  state.set_hash(0x1234);
  v1::AvatarState& ann = *state.add_avatars();
  ann.set_name("ann");
  ann.mutable_feet()->set_x(1.5);
  v1::BodyState& door = *state.add_bodies();
  door.set_name("door");
  door.set_coordinate(0.25);
  return state;
}

TEST(Recording, ReturnsItsMessagesInOrder) {
  const auto file = tests::makeOwnFile("messages.mcap");
  v1::RecordingStart start;
  start.set_scene_file("/models/house.glb");
  v1::RecordedCommands commands;
  commands.set_tick(1);
  commands.add_commands()->mutable_avatar()->set_avatar("ann");
  v1::TickEvents events;
  events.set_tick(1);
  {
    RecordingWriter writer(file, "recording_test");
    writer.write(start);
    writer.write(commands, 0);
    writer.write(events);
    writer.write(makeState(1));
    writer.close();
  }
  RecordingReader reader(file);
  const auto serializeItem = [](const RecordedItem& item) {
    return std::visit([](const auto& message) { return message.SerializeAsString(); }, item);
  };
  std::vector<std::string> read;
  while (const auto item = reader.next())
    read.push_back(std::to_string(item->index()) + serializeItem(*item));
  EXPECT_EQ(read, (std::vector<std::string>{
                      "0" + start.SerializeAsString(), "1" + commands.SerializeAsString(),
                      "2" + events.SerializeAsString(), "3" + makeState(1).SerializeAsString()}));
  EXPECT_TRUE(reader.closed());
}

TEST(Recording, EqualStatesDoNotDiffer) {
  EXPECT_FALSE(findFirstDifference(makeState(3), makeState(3)));
}

TEST(Recording, ADifferenceNamesEntityFieldAndBothValues) {
  v1::State other = makeState(3);
  other.mutable_avatars(0)->mutable_feet()->set_x(1.5000000000000002);
  other.mutable_bodies(0)->set_coordinate(0.5);
  auto found = findFirstDifference(makeState(3), other);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->entity, "ann");
  EXPECT_EQ(found->field, "feet.x");
  EXPECT_EQ(found->recorded, "1.5");
  EXPECT_EQ(found->replayed, "1.5000000000000002");
  other.mutable_avatars(0)->mutable_feet()->set_x(1.5);
  found = findFirstDifference(makeState(3), other);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->entity + " " + found->field + " " + found->recorded + " " + found->replayed,
            "door coordinate 0.25 0.5");
}

TEST(Recording, AMissingEntityIsNamed) {
  v1::State other = makeState(3);
  other.clear_avatars();
  const auto found = findFirstDifference(makeState(3), other);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->entity, "ann");
  EXPECT_EQ(found->replayed, "absent");
}

TEST(Recording, ADifferenceOfTheHashAloneIsReported) {
  v1::State other = makeState(3);
  other.set_hash(0x1235);
  const auto found = findFirstDifference(makeState(3), other);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->field, "state hash");
  EXPECT_EQ(found->recorded, "0000000000001234");
  EXPECT_EQ(found->replayed, "0000000000001235");
}

}  // namespace
}  // namespace enfilade::protocol
