#include "protocol/recording/recording.hpp"

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace enfilade::protocol {
namespace {

namespace pb = google::protobuf;

constexpr const char* kCommandsTopic = "/enfilade/commands";
constexpr const char* kNamesTopic = "/enfilade/names";

void addWithImports(const pb::FileDescriptor& file, pb::FileDescriptorSet& set,
                    std::set<std::string>& known) {
  if (!known.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) addWithImports(*file.dependency(i), set, known);
  file.CopyTo(set.add_file());
}

mcap::ChannelSpec makeChannelSpec(const std::string& topic, const pb::Descriptor& message) {
  return {topic, "protobuf", message.full_name(), "protobuf", serializeSchema(message)};
}

/// True if the message's time is valid. Messages without a time are valid.
template <class Message>
bool hasValidTime(const Message& message) {
  if constexpr (requires { message.time(); })
    return std::isfinite(message.time()) && message.time() >= 0;
  return true;
}

template <class Message>
RecordedItem parseItem(const mcap::Message& from, const std::filesystem::path& file) {
  Message message;
  if (!message.ParseFromArray(from.data.data(), static_cast<int>(from.data.size())))
    throw mcap::RecordingError(file.string() + ": a message of " + from.channel->topic +
                               " cannot be read");
  if (!hasValidTime(message))
    throw mcap::RecordingError(file.string() + ": a message of " + from.channel->topic +
                               " has an invalid time");
  return message;
}

/// Finds the first field that differs, with both values.
class FirstDifferenceReporter : public pb::util::MessageDifferencer::Reporter {
 public:
  void ReportAdded(const pb::Message& /*recorded*/, const pb::Message& replayed,
                   const std::vector<pb::util::MessageDifferencer::SpecificField>& path) override {
    recordDifference(path, "nothing", formatValue(replayed, path, true));
  }
  void ReportDeleted(
      const pb::Message& recorded, const pb::Message& /*replayed*/,
      const std::vector<pb::util::MessageDifferencer::SpecificField>& path) override {
    recordDifference(path, formatValue(recorded, path, false), "nothing");
  }
  void ReportModified(
      const pb::Message& recorded, const pb::Message& replayed,
      const std::vector<pb::util::MessageDifferencer::SpecificField>& path) override {
    recordDifference(path, formatValue(recorded, path, false), formatValue(replayed, path, true));
  }
  std::optional<StateDifference> found;

 private:
  using Path = std::vector<pb::util::MessageDifferencer::SpecificField>;

  void recordDifference(const Path& path, std::string recorded, std::string replayed) {
    if (found) return;
    std::string field;
    for (const auto& step : path) {
      if (!step.field) continue;
      field += (field.empty() ? "" : ".") + step.field->name();
      if (step.index >= 0) field += "[" + std::to_string(step.index) + "]";
    }
    found = {"", field, std::move(recorded), std::move(replayed)};
  }
  /// `message` contains the field of the path's last step.
  static std::string formatValue(const pb::Message& message, const Path& path, bool second) {
    const auto& last = path.back();
    pb::TextFormat::Printer printer;
    printer.SetSingleLineMode(true);
    std::string text;
    const int index = second ? last.new_index : last.index;
    printer.PrintFieldValueToString(message, last.field, last.field->is_repeated() ? index : -1,
                                    &text);
    return text;
  }
};

std::optional<StateDifference> compareMessages(const std::string& entity,
                                               const pb::Message& recorded,
                                               const pb::Message& replayed) {
  FirstDifferenceReporter first;
  pb::util::MessageDifferencer differencer;
  differencer.ReportDifferencesTo(&first);
  differencer.Compare(recorded, replayed);
  if (first.found) first.found->entity = entity;
  return first.found;
}

/// Compares two lists in the same order; returns the first element that is missing or differs.
template <class States>
std::optional<StateDifference> compareLists(const States& recorded, const States& replayed) {
  for (int i = 0; i < std::max(recorded.size(), replayed.size()); ++i) {
    const bool inFirst = i < recorded.size(), inSecond = i < replayed.size();
    if (inFirst && inSecond && recorded[i].name() == replayed[i].name()) {
      if (auto found = compareMessages(recorded[i].name(), recorded[i], replayed[i])) return found;
      continue;
    }
    return StateDifference{inFirst ? recorded[i].name() : replayed[i].name(), "presence",
                           inFirst ? recorded[i].name() : "absent",
                           inSecond ? replayed[i].name() : "absent"};
  }
  return std::nullopt;
}

}  // namespace

std::uint64_t toNanoseconds(double seconds) {
  return static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

std::string toHex(std::uint64_t hash) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) text.push_back(kDigits[(hash >> shift) & 15]);
  return text;
}

std::string serializeSchema(const pb::Descriptor& message) {
  pb::FileDescriptorSet set;
  std::set<std::string> known;
  addWithImports(*message.file(), set, known);
  return set.SerializeAsString();
}

