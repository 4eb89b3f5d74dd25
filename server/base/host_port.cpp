#include "server/base/host_port.hpp"

#include "server/base/parse_number.hpp"

namespace enfilade::server {

std::optional<HostPort> parseHostPort(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  const auto port = parseNumber<std::uint16_t>(std::string_view(text).substr(colon + 1));
  if (!port) return std::nullopt;
  HostPort endpoint{text.substr(0, colon), *port};
  const bool bracketed = endpoint.host.front() == '[' && endpoint.host.back() == ']';
  if (bracketed) endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
  if (endpoint.host.empty()) return std::nullopt;
  if (!bracketed && endpoint.host.find(':') != std::string::npos) return std::nullopt;
  return endpoint;
}

}  // namespace enfilade::server
