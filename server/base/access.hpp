// Who may do what: tokens with roles, and which web pages may connect.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::server {

/// Each may do what those before it may.
enum class Role : std::uint8_t {
  observe,  ///< look on: subscribe, pictures, rays, names, metrics
  drive,    ///< own avatars, command bodies, drive the clock
  admin     ///< begin the world anew
};

const char* nameOf(Role role);

struct Access {
  struct Token {
    Role role = Role::observe;
    std::string secret;
  };
  std::vector<Token> tokens;  ///< none: everyone is admin
  /// Names that browsers may call this server by, beside localhost and addresses in numbers: a page
  /// of a stranger may have its own name resolved to this machine (DNS rebinding).
  std::vector<std::string> hosts;
  std::vector<std::string> origins;  ///< pages of other origins that may connect: "https://a.org"
  bool insecure = false;  ///< addresses that others can reach may be listened on, without TLS
};

/// What the bearer of `token` may do; nullopt: it is none of ours. Takes as long for a wrong token
/// as for a right one of its length.
std::optional<Role> roleOf(const Access& access, std::string_view token);

/// Lines "ROLE TOKEN"; empty ones and those that begin with # are left out. Throws
/// std::runtime_error, naming the file and the line but not the token.
std::vector<Access::Token> readTokens(const std::filesystem::path& file);

/// Why a browser's request is refused by its Host and Origin (empty: it has none); nullopt: it may.
std::optional<std::string> foreignPage(const Access& access, std::string_view host,
                                       std::string_view origin);

}  // namespace enfilade::server
