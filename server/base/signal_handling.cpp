#include "server/base/signal_handling.hpp"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>

namespace enfilade::server {
namespace {

// The handler may run in any thread, so a sig_atomic_t would not do.
std::atomic<bool> signalReceived = false;
static_assert(std::atomic<bool>::is_always_lock_free);

}  // namespace

bool isInterrupted() {
  return signalReceived;
}

ExitCode runInterruptible(const std::function<ExitCode()>& work, const char* message) {
  struct sigaction action {};
  action.sa_handler = [](int) { signalReceived = true; };
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  try {
    return work();
  } catch (const std::exception&) {
    if (!isInterrupted()) throw;
  } catch (const Interrupted&) {
  }
  std::fprintf(stderr, "interrupted; %s\n", message);
  return ExitCode::interrupted;
}

}  // namespace enfilade::server
