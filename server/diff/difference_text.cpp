#include <array>
#include <cmath>
#include <cstdio>

#include "protocol/recording/recording.hpp"
#include "server/diff/difference_report.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMostLines = 20;  // under one heading

/// m:ss with hundredths.
std::string clock(double seconds) {
  const auto hundredths = std::llround(seconds * 100);
  char text[40];
  std::snprintf(text, sizeof text, "%lld:%02lld.%02lld", hundredths / 6000, hundredths / 100 % 60,
                hundredths % 100);
  return text;
}

std::string metres(double length) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3f m", length);
  return text;
}

std::string place(const Vec3& point) {
  char text[120];
  std::snprintf(text, sizeof text, "(%.3f, %.3f, %.3f)", point.x(), point.y(), point.z());
  return text;
}

std::string later(double seconds) {
  char text[60];
  std::snprintf(text, sizeof text, "%.2f s %s", std::abs(seconds),
                seconds < 0 ? "earlier" : "later");
  return text;
}

const char* onlyIn(Model model) {
  if (model == Model::after) return "; it is new in this model";
  return model == Model::before ? "; it is gone from this model" : "";
}

std::string outcomeOf(const OrderEnd& end) {
  switch (end.kind) {
    case v1::Notice::KIND_SPAWNED:
      return "entered at " + clock(end.time);
    case v1::Notice::KIND_ARRIVED:
      return "arrived at " + clock(end.time);
    case v1::Notice::KIND_BLOCKED:
      return "blocked at " + clock(end.time) + " at " + place(end.position) +
             (end.obstacle.empty() ? "" : " by " + end.obstacle);
    case v1::Notice::KIND_REFUSED:
      return "refused: " + end.text;
    case v1::Notice::KIND_LEFT:
      return "left at " + clock(end.time) + (end.text.empty() ? "" : ": " + end.text);
    default:
      return "done at " + clock(end.time);
  }
}

std::string headOf(const RecordedWalk& walk) {
  const RecordedRun& last = walk.runs.back();
  std::uint64_t ticks = 0;
  for (const RecordedRun& run : walk.runs) ticks += run.ticks;
  std::string text = walk.file.string() + ": " + last.start.scene().source() + " (scene " +
                     protocol::hexadecimal(last.start.scene().hash()) + "), " +
                     std::to_string(ticks) + " ticks, " + clock(last.time);
  if (walk.runs.size() > 1) text += ", begun " + std::to_string(walk.runs.size()) + " times";
  if (!walk.closed)
    text += "; cut off after byte " + std::to_string(walk.wholeBytes) + ", compared up to there";
  return text + "\n";
}

std::string lineOf(const WayChange& way) {
  if (!way.before) return way.avatar + ": was not there before";
  if (!way.after) return way.avatar + ": is not there any more";
  if (way.firstTick == 0) return way.avatar;
  return way.avatar + ": goes otherwise from tick " + std::to_string(way.firstTick) +
         " on, up to " + metres(way.farthest) + " away (tick " + std::to_string(way.farthestTick) +
         "); way " + metres(way.before->wayLength) + " -> " + metres(way.after->wayLength);
}

std::string lineOf(const RefusedCommand& refused) {
  return "tick " + std::to_string(refused.tick) + "  " + refused.who + ": " + refused.why;
}

/// Lines under a heading, no more than kMostLines.
template <class Changes, class Wanted>
void section(std::string& text, const char* heading, const Changes& changes, const Wanted& wanted) {
  std::size_t count = 0;
  for (const auto& change : changes) count += wanted(change) ? 1 : 0;
  if (count == 0) return;
  text.append("\n").append(heading).append(": ").append(std::to_string(count)).append("\n");
  std::size_t told = 0;
  for (const auto& change : changes) {
    if (!wanted(change)) continue;
    if (told++ == kMostLines) break;
    text += "  " + lineOf(change) + "\n";
  }
  if (count > kMostLines)
    text += "  and " + std::to_string(count - kMostLines) + " more (--json tells all)\n";
}

