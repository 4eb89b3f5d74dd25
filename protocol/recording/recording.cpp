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

constexpr const char* kCommands = "/enfilade/commands";
constexpr const char* kState = "/enfilade/state";
constexpr const char* kNames = "/enfilade/names";

void addWithImports(const pb::FileDescriptor& file, pb::FileDescriptorSet& set,
                    std::set<std::string>& known) {
  if (!known.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) addWithImports(*file.dependency(i), set, known);
  file.CopyTo(set.add_file());
}

mcap::ChannelSpec channelOf(const std::string& topic, const pb::Descriptor& message) {
  pb::FileDescriptorSet set;
  std::set<std::string> known;
  addWithImports(*message.file(), set, known);
  return {topic, "protobuf", message.full_name(), "protobuf", set.SerializeAsString()};
}

/// Its tick's time, of the messages that have one.
template <class Message>
bool timeIsRight(const Message& message) {
  if constexpr (requires { message.time(); })
    return std::isfinite(message.time()) && message.time() >= 0;
  return true;
}

template <class Message>
RecordedItem parsed(const mcap::Message& from, const std::filesystem::path& file) {
  Message message;
  if (!message.ParseFromArray(from.data.data(), static_cast<int>(from.data.size())))
    throw mcap::RecordingError(file.string() + ": a message of " + from.channel->topic +
                               " cannot be read");
  if (!timeIsRight(message))
    throw mcap::RecordingError(file.string() + ": a message of " + from.channel->topic +
                               " has a time that is none");
  return message;
}

/// The first field that differs, and its values.
class FirstField : public pb::util::MessageDifferencer::Reporter {
 public:
  void ReportAdded(const pb::Message& /*recorded*/, const pb::Message& replayed,
                   const std::vector<pb::util::MessageDifferencer::SpecificField>& path) override {
    tell(path, "nothing", valueOf(replayed, path, true));
  }
  void ReportDeleted(
      const pb::Message& recorded, const pb::Message& /*replayed*/,
      const std::vector<pb::util::MessageDifferencer::SpecificField>& path) override {
    tell(path, valueOf(recorded, path, false), "nothing");
  }
  void ReportModified(
      const pb::Message& recorded, const pb::Message& replayed,
      const std::vector<pb::util::MessageDifferencer::SpecificField>& path) override {
    tell(path, valueOf(recorded, path, false), valueOf(replayed, path, true));
  }
  std::optional<StateDifference> found;

 private:
  using Path = std::vector<pb::util::MessageDifferencer::SpecificField>;

  void tell(const Path& path, std::string recorded, std::string replayed) {
    if (found) return;
    std::string field;
    for (const auto& step : path) {
      if (!step.field) continue;
      field += (field.empty() ? "" : ".") + step.field->name();
      if (step.index >= 0) field += "[" + std::to_string(step.index) + "]";
    }
    found = {"", field, std::move(recorded), std::move(replayed)};
  }
  /// `message` is the one that the path's last step is a field of.
  static std::string valueOf(const pb::Message& message, const Path& path, bool second) {
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

std::optional<StateDifference> differenceOf(const std::string& who, const pb::Message& recorded,
                                            const pb::Message& replayed) {
  FirstField first;
  pb::util::MessageDifferencer differencer;
  differencer.ReportDifferencesTo(&first);
  differencer.Compare(recorded, replayed);
  if (first.found) first.found->who = who;
  return first.found;
}

/// Of two lists in the same order, the first that is not in both or differs.
template <class States>
std::optional<StateDifference> listDifference(const States& recorded, const States& replayed) {
  for (int i = 0; i < std::max(recorded.size(), replayed.size()); ++i) {
    const bool inFirst = i < recorded.size(), inSecond = i < replayed.size();
    if (inFirst && inSecond && recorded[i].name() == replayed[i].name()) {
      if (auto found = differenceOf(recorded[i].name(), recorded[i], replayed[i])) return found;
      continue;
    }
    return StateDifference{inFirst ? recorded[i].name() : replayed[i].name(), "presence",
                           inFirst ? recorded[i].name() : "nobody",
                           inSecond ? replayed[i].name() : "nobody"};
  }
  return std::nullopt;
}

}  // namespace

std::uint64_t nanosecondsOf(double seconds) {
  return static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

std::string hexadecimal(std::uint64_t hash) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) text.push_back(kDigits[(hash >> shift) & 15]);
  return text;
}

