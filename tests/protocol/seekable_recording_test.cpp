// Tests of recordings with random access: results equal those of a sequential reader, without
// reading the whole file.
#include "protocol/recording/seekable_recording.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace enfilade::protocol {
namespace {

constexpr double kTick = 1.0 / 60;

struct WrittenRecording {
  std::filesystem::path file;
  std::vector<std::uint64_t> checkpoints;  ///< ticks
};

v1::State makeBulkyState(std::uint64_t tick) {
  v1::State state;
  state.set_tick(tick);
  state.set_time(static_cast<double>(tick) * kTick);
  state.set_hash(tick * 0x9E3779B97F4A7C15u);
  for (int i = 0; i < 5; ++i) {  // some bytes that do not compress well
    state.add_avatars()->mutable_feet()->set_x(1 / static_cast<double>(tick * 7 + i + 1));
  }
  return state;
}

void writeTick(RecordingWriter& writer, std::uint64_t tick, bool checkpoint) {
  if (tick % 3 == 0) {
    v1::RecordedCommands commands;
    commands.set_tick(tick);
    commands.add_commands()->mutable_avatar()->set_avatar("ann");
    writer.write(commands, static_cast<double>(tick) * kTick);
  }
  writer.write(makeBulkyState(tick));
  if (!checkpoint) return;
  v1::RecordedCheckpoint record;
  record.set_tick(tick);
  record.set_world("world after " + std::to_string(tick));
  writer.write(record, static_cast<double>(tick) * kTick);
}

/// Writes one run. `first`: first tick of a branch; 0: no branch. Returns the ticks of its
/// checkpoints.
std::vector<std::uint64_t> writeRun(RecordingWriter& writer, std::uint64_t first,
                                    std::uint64_t last) {
  std::vector<std::uint64_t> checkpoints;
  v1::RecordingStart start;
  start.mutable_lengths()->set_tick(kTick);
  if (first > 0) start.mutable_parent()->set_tick(first);
  writer.write(start, static_cast<double>(first) * kTick);
  if (first > 0) {
    v1::RecordedCheckpoint begins;
    begins.set_tick(first);
    writer.write(begins, static_cast<double>(first) * kTick);
    checkpoints.push_back(first);
  }
  for (std::uint64_t tick = first + 1; tick <= last; ++tick) {
    const bool checkpoint = tick % 500 == 0;
    writeTick(writer, tick, checkpoint);
    if (checkpoint) checkpoints.push_back(tick);
  }
  return checkpoints;
}

WrittenRecording writeRecording(const std::string& name, std::uint64_t first, std::uint64_t last,
                                bool close) {
  WrittenRecording written{tests::makeOwnFile(name + ".mcap"), {}};
  RecordingWriter writer(written.file, "test");
  written.checkpoints = writeRun(writer, first, last);
  if (close) {
    writer.close();
    return written;
  }
  // As after a kill: everything except the records that closing adds.
  const auto size = writer.bytesWritten();
  writer.close();
  std::filesystem::resize_file(written.file, size);
  return written;
}

void expectSeeks(const WrittenRecording& written, std::uint64_t first, std::uint64_t last,
                 std::uint32_t run = 1) {
  SeekableRecording recording(written.file, run);
  EXPECT_EQ(recording.firstTick(), first);
  ASSERT_EQ(recording.lastTick(), last);
  for (std::uint64_t tick = last; tick >= first && tick <= last; tick -= 137) {
    std::optional<std::uint64_t> expected;
    for (const std::uint64_t checkpoint : written.checkpoints)
      if (checkpoint <= tick) expected = checkpoint;
    const auto found = recording.checkpointBefore(tick);
    ASSERT_EQ(found.has_value(), expected.has_value()) << tick;
    if (found) {
      EXPECT_EQ(found->tick(), *expected);
    }
    recording.seek(tick);
    for (std::uint64_t next = tick + 1; next <= std::min(tick + 30, last); ++next) {
      auto item = recording.next();
      if (next % 3 == 0) {
        ASSERT_TRUE(item && std::holds_alternative<v1::RecordedCommands>(*item)) << next;
        EXPECT_EQ(std::get<v1::RecordedCommands>(*item).tick(), next);
        item = recording.next();
      }
      ASSERT_TRUE(item && std::holds_alternative<v1::State>(*item)) << next;
      EXPECT_EQ(std::get<v1::State>(*item).tick(), next);
    }
    if (tick < first + 137) break;
  }
  recording.seek(last);
  EXPECT_FALSE(recording.next());
}

TEST(SeekableRecording, ResumesAfterAnyTickFromTheCheckpointBeforeIt) {
  expectSeeks(writeRecording("seek", 0, 3000, true), 0, 3000);
}

TEST(SeekableRecording, ABranchBeginsWhereItLeftItsParent) {
  expectSeeks(writeRecording("seek_branch", 777, 2000, true), 777, 2000);
}

/// One short run after another, as tests of agents record them.
TEST(SeekableRecording, EachRunOfAFileIsReadAloneFromAnyTickOn) {
  const std::vector<std::uint64_t> lasts{1700, 3, 1, 2, 1200};
  const auto file = tests::makeOwnFile("runs.mcap");
  std::vector<WrittenRecording> runs;
  {
    RecordingWriter writer(file, "test");
    for (const std::uint64_t last : lasts) runs.push_back({file, writeRun(writer, 0, last)});
    writer.close();
  }
  for (std::uint32_t run = 1; run <= lasts.size(); ++run) {
    SCOPED_TRACE(run);
    const std::uint64_t last = lasts[run - 1];
    expectSeeks(runs[run - 1], 0, last, run);
    RecordingReader reader(file, run);
    std::uint64_t starts = 0, states = 0;
    while (const auto item = reader.next()) {
      starts += std::holds_alternative<v1::RecordingStart>(*item);
      if (const auto* state = std::get_if<v1::State>(&*item)) {
        EXPECT_EQ(state->tick(), ++states);
      }
    }
    EXPECT_EQ(starts, 1u);
    EXPECT_EQ(states, last);
    EXPECT_TRUE(reader.closed());
  }
  try {
    SeekableRecording(file, 6);
    ADD_FAILURE() << "there are five";
  } catch (const mcap::RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("no run 6 in it; give a run from 1 to 5"),
              std::string::npos)
        << error.what();
  }
  RecordingReader beyond(file, 6);
  EXPECT_THROW(while (beyond.next());, mcap::RecordingError);
}

