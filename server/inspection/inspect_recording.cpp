#include "server/inspection/inspect_recording.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "protocol/recording/recording.hpp"
#include "server/base/standard_output.hpp"
#include "server/messages/event_names.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using protocol::mcap::RecordingError;

struct ChannelStats {
  std::string schema;
  std::uint64_t messages = 0, bytes = 0;
};

struct AvatarStats {
  double entered = 0, last = 0;  ///< seconds
  double pathLength = 0;         ///< metres
  std::uint32_t visits = 0;      ///< number of entries into the world
};

/// Statistics of one run.
struct RunStats {
  v1::RecordingStart start;
  std::uint64_t ticks = 0, hash = 0;
  double time = 0;  ///< seconds
  std::map<std::string, AvatarStats> avatars;
  std::set<std::string> movedBodies;
  std::map<std::string, std::uint64_t> commands, events, notices;  ///< by kind
};

struct RecordingStats {
  std::string writer;
  std::uint64_t fileBytes = 0, wholeBytes = 0, chunks = 0;
  bool closed = false;
  std::string damage;  ///< reason why reading stopped; empty: none
  std::map<std::string, ChannelStats> channels;
  std::vector<RunStats> runs;
};

std::string getCommandName(const v1::Command& command) {
  const auto* order = v1::Command::descriptor()->FindFieldByNumber(command.order_case());
  return order ? order->name() : "unknown";
}

void addCommands(RunStats& run, const v1::RecordedCommands& commands) {
  for (const auto& one : commands.commands())
    ++run.commands[one.has_body() ? "body" : getCommandName(one.avatar())];
}

void addEvents(RunStats& run, const v1::TickEvents& events) {
  for (const v1::ContactEvent& event : events.contacts()) {
    const bool near = event.kind() == v1::ContactEvent::KIND_NEAR;
    if (near && event.phase() != v1::ContactEvent::PHASE_BEGIN) continue;
    ++run.events[toString(event.kind())];
  }
  for (const v1::Notice& notice : events.notices()) {
    ++run.notices[toString(notice.kind())];
    if (notice.kind() == v1::Notice::KIND_SPAWNED) ++run.avatars[notice.avatar()].visits;
  }
}

/// Adds a state. `feet`: positions of the last tick, by entity.
void addState(RunStats& run, const v1::State& state, std::map<std::uint32_t, scene::Vec3>& feet) {
  run.ticks = state.tick();
  run.time = state.time();
  run.hash = state.hash();
  for (const v1::AvatarState& avatar : state.avatars()) {
    const scene::Vec3 at = vectorFromProto(avatar.feet());
    AvatarStats& stats = run.avatars[avatar.name()];
    if (stats.last == 0) stats.entered = state.time();
    const auto before = feet.find(avatar.id());
    if (before != feet.end()) stats.pathLength += (at - before->second).norm();
    feet[avatar.id()] = at;
    stats.last = state.time();
  }
  for (const v1::BodyState& body : state.bodies()) run.movedBodies.insert(body.name());
}

/// Reads only the container: channels and chunks.
void readChannels(const std::filesystem::path& file, RecordingStats& into) {
  protocol::mcap::Reader reader(file);
  into.writer = reader.library();
  try {
    while (const auto message = reader.next()) {
      ChannelStats& stats = into.channels[message->channel->topic];
      stats.schema = message->channel->schemaName;
      ++stats.messages;
      stats.bytes += message->data.size();
    }
  } catch (const RecordingError& error) {
    into.damage = error.what();
  }
  into.closed = reader.closed();
  into.wholeBytes = reader.wholeBytes();
  into.chunks = reader.chunks();
}

void readRuns(const std::filesystem::path& file, RecordingStats& into) {
  protocol::RecordingReader reader(file);
  std::map<std::uint32_t, scene::Vec3> feet;
  try {
    while (const auto item = reader.next()) {
      if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) {
        into.runs.emplace_back().start = *start;
        into.runs.back().hash = start->state_hash();
        feet.clear();
      }
      if (into.runs.empty()) continue;
      RunStats& run = into.runs.back();
      if (const auto* commands = std::get_if<v1::RecordedCommands>(&*item))
        addCommands(run, *commands);
      if (const auto* events = std::get_if<v1::TickEvents>(&*item)) addEvents(run, *events);
      if (const auto* state = std::get_if<v1::State>(&*item)) addState(run, *state, feet);
    }
  } catch (const RecordingError& error) {
    if (into.damage.empty()) into.damage = error.what();
  }
}

Json toJson(const v1::ModelChoices& choices) {
  Json json = Json::object();
  if (choices.has_metres_per_unit()) json["metres_per_unit"] = choices.metres_per_unit();
  if (!choices.up().empty()) json["up"] = choices.up();
  json["ifc_reader"] = choices.ifc_reader();
  json["ifc_doors"] = choices.ifc_doors();
  return json;
}

Json toJson(const v1::Lengths& lengths) {
  return {{"epsilon", lengths.epsilon()},     {"step_height", lengths.step_height()},
          {"near_miss", lengths.near_miss()}, {"tick", lengths.tick()},
          {"gravity", lengths.gravity()},     {"speed_limit", lengths.speed_limit()},
          {"patience", lengths.patience()},   {"sliding", lengths.sliding()}};
}

Json toJson(const v1::RecordingParent& parent) {
  return {{"file", parent.file()}, {"run", std::max(parent.run(), 1U)}, {"tick", parent.tick()}};
}

