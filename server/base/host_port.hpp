// HostPort: a network address given as HOST:PORT on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace enfilade::server {

struct HostPort {
  std::string host;        ///< a name or an address; IPv6 without brackets
  std::uint16_t port = 0;  ///< 0: the system chooses (only for listening)
};

/// Parses `HOST:PORT` or `[IPV6]:PORT`; nullopt for any other text.
std::optional<HostPort> parseHostPort(const std::string& text);

}  // namespace enfilade::server
