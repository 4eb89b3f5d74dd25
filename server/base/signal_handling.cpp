#include "server/base/signal_handling.hpp"

#include <csignal>
#include <cstdio>
#include <exception>

namespace enfilade::server {
namespace {

volatile std::sig_atomic_t came = 0;

}  // namespace

bool interrupted() {
  return came != 0;
}

ExitCode interruptible(const std::function<ExitCode()>& work, const char* told) {
  struct sigaction action {};
  action.sa_handler = [](int) { came = 1; };
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  try {
    return work();
  } catch (const std::exception&) {
    if (!interrupted()) throw;
  } catch (const Interrupted&) {
  }
  std::fprintf(stderr, "interrupted; %s\n", told);
  return ExitCode::interrupted;
}

}  // namespace enfilade::server
