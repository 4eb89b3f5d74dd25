// Runs a script tick by tick. The submission ticks depend only on the script and on `idle`, never
// on wall-clock time. All drivers therefore get the same commands at the same ticks.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>

#include "protocol/script/script_run.hpp"

namespace enfilade::protocol {
namespace {

/// Tolerance so that rounding does not lengthen a wait of whole ticks, such as 0.1 s at 1/60 s.
constexpr double kTickRounding = 1e-9;  // relative

std::uint64_t countTicks(double seconds, double tick) {
  return static_cast<std::uint64_t>(std::ceil(seconds / tick * (1 - kTickRounding)));
}

std::string formatPoint(const v1::Vec3& point) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), "[%.2f, %.2f, %.2f]", point.x(), point.y(), point.z());
  return text.data();
}

class ScriptRun {
 public:
  ScriptRun(const Script& script, ScriptDriver& driver, const ScriptObserver& observer,
            const ScriptLimits& limits)
      : script_(script), driver_(driver), observer_(observer), limits_(limits) {
    progress_.lines = script.lines.size();
  }

  ScriptResult execute() {
    for (const ScriptLine& line : script_.lines) {
      if (const auto* wait = std::get_if<GlobalWait>(&line.action)) {
        stepUntilIdle(line.number);
        const std::uint64_t ticks = countTicks(wait->seconds, driver_.tickSeconds());
        for (std::uint64_t i = 0; i < ticks; ++i) step();
        finishLine(line.number);
      } else if (const auto* order = std::get_if<v1::BodyCommand>(&line.action)) {
        submit(line.number, *order);
      } else {
        submit(line.number, std::get<v1::Command>(line.action));
      }
    }
    if (!script_.lines.empty()) stepUntilIdle(script_.lines.back().number);
    for (const auto& [avatar, absent] : absentAvatars_) reportDropped(avatar, absent);
    return std::move(result_);
  }

 private:
  /// An avatar whose spawn was refused. Its other orders are dropped and reported once.
  struct AbsentAvatar {
    std::uint32_t spawnLine = 0;
    std::uint32_t firstLine = 0;  ///< first dropped line
    std::uint32_t dropped = 0;

    void drop(std::uint32_t line) {
      if (dropped++ == 0) firstLine = line;
    }
  };

  void reportDropped(const std::string& avatar, const AbsentAvatar& absent) {
    if (absent.dropped == 0) return;
    std::string text =
        "not done: its spawn of line " + std::to_string(absent.spawnLine) + " was refused";
    if (absent.dropped > 1)
      text += ", and " + std::to_string(absent.dropped - 1) +
              " more lines of this avatar were "
              "dropped";
    addOutcome(LineOutcome::Kind::dropped, absent.firstLine, avatar, text);
  }

  void submit(std::uint32_t line, const v1::Command& command) {
    const auto found = absentAvatars_.find(command.avatar());
    if (found != absentAvatars_.end() && command.has_spawn()) {
      reportDropped(found->first, found->second);
      absentAvatars_.erase(found);
    } else if (found != absentAvatars_.end()) {
      ++result_.dropped;
      found->second.drop(line);
      finishLine(line);
      return;
    }
    if (const auto error = driver_.submit(command)) {
      ++result_.refused;
      if (command.has_spawn()) absentAvatars_[command.avatar()] = {line, 0, 0};
      addOutcome(
          LineOutcome::Kind::refused, line, command.avatar(),
          "refused: " + (error->field().empty() ? "" : error->field() + ": ") + error->message());
      finishLine(line);
      return;
    }
    openLines_.emplace(line, command.avatar());
    if (command.has_spawn()) spawns_.insert(line);
    idle_ = false;
  }

  /// No notice follows for a body command, so that the line ends when it is accepted.
  void submit(std::uint32_t line, const v1::BodyCommand& command) {
    if (const auto error = driver_.submit(command)) {
      ++result_.refused;
      addOutcome(LineOutcome::Kind::refused, line, command.body(), "refused: " + error->message());
    } else {
      idle_ = false;
    }
    finishLine(line);
  }

  /// Describes the reason why the world is not idle, from the script's own lines.
  std::string describeUnfinished() const {
    if (openLines_.empty())
      return "an avatar still falls, or a body moves ({\"body\":NAME,\"do\":\"stop\"} stops one)";
    const auto& [line, avatar] = *openLines_.begin();
    const std::string others =
        openLines_.size() == 1 ? "" : " and " + std::to_string(openLines_.size() - 1) + " more";
    return "line " + std::to_string(line) + " (" + avatar + ")" + others + " has not ended";
  }

