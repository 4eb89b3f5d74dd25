#include "server/diff/difference_text.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "protocol/recording/recording.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxLines = 20;  // per section

/// m:ss with hundredths.
std::string formatTime(double seconds) {
  const auto hundredths = std::llround(seconds * 100);
  char text[40];
  std::snprintf(text, sizeof text, "%lld:%02lld.%02lld", hundredths / 6000, hundredths / 100 % 60,
                hundredths % 100);
  return text;
}

std::string formatMetres(double length) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3f m", length);
  return text;
}

std::string formatPosition(const Vec3& point) {
  char text[120];
  std::snprintf(text, sizeof text, "(%.3f, %.3f, %.3f)", point.x(), point.y(), point.z());
  return text;
}

std::string formatDelay(double seconds) {
  char text[60];
  std::snprintf(text, sizeof text, "%.2f s %s", std::abs(seconds),
                seconds < 0 ? "earlier" : "later");
  return text;
}

const char* describeModel(ModelSide model) {
  if (model == ModelSide::after) return "; new in this model";
  return model == ModelSide::before ? "; removed from this model" : "";
}

std::string formatOutcome(const FinishedOrder& end) {
  switch (end.kind) {
    case v1::Notice::KIND_SPAWNED:
      return "entered at " + formatTime(end.time);
    case v1::Notice::KIND_ARRIVED:
      return "arrived at " + formatTime(end.time);
    case v1::Notice::KIND_BLOCKED:
      return "blocked at " + formatTime(end.time) + " at " + formatPosition(end.position) +
             (end.obstacle.empty() ? "" : " by " + end.obstacle);
    case v1::Notice::KIND_REFUSED:
      return "refused: " + end.text;
    case v1::Notice::KIND_LEFT:
      return "left at " + formatTime(end.time) + (end.text.empty() ? "" : ": " + end.text);
    default:
      return "done at " + formatTime(end.time);
  }
}

std::string formatHeader(const RecordedWalk& walk) {
  const RecordedRun& last = walk.runs.back();
  std::uint64_t ticks = 0;
  for (const RecordedRun& run : walk.runs) ticks += run.ticks;
  std::string text = walk.file.string() + ": " + last.start.scene().source() + " (scene " +
                     protocol::toHex(last.start.scene().hash()) + "), " + std::to_string(ticks) +
                     " ticks, " + formatTime(last.time);
  if (walk.runs.size() > 1) text += ", started " + std::to_string(walk.runs.size()) + " times";
  if (!walk.closed)
    text += "; truncated after byte " + std::to_string(walk.wholeBytes) + ", compared up to there";
  return text + "\n";
}

std::string formatLine(const PathChange& path) {
  if (!path.before) return path.avatar + ": new avatar";
  if (!path.after) return path.avatar + ": removed avatar";
  if (path.firstTick == 0) return path.avatar;
  return path.avatar + ": path differs from tick " + std::to_string(path.firstTick) +
         " on, up to " + formatMetres(path.maxDistance) + " away (tick " +
         std::to_string(path.maxDistanceTick) + "); path length " +
         formatMetres(path.before->pathLength) + " -> " + formatMetres(path.after->pathLength);
}

std::string formatLine(const RefusedCommand& refused) {
  return "tick " + std::to_string(refused.tick) + "  " + refused.name + ": " + refused.reason;
}

/// Appends a section of at most kMaxLines lines.
template <class Changes, class Wanted>
void appendSection(std::string& text, const char* heading, const Changes& changes,
                   const Wanted& wanted) {
  std::size_t count = 0;
  for (const auto& change : changes) count += wanted(change) ? 1 : 0;
  if (count == 0) return;
  text.append("\n").append(heading).append(": ").append(std::to_string(count)).append("\n");
  std::size_t lineCount = 0;
  for (const auto& change : changes) {
    if (!wanted(change)) continue;
    if (lineCount++ == kMaxLines) break;
    text += "  " + formatLine(change) + "\n";
  }
  if (count > kMaxLines)
    text += "  and " + std::to_string(count - kMaxLines) + " more (--json lists all)\n";
}

