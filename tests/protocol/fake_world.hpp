// A simplified world for tests of drivers: orders take a fixed number of ticks. It logs each
// command with its tick, so that drivers can be compared.
//
// An avatar's name selects its behaviour: "stuck..." never arrives, "ghost..." cannot spawn,
// "restless..." is never idle, "blind..." cannot be captured. A speed above 10 is refused at once.
// Bodies execute commands instantly; no body is called "no-...".
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "protocol/script/script_run.hpp"

namespace enfilade::protocol {

class FakeWorld : public ScriptDriver {
 public:
  static constexpr std::uint64_t kWalkTicks = 5;   ///< for one waypoint
  static constexpr std::uint64_t kStuckTicks = 3;  ///< until a stuck walker gives up

  double tickSeconds() const override { return 1.0 / 60.0; }
  std::optional<v1::Error> submit(const v1::Command& command) override;
  std::optional<v1::Error> submit(const v1::BodyCommand& command) override;
  StepOutcome step() override;

  std::uint64_t getTick() const { return tick_; }
  const std::vector<std::string>& getDiary() const { return diary_; }

 private:
  struct Avatar {
    std::deque<v1::Command> queue;
    std::uint64_t ticksLeft = 0;  ///< of the first order
    bool begun = false;
    bool here = false;
    double x = 0;
  };

  void advance(const std::string& name, Avatar& avatar, StepOutcome& outcome);
  void end(const std::string& name, Avatar& avatar, StepOutcome& outcome);
  std::uint64_t computeTicks(const std::string& name, const v1::Command& command) const;

  std::uint64_t tick_ = 0;
  std::map<std::string, Avatar> avatars_;
  std::vector<std::string> diary_;
};

}  // namespace enfilade::protocol
