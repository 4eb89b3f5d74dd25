#include "server/base/signal_handling.hpp"

#include <csignal>
#include <cstdio>
#include <exception>

namespace enfilade::server {
namespace {

volatile std::sig_atomic_t signalReceived = 0;

}  // namespace

bool isInterrupted() {
  return signalReceived != 0;
}

ExitCode runInterruptible(const std::function<ExitCode()>& work, const char* message) {
  struct sigaction action {};
  action.sa_handler = [](int) { signalReceived = 1; };
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