struct HappeningHeading {
  HappeningKind kind;
  const char *appeared, *gone, *moved;
};
constexpr std::array<HappeningHeading, kHappeningKinds> kHeadings{
    {{HappeningKind::blocked, "Blocked moves, new", "Blocked moves, gone", "Blocked moves, moved"},
     {HappeningKind::contact, "Contacts, new", "Contacts, gone", "Contacts, moved"},
     {HappeningKind::fall, "Fell out of the scene, new", "Fell out of the scene, no more",
      "Fell out of the scene, moved"},
     {HappeningKind::enter, "Triggers entered, new", "Triggers entered, no more",
      "Triggers entered, moved"},
     {HappeningKind::leave, "Triggers left, new", "Triggers left, no more", "Triggers left, moved"},
     {HappeningKind::ground, "Stood on, new", "Stood on, no more", "Stood on, moved"}}};

void happeningSections(std::string& text, const WalkDifference& difference) {
  const auto tell = [&](const HappeningHeading& heading, const char* title, bool was, bool is) {
    section(text, title, difference.happenings, [&](const HappeningChange& change) {
      return change.kind == heading.kind && change.before.has_value() == was &&
             change.after.has_value() == is;
    });
  };
  for (const auto& heading : kHeadings) tell(heading, heading.appeared, false, true);
  for (const auto& heading : kHeadings) tell(heading, heading.gone, true, false);
  for (const auto& heading : kHeadings) tell(heading, heading.moved, true, true);
}

}  // namespace

std::string lineOf(const HappeningChange& change) {
  const Happening& told = change.after ? *change.after : *change.before;
  std::string line = clock(told.time) + "  " + told.a + (told.b.empty() ? "" : " - " + told.b) +
                     " at " + place(told.point);
  if (change.before && change.after) {
    if (change.shift > 0) line += ", " + metres(change.shift) + " from where it was";
    if (change.before->tick != change.after->tick) line += ", " + later(change.delay);
  } else if (change.kind == HappeningKind::contact) {
    if (change.otherwise)
      line += change.after ? ", passed it at " + metres(*change.otherwise) + " before"
                           : ", passes it at " + metres(*change.otherwise) + " now";
  }
  return line + (told.b.empty() ? "" : onlyIn(change.inModel));
}

std::string lineOf(const OrderChange& change) {
  const OrderEnd& told = change.after ? *change.after : *change.before;
  std::string line = told.avatar;
  if (told.tag != 0) line += ", order " + std::to_string(told.tag);  // of a script: its line
  line += ": " + (change.before ? outcomeOf(*change.before) : std::string("nothing")) + " -> " +
          (change.after ? outcomeOf(*change.after) : std::string("never ended"));
  if (change.before && change.after && change.before->kind == change.after->kind &&
      change.before->tick != change.after->tick)
    line += ", " + later(change.after->time - change.before->time);
  return line;
}

std::string lineOf(const ClearanceChange& change) {
  const auto distance = [](const std::optional<Nearest>& nearest) {
    return nearest ? metres(nearest->distance) : std::string("not near");
  };
  const Nearest& told = change.after ? *change.after : *change.before;
  return clock(told.time) + "  " + change.a + " - " + change.b + ": " + distance(change.before) +
         " -> " + distance(change.after) + " at " + place(told.point) + onlyIn(change.inModel);
}

std::string differenceText(const WalkDifference& difference) {
  std::string text = "before  " + headOf(difference.before) + "after   " + headOf(difference.after);
  if (difference.none() && difference.refused.empty()) return text + "\nno difference\n";
  text += difference.worse == 0 ? "\nnothing got worse\n"
                                : "\ngot worse: " + std::to_string(difference.worse) + "\n";
  if (difference.before.runs.size() != difference.after.runs.size())
    text += "the world began a different number of times; what both have is compared\n";
  section(text, "Orders that no longer go well", difference.orders,
          [](const OrderChange& change) { return change.worse; });
  section(text, "Nearer", difference.clearances,
          [](const ClearanceChange& change) { return change.least < 0; });
  happeningSections(text, difference);
  section(text, "Farther", difference.clearances,
          [](const ClearanceChange& change) { return change.least > 0; });
  section(text, "Orders that end otherwise", difference.orders,
          [](const OrderChange& change) { return !change.worse; });
  section(text, "Ways", difference.ways, [](const WayChange&) { return true; });
  section(text, "Commands that the model refused", difference.refused,
          [](const RefusedCommand&) { return true; });
  return text;
}

}  // namespace enfilade::server
