// Access control: tokens with roles, and the web pages that may connect.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::server {

/// Each role includes the permissions of the roles before it.
enum class Role : std::uint8_t {
  observe,  ///< read only: subscriptions, frames, rays, names, metrics
  drive,    ///< owns avatars, commands bodies, drives the clock
  admin     ///< resets, creates and drops worlds
};

const char* toString(Role role);

struct Access {
  struct Token {
    Role role = Role::observe;
    std::string secret;
  };
  std::vector<Token> tokens;  ///< empty: every client is admin
  /// Host names that browsers may use for this server, in addition to localhost and IP addresses.
  /// The list prevents DNS rebinding: a foreign page may resolve its own name to this machine.
  std::vector<std::string> hosts;
  std::vector<std::string> origins;  ///< other origins whose pages may connect: "https://a.org"
  bool insecure = false;             ///< allows listening on non-loopback addresses without TLS
};

/// The role of the bearer of `token`; nullopt: unknown token. A wrong token takes as long as a
/// valid one of the same length.
std::optional<Role> findRole(const Access& access, std::string_view token);

/// Reads lines "ROLE TOKEN"; skips empty lines and lines that start with #. Throws
/// std::runtime_error, which names the file and the line but not the token.
std::vector<Access::Token> readTokens(const std::filesystem::path& file);

/// Checks the Host and Origin headers of a browser's request (`origin` empty: no header). Returns
/// the reason of a refusal; nullopt: allowed.
std::optional<std::string> validateOrigin(const Access& access, std::string_view host,
                                          std::string_view origin);

}  // namespace enfilade::server