RecordingWriter::RecordingWriter(const std::filesystem::path& file, const std::string& library,
                                 bool replace)
    : file_(file, {.library = library, .replace = replace}),
      start_(file_.addChannel(channelOf(kStartTopic, *v1::RecordingStart::descriptor()))),
      commands_(file_.addChannel(channelOf(kCommands, *v1::RecordedCommands::descriptor()))),
      events_(file_.addChannel(channelOf(kEventsTopic, *v1::TickEvents::descriptor()))),
      state_(file_.addChannel(channelOf(kState, *v1::State::descriptor()))),
      names_(file_.addChannel(channelOf(kNames, *v1::RecordedNames::descriptor()))),
      checkpoint_(
          file_.addChannel(channelOf(kCheckpointTopic, *v1::RecordedCheckpoint::descriptor()))) {}

void RecordingWriter::writeTo(std::uint16_t channel, double time, const pb::MessageLite& message) {
  message.SerializeToString(&bytes_);
  last_ = std::max(last_, fileTime(time));
  file_.write(channel, nanosecondsOf(fileTime(time)), bytes_);
}

void RecordingWriter::write(const std::string& topic, double time, const pb::Message& message) {
  std::uint16_t& channel = others_[topic];
  if (channel == 0) channel = file_.addChannel(channelOf(topic, *message.GetDescriptor()));
  writeTo(channel, time, message);
}

void RecordingWriter::write(const v1::RecordingStart& start, double time) {
  startTime_ = time;
  began_ = std::max(0.0, last_ - time);
  writeTo(start_, time, start);
  file_.flush();  // a recording that cannot be begun again is worth nothing
}

void RecordingWriter::write(const v1::RecordedCommands& commands, double time) {
  writeTo(commands_, time, commands);
}

void RecordingWriter::write(const v1::TickEvents& events) {
  writeTo(events_, events.time(), events);
}

void RecordingWriter::write(const v1::State& state) {
  writeTo(state_, state.time(), state);
}

void RecordingWriter::write(const v1::RecordedNames& names) {
  writeTo(names_, startTime_, names);
}

std::uint64_t RecordingWriter::write(const v1::RecordedCheckpoint& checkpoint, double time) {
  file_.flush();
  const std::uint64_t before = bytesWritten();
  writeTo(checkpoint_, time, checkpoint);
  file_.flush();
  return bytesWritten() - before;
}

RecordingReader::RecordingReader(const std::filesystem::path& file,
                                 std::optional<std::uint32_t> run)
    : path_(file), file_(file), run_(run) {}

std::optional<RecordedItem> itemFrom(const mcap::Message& message,
                                     const std::filesystem::path& file) {
  const std::string& topic = message.channel->topic;
  if (topic == kStartTopic) return parsed<v1::RecordingStart>(message, file);
  if (topic == kCommands) return parsed<v1::RecordedCommands>(message, file);
  if (topic == kEventsTopic) return parsed<v1::TickEvents>(message, file);
  if (topic == kState) return parsed<v1::State>(message, file);
  if (topic == kNames) return parsed<v1::RecordedNames>(message, file);
  if (topic == kCheckpointTopic) return parsed<v1::RecordedCheckpoint>(message, file);
  return std::nullopt;
}

bool RecordingReader::isWanted(const RecordedItem& item) {
  if (!run_) return true;
  begun_ += std::holds_alternative<v1::RecordingStart>(item) ? 1 : 0;
  if (begun_ < *run_ && std::holds_alternative<v1::RecordedNames>(item)) names_.push_back(item);
  return begun_ == *run_;
}

std::optional<RecordedItem> RecordingReader::next() {
  if (run_ && begun_ == *run_ && !names_.empty()) {
    RecordedItem names = std::move(names_.front());
    names_.pop_front();
    return names;
  }
  while (const auto message = file_.next()) {
    auto item = itemFrom(*message, path_);
    if (item && isWanted(*item)) return item;
  }
  if (run_ && begun_ < *run_) failWithoutRun(path_, *run_, begun_);
  return std::nullopt;
}

void failWithoutRun(const std::filesystem::path& file, std::uint32_t asked, std::size_t runs) {
  throw mcap::RecordingError(file.string() + ": there is no run " + std::to_string(asked) +
                             " in it" +
                             (runs > 0 ? "; give one from 1 to " + std::to_string(runs)
                                       : ": no recording of Enfilade begins in it"));
}

std::optional<StateDifference> firstDifference(const v1::State& recorded,
                                               const v1::State& replayed) {
  if (auto found = listDifference(recorded.avatars(), replayed.avatars())) return found;
  if (auto found = listDifference(recorded.bodies(), replayed.bodies())) return found;
  if (recorded.hash() == replayed.hash()) return std::nullopt;
  return StateDifference{"the world", "state hash", hexadecimal(recorded.hash()),
                         hexadecimal(replayed.hash())};
}

}  // namespace enfilade::protocol
