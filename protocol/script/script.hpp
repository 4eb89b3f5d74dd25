// Walk scripts: one JSON object a line (SCRIPT.md), read into commands and run on a driver. The
// same script gives the same commands at the same ticks whichever the driver is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"

namespace enfilade::protocol {

// ---- reading -----------------------------------------------------------------------------------

/// Until every queue is empty, then so many seconds of simulated time.
struct GlobalWait {
  double seconds = 0;
};

struct ScriptLine {
  std::uint32_t number = 0;  ///< from 1; also the command's tag
  std::variant<v1::Command, v1::BodyCommand, GlobalWait> what;
};

struct Script {
  std::string source;  ///< the file's name, for messages
  std::vector<ScriptLine> lines;
};

/// One line for each bad line of the script: "file:line: field: what is wrong; remedy".
struct ScriptError : std::runtime_error {
  ScriptError(const std::string& text, std::uint32_t firstBadLine);
  std::uint32_t line;  ///< of the first one; 0: of the file as a whole
};

/// Throws ScriptError.
Script readScript(const std::filesystem::path& file);
Script parseScript(std::string_view text, const std::string& source);

// ---- running -----------------------------------------------------------------------------------

/// A picture that a script asked for.
struct CapturedFrame {
  std::string name;  ///< Capture.as
  std::string avatar;
  std::uint64_t tag = 0;  ///< line of the script
  v1::Frame description;
  std::vector<std::uint8_t> pixels;  ///< as Frame.planes tell
  std::string error;                 ///< not empty: why there is no picture
};

/// What one tick told.
struct StepOutcome {
  std::uint64_t tick = 0;
  double time = 0;  ///< seconds
  std::uint64_t stateHash = 0;
  bool idle = false;
  std::vector<v1::ContactEvent> contacts;
  std::vector<v1::Notice> notices;
  std::vector<v1::AvatarState> avatars;  ///< ascending ids
  std::vector<CapturedFrame> frames;     ///< one for each capture notice, of exactly this tick
};

/// A world that a script can drive: in process, or behind a socket.
class ScriptDriver {
 public:
  virtual ~ScriptDriver() = default;
  virtual double tickSeconds() const = 0;
  /// Hands a command to the next tick. Why the world does not take it; nullopt when it does.
  virtual std::optional<v1::Error> submit(const v1::Command& command) = 0;
  virtual std::optional<v1::Error> submit(const v1::BodyCommand& command) = 0;
  virtual StepOutcome step() = 0;  ///< makes one tick
};

/// How a line of the script ended.
struct LineOutcome {
  enum class Kind : std::uint8_t {
    refused,     ///< not taken, or found impossible when its turn came
    blocked,     ///< a walk that made no progress
    dropped,     ///< its avatar's queue was dropped, as after a refused spawn
    unfinished,  ///< the bound of ScriptLimits ended this wait
    uncaptured   ///< no picture could be had
  };
  Kind kind = Kind::refused;
  std::uint32_t line = 0;
  std::uint64_t tick = 0;
  std::string avatar;
  std::string text;  ///< for a person: "tour.jsonl:7: ann: blocked by Hall/Table#2 at (1, 0, 2)"
};

struct ScriptResult {
  std::uint64_t ticks = 0;
  double time = 0;  ///< seconds of simulated time
  std::uint64_t stateHash = 0;
  std::uint32_t spawned = 0, refused = 0, blocked = 0, arrived = 0, captured = 0;
  std::uint32_t dropped = 0;          ///< orders of a dropped queue
  std::uint32_t uncaptured = 0;       ///< captures without a picture
  std::uint32_t unfinished = 0;       ///< waits that the bound ended
  std::vector<LineOutcome> outcomes;  ///< what did not go as written, in order of time
};

struct ScriptLimits {
  /// seconds of simulated time that one wait may take until all is idle.
  double untilIdle = 3600;
};

/// Where a run is.
struct ScriptProgress {
  std::size_t linesDone = 0, lines = 0;  ///< of the script; done: its order has ended
  std::uint32_t line = 0;                ///< the last one that ended
};

/// Called after each tick; `outcome` may be taken apart.
using ScriptObserver = std::function<void(StepOutcome& outcome, const ScriptProgress& progress)>;

/// Submits all lines up to a global wait at once, steps until idle, waits, and so on to the end of
/// the script, which waits until idle as well. Refused lines are told, and the script goes on.
/// What the driver throws passes through.
ScriptResult runScript(const Script& script, ScriptDriver& driver,
                       const ScriptObserver& observer = {}, const ScriptLimits& limits = {});

}  // namespace enfilade::protocol
