#include "server/base/access.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "scene/model/ascii.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMinTokenLength = 16;  // characters; shorter tokens are easy to guess

/// Constant-time comparison: the duration depends only on the length of `given`.
bool isEqualInConstantTime(std::string_view given, std::string_view secret) {
  unsigned differ = given.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto a = static_cast<unsigned char>(given[i]);
    const auto b = static_cast<unsigned char>(secret[i % secret.size()]);
    differ |= static_cast<unsigned>(a ^ b);
  }
  return differ == 0;
}

std::optional<Role> roleFromString(const std::string& name) {
  for (const Role role : {Role::observe, Role::drive, Role::admin})
    if (name == toString(role)) return role;
  return std::nullopt;
}

/// Removes the port from "name:port" or "[::1]:port".
std::string_view stripPort(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

bool isIpLiteral(std::string_view host) {
  if (host.starts_with('[') && host.ends_with(']')) return true;
  return !host.empty() && host.find_first_not_of("0123456789.") == std::string_view::npos;
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Names of hosts have no case (RFC 3986, 3.2.2).
bool containsHost(const std::vector<std::string>& hosts, std::string_view lowerName) {
  return std::any_of(hosts.begin(), hosts.end(), [&](const std::string& host) {
    return scene::toLowerCase(host) == lowerName;
  });
}

}  // namespace

const char* toString(Role role) {
  constexpr const char* names[] = {"observe", "drive", "admin"};
  return names[static_cast<int>(role)];
}

std::optional<Role> findRole(const Access& access, std::string_view token) {
  if (access.tokens.empty()) return Role::admin;
  std::optional<Role> role;
  for (const Access::Token& one : access.tokens)  // no early exit: constant time
    if (isEqualInConstantTime(token, one.secret)) role = one.role;
  return role;
}

std::vector<Access::Token> readTokens(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot read the tokens");
  std::vector<Access::Token> tokens;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::istringstream words(line);
    std::string role, secret, more;
    if (!(words >> role) || role.starts_with('#')) continue;
    words >> secret;
    const auto known = roleFromString(role);
    if (!known || secret.size() < kMinTokenLength || words >> more) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) +
                               ": give observe, drive or admin and a token of at least " +
                               std::to_string(kMinTokenLength) + " characters without blanks");
    }
    tokens.push_back({*known, secret});
  }
  if (tokens.empty()) throw std::runtime_error(file.string() + ": the file contains no token");
  return tokens;
}

std::optional<std::string> validateOrigin(const Access& access, std::string_view givenHost,
                                          std::string_view origin) {
  const std::string host = scene::toLowerCase(std::string(givenHost));
  const std::string_view name = stripPort(host);
  if (name != "localhost" && !isIpLiteral(name) && !containsHost(access.hosts, name))
    return "the host name '" + std::string(name) + "' is not allowed: see --allow-host";
  if (origin.empty() || contains(access.origins, origin)) return std::nullopt;
  const std::size_t start = origin.find("://");
  if (start != std::string_view::npos &&
      scene::toLowerCase(std::string(origin.substr(start + 3))) == host)
    return std::nullopt;
  return "pages of " + std::string(origin) + " may not connect: see --allow-origin";
}

}  // namespace enfilade::server
