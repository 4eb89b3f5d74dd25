// Tests that the examples in the documents are true.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"
#include "protocol/script/script_run.hpp"

namespace enfilade::protocol {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string readDocument(const std::string& name) {
  std::ifstream stream(std::string(ENFILADE_PROTOCOL_FOLDER) + "/" + name);
  EXPECT_TRUE(stream) << name;
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The content of the fenced block that begins with ````mark`.
std::string findFencedBlock(const std::string& text, const std::string& mark) {
  const std::string fence = "```" + mark + "\n";
  const std::size_t start = text.find(fence);
  if (start == std::string::npos) return "";
  const std::size_t end = text.find("```", start + fence.size());
  return text.substr(start + fence.size(), end - start - fence.size());
}

/// The pairs of hexadecimal digits at the beginning of each line.
Bytes parseHexBytes(const std::string& block) {
  Bytes bytes;
  std::istringstream lines(block);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    for (std::string word; words >> word && word.size() == 2 &&
                           word.find_first_not_of("0123456789abcdef") == std::string::npos;) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoul(word, nullptr, 16)));
    }
  }
  return bytes;
}

/// The message's fields that a page does not name in the given form.
std::vector<std::string> findUnnamedFields(const google::protobuf::Descriptor* message, bool byType,
                                           const char* file = "PROTOCOL.md") {
  const std::string page = readDocument(file);
  std::vector<std::string> missing;
  for (int i = 0; i < message->field_count(); ++i) {
    const google::protobuf::FieldDescriptor& field = *message->field(i);
    if (byType && !field.message_type()) continue;
    const std::string name = "`" + (byType ? field.message_type()->name() : field.name()) + "`";
    if (page.find(name) == std::string::npos) missing.push_back(name);
  }
  return missing;
}

TEST(Documents, ProtocolMdNamesEveryMessageLimitAndError) {
  const std::vector<std::string> none;
  EXPECT_EQ(findUnnamedFields(v1::ClientMessage::descriptor(), true), none);
  EXPECT_EQ(findUnnamedFields(v1::ServerMessage::descriptor(), true), none);
  EXPECT_EQ(findUnnamedFields(v1::Command::descriptor(), true), none);
  EXPECT_EQ(findUnnamedFields(v1::Limits::descriptor(), false, "LIMITS.md"), none);
  const std::string page = readDocument("PROTOCOL.md");
  for (int i = 1; i < v1::ErrorCode_descriptor()->value_count(); ++i) {
    const std::string name = "`" + v1::ErrorCode_descriptor()->value(i)->name() + "`";
    EXPECT_NE(page.find(name), std::string::npos) << name;
  }
}

TEST(Documents, TheScriptOfScriptMdParses) {
  const Script script =
      parseScript(findFencedBlock(readDocument("SCRIPT.md"), "jsonl"), "SCRIPT.md");
  EXPECT_EQ(script.lines.size(), 12u);
}

TEST(Documents, EveryCommandOfScriptMdParses) {
  std::istringstream lines(readDocument("SCRIPT.md"));
  int commands = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `{")) continue;
    std::string command = line.substr(3, line.find('`', 3) - 3);
    for (const auto& [placeholder, value] : {std::pair<std::string, std::string>{"NAME", "\"ann\""},
                                             {"FILE", "\"hall\""},
                                             {"[x,y,z]", "[1,2,3]"},
                                             {":seconds", ":1"},
                                             {":degrees", ":90"},
                                             {":N}", ":0}"}}) {
      const std::size_t at = command.find(placeholder);
      if (at != std::string::npos) command.replace(at, placeholder.size(), value);
    }
    EXPECT_EQ(parseScript(command, "SCRIPT.md").lines.size(), 1u) << command;
    ++commands;
  }
  EXPECT_EQ(commands, 18);
}

TEST(Documents, TheClientsBytesOfProtocolMdAreAHello) {
  const Bytes bytes = parseHexBytes(findFencedBlock(readDocument("PROTOCOL.md"), "hex client"));
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(kVersion);
  message.mutable_hello()->set_client_name("demo");
  Bytes expected(kMagic.begin(), kMagic.end());
  const Bytes framed = encode(message);
  expected.insert(expected.end(), framed.begin(), framed.end());
  EXPECT_EQ(bytes, expected);
}

TEST(Documents, TheServersBytesOfProtocolMdAreAFrame) {
  const Bytes bytes = parseHexBytes(findFencedBlock(readDocument("PROTOCOL.md"), "hex server"));
  Decoder decoder(kClientLimits, Decoder::Expect::messages);
  std::span<const std::uint8_t> rest(bytes);
  const auto message = decoder.next(rest);
  ASSERT_TRUE(message);
  EXPECT_TRUE(rest.empty());
  v1::ServerMessage parsed;
  ASSERT_TRUE(parseHeader(message->header, parsed));
  EXPECT_EQ(parsed.reply_to(), 7u);
  EXPECT_EQ(parsed.frame().tick(), 60u);
  EXPECT_EQ(parsed.frame().width(), 2u);
  ASSERT_EQ(parsed.frame().planes_size(), 1);
  EXPECT_EQ(parsed.frame().planes(0).channel(), v1::CHANNEL_RGB);
  EXPECT_EQ(parsed.frame().planes(0).length(), message->attachment.size());
  EXPECT_EQ(message->attachment, (Bytes{255, 0, 0, 0, 0, 255}));
  EXPECT_EQ(encode(parsed, message->attachment), bytes);
}

TEST(Documents, ProtocolMdNamesTheVersionAndEachError) {
  const std::string text = readDocument("PROTOCOL.md");
  EXPECT_NE(text.find(std::string("version ") + kVersion), std::string::npos);
  const auto* codes = v1::ErrorCode_descriptor();
  for (int i = 1; i < codes->value_count(); ++i) {
    EXPECT_NE(text.find(codes->value(i)->name()), std::string::npos) << codes->value(i)->name();
  }
}

TEST(Documents, ProtocolMdNamesEachRequestAndReply) {
  const std::string text = readDocument("PROTOCOL.md");
  for (const auto* envelope : {v1::ClientMessage::descriptor(), v1::ServerMessage::descriptor()}) {
    for (int i = 0; i < envelope->field_count(); ++i) {
      const auto* body = envelope->field(i)->message_type();
      if (!body) continue;
      EXPECT_NE(text.find("`" + body->name() + "`"), std::string::npos) << body->name();
    }
  }
}

TEST(Documents, BundledScriptsCanBeRead) {
  int scripts = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(ENFILADE_PROTOCOL_FOLDER) / ".." / "assets")) {
    if (entry.path().extension() != ".jsonl") continue;
    ++scripts;
    EXPECT_NO_THROW(readScript(entry.path())) << entry.path();
  }
  EXPECT_GE(scripts, 3);
}

}  // namespace
}  // namespace enfilade::protocol
