// Runs a script tick by tick. What is submitted when depends on the script and on `idle` alone,
// never on wall-clock time, so that every driver sees the same commands at the same ticks.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>

#include "protocol/script/script.hpp"

namespace enfilade::protocol {
namespace {

/// A wait of a whole number of ticks, as 0.1 s of 1/60 s, is not made longer by rounding.
constexpr double kWholeTicks = 1e-9;  // relative

std::uint64_t ticksFor(double seconds, double tick) {
  return static_cast<std::uint64_t>(std::ceil(seconds / tick * (1 - kWholeTicks)));
}

std::string pointText(const v1::Vec3& point) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), "(%.2f, %.2f, %.2f)", point.x(), point.y(), point.z());
  return text.data();
}

class Run {
 public:
  Run(const Script& script, ScriptDriver& driver, const ScriptObserver& observer,
      const ScriptLimits& limits)
      : script_(script), driver_(driver), observer_(observer), limits_(limits) {
    progress_.lines = script.lines.size();
  }

  ScriptResult run() {
    for (const ScriptLine& line : script_.lines) {
      if (const auto* wait = std::get_if<GlobalWait>(&line.what)) {
        stepUntilIdle(line.number);
        const std::uint64_t ticks = ticksFor(wait->seconds, driver_.tickSeconds());
        for (std::uint64_t i = 0; i < ticks; ++i) step();
        lineDone(line.number);
      } else if (const auto* order = std::get_if<v1::BodyCommand>(&line.what)) {
        submit(line.number, *order);
      } else {
        submit(line.number, std::get<v1::Command>(line.what));
      }
    }
    if (!script_.lines.empty()) stepUntilIdle(script_.lines.back().number);
    for (const auto& [avatar, absent] : absent_) tellDropped(avatar, absent);
    return std::move(result_);
  }

 private:
  /// An avatar whose spawn was refused: what else it was told is dropped, and told once.
  struct Absent {
    std::uint32_t spawnLine = 0;
    std::uint32_t firstLine = 0;  ///< of those dropped
    std::uint32_t dropped = 0;

    void drop(std::uint32_t line) {
      if (dropped++ == 0) firstLine = line;
    }
  };

  void tellDropped(const std::string& avatar, const Absent& absent) {
    if (absent.dropped == 0) return;
    std::string what =
        "not done: its spawn of line " + std::to_string(absent.spawnLine) + " was refused";
    if (absent.dropped > 1)
      what += "; nor is what it is told in " + std::to_string(absent.dropped - 1) + " lines more";
    tell(LineOutcome::Kind::dropped, absent.firstLine, avatar, what);
  }

  void submit(std::uint32_t line, const v1::Command& command) {
    const auto found = absent_.find(command.avatar());
    if (found != absent_.end() && command.has_spawn()) {
      tellDropped(found->first, found->second);
      absent_.erase(found);
    } else if (found != absent_.end()) {
      ++result_.dropped;
      found->second.drop(line);
      lineDone(line);
      return;
    }
    if (const auto error = driver_.submit(command)) {
      ++result_.refused;
      if (command.has_spawn()) absent_[command.avatar()] = {line, 0, 0};
      tell(LineOutcome::Kind::refused, line, command.avatar(),
           "refused: " + (error->field().empty() ? "" : error->field() + ": ") + error->message());
      lineDone(line);
      return;
    }
    open_.emplace(line, command.avatar());
    if (command.has_spawn()) spawns_.insert(line);
    idle_ = false;
  }

  /// Nothing is heard of it later: the line has ended when it is taken.
  void submit(std::uint32_t line, const v1::BodyCommand& command) {
    if (const auto error = driver_.submit(command)) {
      ++result_.refused;
      tell(LineOutcome::Kind::refused, line, command.body(), "refused: " + error->message());
    } else {
      idle_ = false;
    }
    lineDone(line);
  }

  /// Why the world is not at rest, as far as the script's own lines tell.
  std::string whoGoesOn() const {
    if (open_.empty())
      return "somebody still falls, or a body moves ({\"body\":NAME,\"do\":\"stop\"} stops one)";
    const auto& [line, avatar] = *open_.begin();
    const std::string others =
        open_.size() == 1 ? "" : " and " + std::to_string(open_.size() - 1) + " more";
    return "line " + std::to_string(line) + " (" + avatar + ")" + others + " has not ended";
  }

