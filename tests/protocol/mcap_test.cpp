// Tests of MCAP files: written items are read back, and every flipped bit is detected. A truncated
// file is read up to its last whole chunk.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <random>

#include "protocol/mcap/reader.hpp"
#include "protocol/mcap/writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::protocol::mcap {
namespace {

using Item = std::pair<std::uint64_t, std::string>;  // time and data

std::filesystem::path makeFileName(const std::string& name) {
  return tests::makeOwnFile(name + ".mcap");
}

std::vector<Item> makeItems(std::size_t count) {
  std::vector<Item> items;
  std::mt19937 random(7);
  for (std::size_t i = 0; i < count; ++i) {
    std::string data(random() % 90, '\0');
    for (char& c : data) c = static_cast<char>(random() % 7);
    items.emplace_back(1000 * i, std::move(data));
  }
  return items;
}

/// Many small chunks, so that a short file has all features of a long one.
WriterOptions makeSmallChunks() {
  return {"mcap_test", 700, std::chrono::hours(1)};
}

void writeAll(Writer& writer, const std::vector<Item>& items) {
  const auto odd = writer.addChannel({"/odd", "raw", "Odd", "text", "odd ones"});
  const auto even = writer.addChannel({"/even", "raw", "Even", "text", "even ones"});
  for (std::size_t i = 0; i < items.size(); ++i)
    writer.write(i % 2 != 0 ? odd : even, items[i].first, items[i].second);
}

std::string readBytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void put(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string makeClosedFile(const std::vector<Item>& items) {
  const auto file = makeFileName("closed");
  Writer writer(file, makeSmallChunks());
  writeAll(writer, items);
  writer.close();
  return readBytes(file);
}

struct Read {
  std::vector<Item> items;
  bool closed = false;
  std::uint64_t whole = 0;
  std::string error;
};

Read readAll(const std::filesystem::path& file) {
  Read read;
  try {
    Reader reader(file);
    while (const auto message = reader.next())
      read.items.emplace_back(message->time, std::string(message->data));
    read.closed = reader.closed();
    read.whole = reader.wholeBytes();
  } catch (const RecordingError& error) {
    read.error = error.what();
  }
  return read;
}

bool isPrefix(const std::vector<Item>& part, const std::vector<Item>& whole) {
  return part.size() <= whole.size() && std::equal(part.begin(), part.end(), whole.begin());
}

TEST(Mcap, ReadsMessagesInTheirWrittenOrder) {
  const auto items = makeItems(500);
  const auto file = makeFileName("back");
  put(file, makeClosedFile(items));
  const Read read = readAll(file);
  EXPECT_EQ(read.error, "");
  EXPECT_TRUE(read.closed);
  EXPECT_EQ(read.items, items);
  EXPECT_EQ(read.whole, std::filesystem::file_size(file));
}

TEST(Mcap, ReportsChannelsSequencesAndTheWriter) {
  const auto file = makeFileName("channels");
  put(file, makeClosedFile(makeItems(4)));
  Reader reader(file);
  EXPECT_EQ(reader.library(), "mcap_test");
  std::vector<std::string> texts;
  while (const auto message = reader.next())
    texts.push_back(message->channel->topic + " " + message->channel->schemaName + " " +
                    std::to_string(message->sequence));
  EXPECT_EQ(texts,
            (std::vector<std::string>{"/even Even 1", "/odd Odd 1", "/even Even 2", "/odd Odd 2"}));
}

TEST(Mcap, AFileWithoutMessagesIsValid) {
  const auto file = makeFileName("nothing");
  put(file, makeClosedFile({}));
  const Read read = readAll(file);
  EXPECT_EQ(read.error, "");
  EXPECT_TRUE(read.closed);
  EXPECT_TRUE(read.items.empty());
}

TEST(Mcap, ATruncatedFileIsReadUpToTheLastCompleteChunk) {
  const auto items = makeItems(200);
  const std::string bytes = makeClosedFile(items);
  const auto file = makeFileName("cut");
  std::mt19937 random(11);
  std::size_t maxItems = 0;
  for (int i = 0; i < 300; ++i) {
    const std::size_t length = 40 + random() % (bytes.size() - 40);
    put(file, bytes.substr(0, length));
    const Read read = readAll(file);
    ASSERT_EQ(read.error, "") << "cut after " << length;
    ASSERT_FALSE(read.closed);
    ASSERT_LE(read.whole, length);
    ASSERT_TRUE(isPrefix(read.items, items)) << "cut after " << length;
    maxItems = std::max(maxItems, read.items.size());
  }
  EXPECT_GT(maxItems, items.size() / 2);
}

TEST(Mcap, AFlippedBitIsReported) {
  const auto items = makeItems(60);
  const std::string bytes = makeClosedFile(items);
  const auto file = makeFileName("flip");
  std::mt19937 random(13);
  for (int i = 0; i < 2500; ++i) {
    std::string spoilt = bytes;
    const std::size_t at = random() % bytes.size();
    spoilt[at] = static_cast<char>(spoilt[at] ^ (1 << (random() % 8)));
    put(file, spoilt);
    const Read read = readAll(file);
    // An error, or the report that the file ends early; and never other data.
    ASSERT_TRUE(!read.error.empty() || !read.closed) << "byte " << at;
    ASSERT_TRUE(isPrefix(read.items, items)) << "byte " << at;
  }
}

TEST(Mcap, AFlippedBitInATruncatedFileNeverChangesData) {
  const auto items = makeItems(60);
  const std::string whole = makeClosedFile(items);
  const std::string bytes = whole.substr(0, whole.size() / 2);
  const auto file = makeFileName("flip_cut");
  std::mt19937 random(17);
  for (int i = 0; i < 1000; ++i) {
    std::string spoilt = bytes;
    const std::size_t at = random() % bytes.size();
    spoilt[at] = static_cast<char>(spoilt[at] ^ (1 << (random() % 8)));
    put(file, spoilt);
    ASSERT_TRUE(isPrefix(readAll(file).items, items)) << "byte " << at;
  }
}

TEST(Mcap, BytesAfterTheEndAreReported) {
  const auto file = makeFileName("after");
  put(file, makeClosedFile(makeItems(5)) + "x");
  EXPECT_NE(readAll(file).error.find("the closing magic bytes are missing"), std::string::npos);
}

TEST(Mcap, OtherFilesAreNamedAndRefused) {
  const auto file = makeFileName("other");
  put(file, "this is a text, and no recording");
  EXPECT_NE(readAll(file).error.find(file.string() + ": at byte 0: not an MCAP file"),
            std::string::npos);
  EXPECT_NE(readAll(makeFileName("missing")).error.find("cannot be read"), std::string::npos);
}

TEST(Mcap, FlushedDataIsReadableWithoutClose) {
  const auto items = makeItems(9);
  const auto file = makeFileName("flushed");
  Writer writer(file, makeSmallChunks());
  writeAll(writer, items);
  writer.flush();
  const Read read = readAll(file);
  EXPECT_EQ(read.items, items);
  EXPECT_FALSE(read.closed);
}

/// Limits the size of this process's files, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST(Mcap, AFullDiskIsReportedOnceAndLeavesAReadableFile) {
  const auto items = makeItems(400);
  const auto file = makeFileName("full");
  std::string message;
  {
    const FullDisk disk(6000);
    Writer writer(file, makeSmallChunks());
    try {
      writeAll(writer, items);
    } catch (const RecordingError& error) {
      message = error.what();
    }
    EXPECT_NO_THROW(writer.write(1, 0, "after the end"));
    EXPECT_NO_THROW(writer.close());
  }
  EXPECT_NE(message.find(file.string() + ": File too large"), std::string::npos) << message;
  const Read read = readAll(file);
  EXPECT_EQ(read.error, "");
  EXPECT_FALSE(read.items.empty());
  EXPECT_TRUE(isPrefix(read.items, items));
  EXPECT_EQ(read.whole, std::filesystem::file_size(file));
}

}  // namespace
}  // namespace enfilade::protocol::mcap
