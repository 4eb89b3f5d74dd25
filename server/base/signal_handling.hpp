// Ctrl-C of a run that ends by itself, or a time limit (SIGTERM): it stops at the next good place
// and leaves whole files.
#pragma once

#include <functional>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

/// Whether SIGINT or SIGTERM came since interruptible() began.
bool interrupted();

/// Thrown by work that stops because of it.
struct Interrupted {};

/// Does `work`, which looks at interrupted() now and then. ExitCode::interrupted when it throws
/// Interrupted, or anything after the signal: a terminal interrupts the whole group, and the
/// importer's child fails of it, not of its file. `told` is then said on stderr.
ExitCode interruptible(const std::function<ExitCode()>& work, const char* told);

}  // namespace enfilade::server