TEST(SeekableRecording, WithoutASummaryTheChunksAreFoundByTheirHeads) {
  const WrittenRecording written = writeRecording("seek_killed", 0, 3000, false);
  SeekableRecording recording(written.file);
  EXPECT_FALSE(recording.closed());
  const std::uint64_t last = recording.lastTick();
  EXPECT_GE(last, 2500u);
  expectSeeks(written, 0, last);
}

TEST(SeekableRecording, AFileThatWasCutAnywhereIsReadAsFarAsItIsWhole) {
  const WrittenRecording written = writeRecording("seek_cut", 0, 1200, true);
  const auto whole = std::filesystem::file_size(written.file);
  std::uint64_t before = 0;
  for (std::uint64_t size = whole / 3; size < whole; size += whole / 40) {
    const auto cut = written.file.string() + ".cut";
    std::filesystem::copy_file(written.file, cut,
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(cut, size);
    SeekableRecording recording(cut);
    EXPECT_GE(recording.lastTick(), before);
    before = recording.lastTick();
    recording.seek(0);
    std::uint64_t states = 0;
    while (const auto item = recording.next()) states += std::holds_alternative<v1::State>(*item);
    EXPECT_EQ(states, recording.lastTick());
  }
  EXPECT_GT(before, 400u);
}

TEST(SeekableRecording, AFlippedBitInReadDataIsReported) {
  const WrittenRecording written = writeRecording("seek_flip", 0, 600, true);
  std::ifstream stream(written.file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const auto read = [&](const std::string& content) {
    std::string text;
    const auto file = written.file.string() + ".flipped";
    std::ofstream(file, std::ios::binary)
        .write(content.data(), static_cast<std::streamsize>(content.size()));
    SeekableRecording recording(file);
    if (!recording.closed()) return std::string("not closed");
    if (const auto found = recording.checkpointBefore(600)) text += found->SerializeAsString();
    recording.seek(0);
    while (const auto item = recording.next())
      text += std::visit([](const auto& message) { return message.SerializeAsString(); }, *item);
    return text;
  };
  const std::string right = read(bytes);
  int reported = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    std::string flipped = bytes;
    const std::size_t at = (i * 7919 * 31) % bytes.size();
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (i % 8)));
    try {
      const std::string text = read(flipped);
      // The header and the end of the data are not checked; nothing else may pass.
      if (text != "not closed") {
        EXPECT_EQ(text, right) << at;
      }
      reported += text == "not closed";
    } catch (const mcap::RecordingError&) {
      ++reported;
    }
  }
  EXPECT_GT(reported, 250);
}

}  // namespace
}  // namespace enfilade::protocol