struct EventHeading {
  WalkEventKind kind;
  const char *appeared, *disappeared, *moved;
};
constexpr std::array<EventHeading, kWalkEventKinds> kHeadings{
    {{WalkEventKind::blocked, "Blocked moves, new", "Blocked moves, gone", "Blocked moves, moved"},
     {WalkEventKind::contact, "Contacts, new", "Contacts, gone", "Contacts, moved"},
     {WalkEventKind::fall, "Fell out of the scene, new", "Fell out of the scene, no more",
      "Fell out of the scene, moved"},
     {WalkEventKind::enter, "Triggers entered, new", "Triggers entered, no more",
      "Triggers entered, moved"},
     {WalkEventKind::leave, "Triggers left, new", "Triggers left, no more", "Triggers left, moved"},
     {WalkEventKind::ground, "Stood on, new", "Stood on, no more", "Stood on, moved"}}};

void appendEventSections(std::string& text, const WalkDifference& difference) {
  const auto appendIf = [&](const EventHeading& heading, const char* title, bool was, bool is) {
    appendSection(text, title, difference.events, [&](const WalkEventChange& change) {
      return change.kind == heading.kind && change.before.has_value() == was &&
             change.after.has_value() == is;
    });
  };
  for (const auto& heading : kHeadings) appendIf(heading, heading.appeared, false, true);
  for (const auto& heading : kHeadings) appendIf(heading, heading.disappeared, true, false);
  for (const auto& heading : kHeadings) appendIf(heading, heading.moved, true, true);
}

}  // namespace

std::string formatLine(const WalkEventChange& change) {
  const WalkEvent& current = change.after ? *change.after : *change.before;
  std::string line = formatTime(current.time) + "  " + current.a +
                     (current.b.empty() ? "" : " - " + current.b) + " at " +
                     formatPosition(current.point);
  if (change.before && change.after) {
    if (change.shift > 0) line += ", " + formatMetres(change.shift) + " from where it was";
    if (change.before->tick != change.after->tick) line += ", " + formatDelay(change.delay);
  } else if (change.kind == WalkEventKind::contact) {
    if (change.otherDistance)
      line += change.after ? ", passed it at " + formatMetres(*change.otherDistance) + " before"
                           : ", passes it at " + formatMetres(*change.otherDistance) + " now";
  }
  return line + (current.b.empty() ? "" : describeModel(change.inModel));
}

std::string formatLine(const OrderChange& change) {
  const FinishedOrder& current = change.after ? *change.after : *change.before;
  std::string line = current.avatar;
  if (current.tag != 0)
    line += ", order " + std::to_string(current.tag);  // for scripts: the line number
  line += ": " + (change.before ? formatOutcome(*change.before) : std::string("nothing")) + " -> " +
          (change.after ? formatOutcome(*change.after) : std::string("never ended"));
  if (change.before && change.after && change.before->kind == change.after->kind &&
      change.before->tick != change.after->tick)
    line += ", " + formatDelay(change.after->time - change.before->time);
  return line;
}

std::string formatLine(const ClearanceChange& change) {
  const auto distance = [](const std::optional<Nearest>& nearest) {
    return nearest ? formatMetres(nearest->distance) : std::string("not near");
  };
  const Nearest& current = change.after ? *change.after : *change.before;
  return formatTime(current.time) + "  " + change.a + " - " + change.b + ": " +
         distance(change.before) + " -> " + distance(change.after) + " at " +
         formatPosition(current.point) + describeModel(change.inModel);
}

std::string formatDifferenceText(const WalkDifference& difference) {
  std::string text =
      "before  " + formatHeader(difference.before) + "after   " + formatHeader(difference.after);
  if (difference.isEmpty() && difference.refused.empty()) return text + "\nno difference\n";
  text += difference.worse == 0 ? "\nnothing got worse\n"
                                : "\ngot worse: " + std::to_string(difference.worse) + "\n";
  if (difference.before.runs.size() != difference.after.runs.size())
    text += "the number of runs differs; only the common runs are compared\n";
  appendSection(text, "Orders that no longer succeed", difference.orders,
                [](const OrderChange& change) { return change.worse; });
  appendSection(text, "Smaller clearances", difference.clearances,
                [](const ClearanceChange& change) { return change.minChange < 0; });
  appendEventSections(text, difference);
  appendSection(text, "Larger clearances", difference.clearances,
                [](const ClearanceChange& change) { return change.minChange > 0; });
  appendSection(text, "Orders with another end", difference.orders,
                [](const OrderChange& change) { return !change.worse; });
  appendSection(text, "Paths", difference.paths, [](const PathChange&) { return true; });
  appendSection(text, "Commands that the model refused", difference.refused,
                [](const RefusedCommand&) { return true; });
  return text;
}

}  // namespace enfilade::server
