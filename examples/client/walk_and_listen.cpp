// walk_and_listen PORT: drives an avatar until an obstacle blocks it, and prints its contacts.
#include <cstdio>
#include <cstdlib>

#include "protocol/clients/cpp/async_client.hpp"

using namespace enfilade;
using namespace enfilade::protocol;
int main(int, char** arguments) {
  const int port = std::atoi(arguments[1] ? arguments[1] : "7878");
  bool stopped = false;
  AsyncHandlers handlers;
  handlers.closed = [](const v1::Error& reason) { std::puts(reason.message().c_str()); };
  handlers.events = [&](const v1::TickEvents& events) {
    for (const v1::ContactEvent& contact : events.contacts()) {
      std::printf("%.3f s: %s %s %s\n", contact.time(),
                  v1::ContactEvent::Kind_Name(contact.kind()).c_str(), contact.a_name().c_str(),
                  contact.b_name().c_str());
      stopped = stopped || contact.kind() == v1::ContactEvent::KIND_BLOCKED;
    }
  };
  AsyncClient client("127.0.0.1", static_cast<std::uint16_t>(port), handlers);

  v1::ClientMessage listen, spawn, step, drive;
  listen.mutable_subscribe()->set_contacts(true);
  spawn.mutable_command()->set_avatar("ann");
  spawn.mutable_command()->mutable_spawn()->mutable_at()->set_x(1.5);
  step.mutable_step()->set_ticks(1);
  drive.mutable_command()->set_avatar("ann");
  drive.mutable_command()->mutable_drive()->mutable_velocity()->set_x(1);
  drive.mutable_command()->mutable_drive()->mutable_velocity()->set_z(1);
  for (const auto& request : {listen, spawn, step, drive}) client.request(request, [](Reply) {});
  for (int tick = 0; tick < 600 && !stopped; ++tick) {
    client.request(step, [](Reply) {});
    while (client.pendingRequests() > 0 && client.run(std::chrono::seconds(10))) {
    }
  }
  return stopped ? 0 : 1;
}
