// ServerError: exception for an error of the server's configuration or network.
#pragma once

#include <stdexcept>

namespace enfilade::server {

/// The message names the address and the remedy.
struct ServerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace enfilade::server
