// Fuzz target of recordings with arbitrary messages: a sequence of items, each preceded by its kind
// (a byte) and its length (two bytes, little-endian). They follow the true start of a small room's
// recording, and are read as `diff`, `--verify` and a seek read them.
#include <spdlog/spdlog.h>

#include "protocol/framing.hpp"
#include "scene/world/checkpoint/checkpoint.hpp"
#include "server/diff/recorded_walk.hpp"
#include "server/recording/playback.hpp"
#include "server/recording/recordable_world.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/server/body_room.hpp"

namespace enfilade::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;
using protocol::RecordingWriter;
using protocol::mcap::RecordingError;

constexpr std::size_t kMaxItems = 64;  // of one input, so that a finding is small
constexpr std::uint64_t kMaxTicks = 64;

std::shared_ptr<const scene::Scene> getRoom() {
  spdlog::set_level(spdlog::level::off);
  static const std::shared_ptr<const scene::Scene> one = server::testing::makeBodyRoom();
  return one;
}

/// The start of the room's recording.
v1::RecordingStart makeTrueStart() {
  const MemoryFile file;
  server::RecordingOptions options;
  options.choice.file = file.getPath();
  options.model.file = "room.obj";
  server::RecordableWorld world{scene::World(getRoom())};
  world.record(options);
  world.tick();
  world.recorder()->close();
  return protocol::SeekableRecording(file.getPath()).start();
}

template <class Message>
Message parseMessage(Bytes bytes) {
  Message message;
  message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  return message;
}

void writeItem(RecordingWriter& file, std::uint8_t kind, Bytes bytes, double time) {
  switch (kind % 6) {
    case 0: {
      static const v1::RecordingStart start = makeTrueStart();
      v1::RecordingStart changed = start;
      changed.MergeFrom(parseMessage<v1::RecordingStart>(bytes));
      return file.write(changed, time);
    }
    case 1:
      return file.write(parseMessage<v1::RecordedCommands>(bytes), time);
    case 2:
      return file.write(parseMessage<v1::TickEvents>(bytes));
    case 3:
      return file.write(parseMessage<v1::State>(bytes));
    case 4:
      return file.write(parseMessage<v1::RecordedNames>(bytes));
    default:
      file.write(parseMessage<v1::RecordedCheckpoint>(bytes), time);
  }
}

void writeItems(const std::filesystem::path& path, Bytes bytes) {
  constexpr std::size_t kHead = 3;
  RecordingWriter file(path, "fuzz");
  writeItem(file, 0, {}, 0);
  for (std::size_t count = 0; bytes.size() >= kHead && count < kMaxItems; ++count) {
    const std::uint8_t kind = bytes[0];
    const std::size_t length = bytes[1] | static_cast<std::size_t>(bytes[2]) << 8;
    bytes = bytes.subspan(kHead);
    const Bytes part = bytes.first(std::min(length, bytes.size()));
    bytes = bytes.subspan(part.size());
    writeItem(file, kind, part, static_cast<double>(count) / 60);
  }
  file.close();
}

template <class Work>
void readBy(const Work& work) {
  try {
    work();
  } catch (const RecordingError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  } catch (const scene::CheckpointError&) {
  } catch (const server::Divergence& diverged) {
    require(!server::formatDivergence(diverged).empty(), "a divergence has a text");
  }
}

}  // namespace

void tryBytes(Bytes bytes) {
  const MemoryFile file;
  try {
    writeItems(file.getPath(), bytes);
  } catch (const RecordingError&) {
    return;  // times that no file can have
  }
  readBy([&] { server::readWalk(file.getPath()); });
  readBy([&] {
    server::Playback playback(file.getPath());
    scene::World world = playback.restoreWorldAfter(playback.firstTick(), getRoom());
    for (std::uint64_t i = 0; i < kMaxTicks && playback.step(world); ++i) continue;
  });
  readBy([&] {
    server::Playback playback(file.getPath());
    if (playback.lastTick() - playback.firstTick() < kMaxTicks)
      playback.restoreWorldAfter(playback.lastTick(), getRoom());
  });
}

}  // namespace enfilade::fuzz
