// A script action is the parsed content of one line of a walk script.
#pragma once

#include <variant>

#include "protocol/enfilade.pb.h"

namespace enfilade::protocol {

/// Waits until all queues are empty, and then for this simulated time.
struct GlobalWait {
  double seconds = 0;
};

using ScriptAction = std::variant<v1::Command, v1::BodyCommand, GlobalWait>;

}  // namespace enfilade::protocol
