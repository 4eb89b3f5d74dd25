// Graceful interruption (SIGINT, SIGTERM) of runs that end on their own: a run stops at the next
// safe point and leaves complete files.
#pragma once

#include <functional>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

/// Whether SIGINT or SIGTERM arrived since runInterruptible() started.
bool isInterrupted();

/// Thrown by work that stops because of a signal.
struct Interrupted {};

/// Runs `work`, which polls isInterrupted(). Returns ExitCode::interrupted and prints `message` on
/// stderr if `work` throws Interrupted, or any exception after the signal. A terminal interrupts
/// the whole process group, so the import worker fails because of the signal.
ExitCode runInterruptible(const std::function<ExitCode()>& work, const char* message);

}  // namespace enfilade::server