Json toJson(const RunStats& run) {
  Json avatars = Json::array();
  for (const auto& [name, stats] : run.avatars)
    avatars.push_back({{"name", name},
                       {"entered", stats.entered},
                       {"last", stats.last},
                       {"visits", stats.visits},
                       {"way_length", stats.pathLength}});
  Json json{{"scene", run.start.scene().source()},
            {"scene_file", run.start.scene_file()},
            {"scene_hash", protocol::toHex(run.start.scene().hash())},
            {"objects", run.start.scene().objects()},
            {"bodies", run.start.scene().bodies_size()},
            {"server_version", run.start.server_version()},
            {"choices", toJson(run.start.choices())},
            {"lengths", toJson(run.start.lengths())},
            {"ticks", run.ticks},
            {"time", run.time},
            {"state_hash", protocol::toHex(run.hash)},
            {"avatars", avatars},
            {"moved_bodies", run.movedBodies},
            {"commands", run.commands},
            {"events", run.events},
            {"notices", run.notices}};
  if (run.start.has_parent()) json["parent"] = toJson(run.start.parent());
  return json;
}

std::string formatJson(const std::filesystem::path& file, const RecordingStats& contents) {
  Json channels = Json::array(), runs = Json::array();
  for (const auto& [topic, stats] : contents.channels)
    channels.push_back({{"topic", topic},
                        {"schema", stats.schema},
                        {"messages", stats.messages},
                        {"bytes", stats.bytes}});
  for (const RunStats& run : contents.runs) runs.push_back(toJson(run));
  Json json{{"recording", file.string()},      {"writer", contents.writer},
            {"bytes", contents.fileBytes},     {"chunks", contents.chunks},
            {"closed", contents.closed},       {"whole_bytes", contents.wholeBytes},
            {"channels", std::move(channels)}, {"runs", std::move(runs)}};
  if (!contents.damage.empty()) json["spoilt"] = contents.damage;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

template <class... Values>
void appendLine(std::string& text, const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  text += buffer;
  text += "\n";
}

using Count = unsigned long long;

void appendCounts(std::string& text, const char* title,
                  const std::map<std::string, std::uint64_t>& counts) {
  if (counts.empty()) return;
  text += std::string("  ") + title + ":";
  for (const auto& [kind, count] : counts) text += " " + kind + " " + std::to_string(count);
  text += "\n";
}

/// Appends a run. `number`: from 1; 0: the only run.
void appendRun(std::string& text, std::size_t number, const RunStats& run) {
  constexpr std::size_t kMaxNames = 20;
  text += "\n";
  if (number > 0) text += "run " + std::to_string(number) + ", ";
  appendLine(text, "%s: scene %s, %u objects, %d bodies", run.start.scene().source().c_str(),
             protocol::toHex(run.start.scene().hash()).c_str(), run.start.scene().objects(),
             run.start.scene().bodies_size());
  text += "  " + run.start.scene_file() + "\n";
  const v1::RecordingParent& parent = run.start.parent();
  if (run.start.has_parent() && parent.file().empty())
    text += "  restored from a checkpoint of tick " + std::to_string(parent.tick()) + "\n";
  else if (run.start.has_parent())
    text += "  a branch of " + parent.file() + ", run " +
            std::to_string(std::max(parent.run(), 1U)) + ", after tick " +
            std::to_string(parent.tick()) + "\n";
  appendLine(text, "  %llu ticks of %.6g s = %.3f s; ends in state %s",
             static_cast<Count>(run.ticks), run.start.lengths().tick(), run.time,
             protocol::toHex(run.hash).c_str());
  std::size_t printed = 0;
  for (const auto& [name, stats] : run.avatars) {
    if (printed++ == kMaxNames) break;
    appendLine(text, "  avatar %-24s %9.3f s .. %9.3f s, path %.3f m", name.c_str(), stats.entered,
               stats.last, stats.pathLength);
  }
  if (run.avatars.size() > kMaxNames)
    appendLine(text, "  and %zu more avatars", run.avatars.size() - kMaxNames);
  if (!run.movedBodies.empty()) appendLine(text, "  %zu bodies moved", run.movedBodies.size());
  appendCounts(text, "commands", run.commands);
  appendCounts(text, "events", run.events);
  appendCounts(text, "notices", run.notices);
}

std::string formatTable(const std::filesystem::path& file, const RecordingStats& contents) {
  std::string text = file.string() + ": recorded by " + contents.writer + "\n";
  appendLine(text, "%llu bytes, %llu chunks, %s", static_cast<Count>(contents.fileBytes),
             static_cast<Count>(contents.chunks),
             contents.closed ? "closed by its writer" : "not closed: the writer stopped early");
  if (!contents.damage.empty()) text += "DAMAGED: " + contents.damage + "\n";
  if (!contents.closed)
    appendLine(text, "readable up to byte %llu", static_cast<Count>(contents.wholeBytes));
  for (const auto& [topic, stats] : contents.channels)
    appendLine(text, "  %-28s %10llu messages %12llu bytes  %s", topic.c_str(),
               static_cast<Count>(stats.messages), static_cast<Count>(stats.bytes),
               stats.schema.c_str());
  const bool several = contents.runs.size() > 1;
  for (std::size_t i = 0; i < contents.runs.size(); ++i)
    appendRun(text, several ? i + 1 : 0, contents.runs[i]);
  return text;
}

}  // namespace

ExitCode inspectRecording(const std::filesystem::path& file, bool json, bool strict) {
  RecordingStats contents;
  contents.fileBytes = std::filesystem::file_size(file);
  readChannels(file, contents);
  readRuns(file, contents);
  const std::string text = json ? formatJson(file, contents) : formatTable(file, contents);
  writeToStdout(text);
  if (!contents.damage.empty()) return ExitCode::runtimeError;
  return strict && !contents.closed ? ExitCode::violations : ExitCode::success;
}

}  // namespace enfilade::server