  void stepUntilIdle(std::uint32_t line) {
    const std::uint64_t maxTicks = countTicks(limits_.untilIdle, driver_.tickSeconds());
    for (std::uint64_t i = 0; i < maxTicks && !idle_; ++i) step();
    if (!idle_) {
      ++result_.unfinished;
      std::array<char, 64> seconds{};
      std::snprintf(seconds.data(), seconds.size(), "%g", limits_.untilIdle);
      addOutcome(LineOutcome::Kind::unfinished, line, "",
                 "after " + std::string(seconds.data()) + " s of simulated time " +
                     describeUnfinished() + "; the script continues");
      return;
    }
    for (const auto& [number, avatar] : openLines_) {
      ++result_.dropped;
      finishLine(number);
      if (const auto found = absentAvatars_.find(avatar); found != absentAvatars_.end()) {
        found->second.drop(number);
        continue;
      }
      addOutcome(LineOutcome::Kind::dropped, number, avatar,
                 "not done: its avatar left the world or never entered it");
    }
    openLines_.clear();
  }

  void step() {
    StepOutcome outcome = driver_.step();
    ++result_.ticks;
    result_.time = static_cast<double>(result_.ticks) * driver_.tickSeconds();
    result_.stateHash = outcome.stateHash;
    idle_ = outcome.idle;
    tick_ = outcome.tick;
    for (const v1::Notice& notice : outcome.notices) handleNotice(notice);
    for (const CapturedFrame& frame : outcome.frames) countCapture(frame);
    if (observer_) observer_(outcome, progress_);
  }

  /// Handles a notice. Its tag and avatar identify the submitted line that it ends.
  void handleNotice(const v1::Notice& notice) {
    const auto found = openLines_.find(static_cast<std::uint32_t>(notice.tag()));
    if (notice.tag() > 0xFFFF'FFFFu || found == openLines_.end() ||
        found->second != notice.avatar()) {
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
        if (spawns_.contains(line)) absentAvatars_[notice.avatar()] = {line, 0, 0};
        addOutcome(LineOutcome::Kind::refused, line, notice.avatar(), "refused: " + notice.text());
        break;
      case v1::Notice::KIND_BLOCKED:
        ++result_.blocked;
        addOutcome(LineOutcome::Kind::blocked, line, notice.avatar(),
                   (notice.obstacle_name().empty() ? "blocked: " + notice.text()
                                                   : "blocked by " + notice.obstacle_name()) +
                       " at " + formatPoint(notice.position()));
        break;
      case v1::Notice::KIND_DROPPED:
        return;  // reported with all dropped orders
      default:
        break;
    }
    openLines_.erase(found);
    finishLine(line);
  }

  void countCapture(const CapturedFrame& frame) {
    if (frame.error.empty()) {
      ++result_.captured;
      return;
    }
    ++result_.uncaptured;
    addOutcome(LineOutcome::Kind::uncaptured, static_cast<std::uint32_t>(frame.tag), frame.avatar,
               "no picture \"" + frame.name + "\": " + frame.error);
  }

  void addOutcome(LineOutcome::Kind kind, std::uint32_t line, const std::string& avatar,
                  const std::string& text) {
    result_.outcomes.push_back({kind, line, tick_, avatar,
                                script_.source + ":" + std::to_string(line) + ": " +
                                    (avatar.empty() ? "" : avatar + ": ") + text});
  }

  void finishLine(std::uint32_t line) {
    ++progress_.linesDone;
    progress_.line = line;
  }

  const Script& script_;
  ScriptDriver& driver_;
  const ScriptObserver& observer_;
  const ScriptLimits& limits_;
  ScriptResult result_;
  ScriptProgress progress_;
  std::map<std::uint32_t, std::string> openLines_;  ///< submitted lines that have not ended, with
                                                    ///< their avatars
  std::set<std::uint32_t> spawns_;                  ///< submitted lines that spawn
  std::map<std::string, AbsentAvatar> absentAvatars_;
  bool idle_ = true;
  std::uint64_t tick_ = 0;
};

}  // namespace

ScriptResult runScript(const Script& script, ScriptDriver& driver, const ScriptObserver& observer,
                       const ScriptLimits& limits) {
  return ScriptRun(script, driver, observer, limits).execute();
}

}  // namespace enfilade::protocol
