// Fuzz target of our own HTTP parsing: the request's target, and the headers that decide on access.
// The lines of the input are target, Authorization, Host, Origin, If-None-Match and
// Accept-Encoding.
#include <array>
#include <string_view>

#include "server/base/access.hpp"
#include "server/net/http_file.hpp"
#include "server/net/http_pages.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace enfilade::fuzz {
namespace {

std::string_view takeLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

server::Access makeTwoTokens() {
  server::Access access;
  access.tokens = {{server::Role::observe, "0123456789abcdef"},
                   {server::Role::drive, "fedcba9876543210"}};
  access.hosts = {"walk.example"};
  access.origins = {"https://page.example"};
  return access;
}

}  // namespace

void tryBytes(std::span<const std::uint8_t> bytes) {
  static const server::Access access = makeTwoTokens();
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const server::Target target = server::parseTarget(takeLine(text));
  const std::string token = server::extractToken(takeLine(text), target);
  const auto role = server::findRole(access, token);
  require(!role || token == "0123456789abcdef" || token == "fedcba9876543210",
          "only a token opens");
  const std::string_view host = takeLine(text), origin = takeLine(text);
  const auto why = server::validateOrigin(access, host, origin);
  require(!why || !why->empty(), "a refusal has a reason");
  const std::string_view ifNoneMatch = takeLine(text), acceptEncoding = takeLine(text);
  require(!server::matchesTag(ifNoneMatch, "a") || ifNoneMatch.find_first_of("a*") != text.npos,
          "a match names the tag, or all");
  require(!server::acceptsGzip(acceptEncoding) || acceptEncoding.find("gzip") != text.npos,
          "gzip is sent to clients that name it");
  server::findContentType(target.path);
  const auto asked = server::parseRequest(target);
  if (const auto* problem = std::get_if<server::HttpError>(&asked)) {
    require(problem->status >= 400 && problem->status < 600, "a refusal has an error status");
    server::makeResponse(problem->status, "text/plain", problem->text);
  }
}

}  // namespace enfilade::fuzz