  void stepUntilIdle(std::uint32_t line) {
    const std::uint64_t most = ticksFor(limits_.untilIdle, driver_.tickSeconds());
    for (std::uint64_t i = 0; i < most && !idle_; ++i) step();
    if (!idle_) {
      ++result_.unfinished;
      std::array<char, 64> seconds{};
      std::snprintf(seconds.data(), seconds.size(), "%g", limits_.untilIdle);
      tell(LineOutcome::Kind::unfinished, line, "",
           "after " + std::string(seconds.data()) + " s of simulated time " + whoGoesOn() +
               "; the script goes on");
      return;
    }
    for (const auto& [number, avatar] : open_) {
      ++result_.dropped;
      lineDone(number);
      if (const auto found = absent_.find(avatar); found != absent_.end()) {
        found->second.drop(number);
        continue;
      }
      tell(LineOutcome::Kind::dropped, number, avatar,
           "not done: its avatar left the world, or never came into it");
    }
    open_.clear();
  }

  void step() {
    StepOutcome outcome = driver_.step();
    ++result_.ticks;
    result_.time = static_cast<double>(result_.ticks) * driver_.tickSeconds();
    result_.stateHash = outcome.stateHash;
    idle_ = outcome.idle;
    tick_ = outcome.tick;
    for (const v1::Notice& notice : outcome.notices) hear(notice);
    for (const CapturedFrame& frame : outcome.frames) count(frame);
    if (observer_) observer_(outcome, progress_);
  }

  /// A notice with the tag and the avatar of a submitted line ends that line.
  void hear(const v1::Notice& notice) {
    const auto found = open_.find(static_cast<std::uint32_t>(notice.tag()));
    if (notice.tag() > 0xFFFF'FFFFu || found == open_.end() || found->second != notice.avatar()) {
      return;
    }
    const std::uint32_t line = found->first;
    switch (notice.kind()) {
      case v1::Notice::KIND_SPAWNED:
        ++result_.spawned;
        break;
      case v1::Notice::KIND_ARRIVED:
        ++result_.arrived;
        break;
      case v1::Notice::KIND_REFUSED:
        ++result_.refused;
        if (spawns_.contains(line)) absent_[notice.avatar()] = {line, 0, 0};
        tell(LineOutcome::Kind::refused, line, notice.avatar(), "refused: " + notice.text());
        break;
      case v1::Notice::KIND_BLOCKED:
        ++result_.blocked;
        tell(LineOutcome::Kind::blocked, line, notice.avatar(),
             (notice.obstacle_name().empty() ? "blocked: " + notice.text()
                                             : "blocked by " + notice.obstacle_name()) +
                 " at " + pointText(notice.position()));
        break;
      case v1::Notice::KIND_DROPPED:
        return;  // told with all that came to nothing
      default:
        break;
    }
    open_.erase(found);
    lineDone(line);
  }

  void count(const CapturedFrame& frame) {
    if (frame.error.empty()) {
      ++result_.captured;
      return;
    }
    ++result_.uncaptured;
    tell(LineOutcome::Kind::uncaptured, static_cast<std::uint32_t>(frame.tag), frame.avatar,
         "no picture \"" + frame.name + "\": " + frame.error);
  }

  void tell(LineOutcome::Kind kind, std::uint32_t line, const std::string& avatar,
            const std::string& what) {
    result_.outcomes.push_back({kind, line, tick_, avatar,
                                script_.source + ":" + std::to_string(line) + ": " +
                                    (avatar.empty() ? "" : avatar + ": ") + what});
  }

  void lineDone(std::uint32_t line) {
    ++progress_.linesDone;
    progress_.line = line;
  }

  const Script& script_;
  ScriptDriver& driver_;
  const ScriptObserver& observer_;
  const ScriptLimits& limits_;
  ScriptResult result_;
  ScriptProgress progress_;
  std::map<std::uint32_t, std::string> open_;  ///< submitted lines that have not ended; avatars
  std::set<std::uint32_t> spawns_;             ///< submitted lines that spawn
  std::map<std::string, Absent> absent_;
  bool idle_ = true;
  std::uint64_t tick_ = 0;
};

}  // namespace

ScriptResult runScript(const Script& script, ScriptDriver& driver, const ScriptObserver& observer,
                       const ScriptLimits& limits) {
  return Run(script, driver, observer, limits).run();
}

}  // namespace enfilade::protocol