RecordingWriter::RecordingWriter(const std::filesystem::path& file, const std::string& library,
                                 bool replace)
    : file_(file, {.library = library, .replace = replace}),
      start_(file_.addChannel(makeChannelSpec(kStartTopic, *v1::RecordingStart::descriptor()))),
      commands_(
          file_.addChannel(makeChannelSpec(kCommandsTopic, *v1::RecordedCommands::descriptor()))),
      events_(file_.addChannel(makeChannelSpec(kEventsTopic, *v1::TickEvents::descriptor()))),
      state_(file_.addChannel(makeChannelSpec(kStateTopic, *v1::State::descriptor()))),
      names_(file_.addChannel(makeChannelSpec(kNamesTopic, *v1::RecordedNames::descriptor()))),
      checkpoint_(file_.addChannel(
          makeChannelSpec(kCheckpointTopic, *v1::RecordedCheckpoint::descriptor()))) {}

void RecordingWriter::writeToChannel(std::uint16_t channel, double time,
                                     const pb::MessageLite& message) {
  message.SerializeToString(&bytes_);
  lastTime_ = std::max(lastTime_, fileTime(time));
  file_.write(channel, toNanoseconds(fileTime(time)), bytes_);
}

void RecordingWriter::write(const std::string& topic, double time, const pb::Message& message) {
  std::uint16_t& channel = extraChannels_[topic];
  if (channel == 0) channel = file_.addChannel(makeChannelSpec(topic, *message.GetDescriptor()));
  writeToChannel(channel, time, message);
}

void RecordingWriter::write(const v1::RecordingStart& start, double time) {
  startTime_ = time;
  runStart_ = std::max(0.0, lastTime_ - time);
  writeToChannel(start_, time, start);
  file_.flush();  // a recording without its start cannot be replayed
}

void RecordingWriter::write(const v1::RecordedCommands& commands, double time) {
  writeToChannel(commands_, time, commands);
}

void RecordingWriter::write(const v1::TickEvents& events) {
  writeToChannel(events_, events.time(), events);
}

void RecordingWriter::write(const v1::State& state) {
  writeToChannel(state_, state.time(), state);
}

void RecordingWriter::write(const v1::RecordedNames& names) {
  writeToChannel(names_, startTime_, names);
}

std::uint64_t RecordingWriter::write(const v1::RecordedCheckpoint& checkpoint, double time) {
  file_.flush();
  const std::uint64_t before = bytesWritten();
  writeToChannel(checkpoint_, time, checkpoint);
  file_.flush();
  return bytesWritten() - before;
}

RecordingReader::RecordingReader(const std::filesystem::path& file,
                                 std::optional<std::uint32_t> run)
    : path_(file), file_(file), run_(run) {}

std::optional<RecordedItem> parseRecordedItem(const mcap::Message& message,
                                              const std::filesystem::path& file) {
  const std::string& topic = message.channel->topic;
  if (topic == kStartTopic) return parseItem<v1::RecordingStart>(message, file);
  if (topic == kCommandsTopic) return parseItem<v1::RecordedCommands>(message, file);
  if (topic == kEventsTopic) return parseItem<v1::TickEvents>(message, file);
  if (topic == kStateTopic) return parseItem<v1::State>(message, file);
  if (topic == kNamesTopic) return parseItem<v1::RecordedNames>(message, file);
  if (topic == kCheckpointTopic) return parseItem<v1::RecordedCheckpoint>(message, file);
  return std::nullopt;
}

bool RecordingReader::isWanted(const RecordedItem& item) {
  if (!run_) return true;
  runsBegun_ += std::holds_alternative<v1::RecordingStart>(item) ? 1 : 0;
  if (runsBegun_ < *run_ && std::holds_alternative<v1::RecordedNames>(item)) names_.push_back(item);
  return runsBegun_ == *run_;
}

std::optional<RecordedItem> RecordingReader::next() {
  if (run_ && runsBegun_ == *run_ && !names_.empty()) {
    RecordedItem names = std::move(names_.front());
    names_.pop_front();
    return names;
  }
  while (const auto message = file_.next()) {
    auto item = parseRecordedItem(*message, path_);
    if (item && isWanted(*item)) return item;
  }
  if (run_ && runsBegun_ < *run_) throwMissingRun(path_, *run_, runsBegun_);
  return std::nullopt;
}

void throwMissingRun(const std::filesystem::path& file, std::uint32_t requestedRun,
                     std::size_t runs) {
  throw mcap::RecordingError(file.string() + ": no run " + std::to_string(requestedRun) + " in it" +
                             (runs > 0 ? "; give a run from 1 to " + std::to_string(runs)
                                       : ": not a recording of Enfilade"));
}

std::optional<StateDifference> findFirstDifference(const v1::State& recorded,
                                                   const v1::State& replayed) {
  if (auto found = compareLists(recorded.avatars(), replayed.avatars())) return found;
  if (auto found = compareLists(recorded.bodies(), replayed.bodies())) return found;
  if (recorded.hash() == replayed.hash()) return std::nullopt;
  return StateDifference{"the world", "state hash", toHex(recorded.hash()), toHex(replayed.hash())};
}

}  // namespace enfilade::protocol
