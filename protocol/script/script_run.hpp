// Runs a walk script on a driver: in this process or over a socket.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocol/script/script.hpp"

namespace enfilade::protocol {

/// A picture that a script captured.
struct CapturedFrame {
  std::string name;  ///< Capture.as
  std::string avatar;
  std::uint64_t tag = 0;  ///< line number in the script
  v1::Frame description;
  std::vector<std::uint8_t> pixels;  ///< layout: Frame.planes
  std::string error;                 ///< not empty: reason for the missing picture
};

/// The result of one tick.
struct StepOutcome {
  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  std::uint64_t stateHash = 0;
  bool idle = false;
  std::vector<v1::ContactEvent> contacts;
  std::vector<v1::Notice> notices;
  std::vector<v1::AvatarState> avatars;  ///< ascending ids
  std::vector<CapturedFrame> frames;     ///< one per capture notice of this tick
};

/// A world that runs a script: in this process, or behind a socket.
class ScriptDriver {
 public:
  virtual ~ScriptDriver() = default;
  virtual double tickSeconds() const = 0;
  /// Submits a command for the next tick. Returns the reason if refused, else nullopt.
  virtual std::optional<v1::Error> submit(const v1::Command& command) = 0;
  virtual std::optional<v1::Error> submit(const v1::BodyCommand& command) = 0;
  virtual StepOutcome step() = 0;  ///< runs one tick
};

/// A line of the script that did not end as written.
struct LineOutcome {
  enum class Kind : std::uint8_t {
    refused,     ///< refused on submission or on execution
    blocked,     ///< a walk that made no progress
    dropped,     ///< its avatar's queue was dropped, for example after a refused spawn
    unfinished,  ///< ScriptLimits ended this wait
    uncaptured   ///< the picture could not be taken
  };
  Kind kind = Kind::refused;
  std::uint32_t line = 0;
  std::uint64_t tick = 0;
  std::string avatar;
  std::string text;  ///< message: "tour.jsonl:7: ann: blocked by Hall/Table#2 at (1, 0, 2)"
};

struct ScriptResult {
  std::uint64_t ticks = 0;
  double time = 0;  ///< seconds of simulated time
  std::uint64_t stateHash = 0;
  std::uint32_t spawned = 0, refused = 0, blocked = 0, arrived = 0, captured = 0;
  std::uint32_t dropped = 0;          ///< orders of dropped queues
  std::uint32_t uncaptured = 0;       ///< captures without a picture
  std::uint32_t unfinished = 0;       ///< waits that ScriptLimits ended
  std::vector<LineOutcome> outcomes;  ///< lines that did not end as written, in order of time
};

struct ScriptLimits {
  /// Maximum simulated time of one wait for idle, seconds.
  double untilIdle = 3600;
};

/// Progress of a script run.
struct ScriptProgress {
  std::size_t linesDone = 0, lines = 0;  ///< lines of the script; done: the order ended
  std::uint32_t line = 0;                ///< the line that ended last
};

/// Called after each tick. The observer may move data out of `outcome`.
using ScriptObserver = std::function<void(StepOutcome& outcome, const ScriptProgress& progress)>;

/// Runs a script: submits all lines up to a global wait, steps until idle, waits, and continues.
/// The end of the script also waits for idle. Refused lines are reported, and the script continues.
/// Exceptions of the driver propagate.
ScriptResult runScript(const Script& script, ScriptDriver& driver,
                       const ScriptObserver& observer = {}, const ScriptLimits& limits = {});

}  // namespace enfilade::protocol
