#include "server/net/listener.hpp"

#include <boost/asio/io_context.hpp>

#include "collision/assert.hpp"
#include "server/base/server_error.hpp"
#include "server/log/log.hpp"
#include "server/net/protocol_detector.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

std::string formatHostPort(const HostPort& where) {
  return where.host + ":" + std::to_string(where.port);
}

tcp::endpoint resolveHostPort(const HostPort& where) {
  error_code problem;
  const std::string host = where.host == "localhost" ? "127.0.0.1" : where.host;
  const asio::ip::address address = asio::ip::make_address(host, problem);
  if (problem) {
    throw ServerError("cannot listen on " + formatHostPort(where) +
                      ": give a numeric address, such as 127.0.0.1, or localhost");
  }
  return {address, where.port};
}

tcp::acceptor openAcceptor(asio::io_context& context, const HostPort& where, const Access& access) {
  const tcp::endpoint endpoint = resolveProtected(where, access);
  tcp::acceptor acceptor(context);
  try {
    acceptor.open(endpoint.protocol());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw ServerError("cannot listen on " + formatHostPort(where) + ": " + error.code().message() +
                      "; is another server running? port 0 lets the system choose");
  }
  return acceptor;
}

}  // namespace

tcp::endpoint resolveProtected(const HostPort& where, const Access& access) {
  const tcp::endpoint endpoint = resolveHostPort(where);
  if (endpoint.address().is_loopback()) return endpoint;
  if (access.tokens.empty() || !access.insecure) {
    throw ServerError("will not listen on " + formatHostPort(where) +
                      ": other machines can reach that address, and the connection is not "
                      "encrypted. Use 127.0.0.1 with a tunnel (ssh -L) or a TLS proxy, or give "
                      "--token-file and --insecure");
  }
  return endpoint;
}

Listener::Listener(asio::io_context& context, const HostPort& where, WorldRegistry& worlds,
                   const ServerLimits& limits, Access access, PageFiles page)
    : acceptor_(openAcceptor(context, where, access)),
      port_(acceptor_.local_endpoint().port()),
      retryTimer_(context),
      context_{worlds, limits, std::move(access), std::move(page),
               std::make_shared<OutgoingBudget>(limits.totalOutgoingBytes)} {}

void Listener::start() {
  accept();
}

void Listener::accept() {
  acceptor_.async_accept([this](error_code problem, tcp::socket socket) {
    if (!acceptor_.is_open()) return;
    if (!problem) {
      acceptSocket(std::move(socket));
      return accept();
    }
    // Probably out of file descriptors: an immediate retry would spin.
    logError("cannot accept a connection: {}", problem.message());
    retryTimer_.expires_after(std::chrono::seconds(1));
    retryTimer_.async_wait([this](error_code stopped) {
      if (!stopped) accept();
    });
  });
}

/// Clients and idle connections share the limit; a connection without a Hello makes room for a new
/// one. Above the limit some connections are still read: health checks are answered, and all others
/// get the reason in their own protocol.
void Listener::acceptSocket(tcp::socket socket) {
  ENFILADE_ASSERT(!context_.closed);
  const auto detector = std::make_shared<ProtocolDetector>(std::move(socket), context_);
  registerConnection(context_, detector);
  const std::size_t limit = context_.limits.connections;
  while (context_.connections.size() > limit && evictAnonymous(*detector)) {
  }
  if (context_.connections.size() > limit + context_.limits.reservedConnections) {
    detector->evictIfAnonymous();
    context_.connections.pop_back();
    return;
  }
  if (context_.connections.size() > limit) detector->admitOnlyHealthChecks();
  detector->start();
}

/// Evicts the oldest connection without a Hello: idle connections must not block new clients.
bool Listener::evictAnonymous(const ClientConnection& newcomer) {
  for (auto weak = context_.connections.begin(); weak != context_.connections.end(); ++weak) {
    const auto connection = weak->lock();
    if (!connection || connection.get() == &newcomer || !connection->evictIfAnonymous()) continue;
    context_.connections.erase(weak);
    return true;
  }
  return false;
}

void Listener::stop() {
  error_code ignored;
  acceptor_.close(ignored);
  retryTimer_.cancel();
  context_.closed = true;
  const auto connections = context_.connections;  // a copy: end() may register a successor
  for (const auto& weak : connections) {
    if (const auto connection = weak.lock())
      connection->end(v1::ERROR_SHUTTING_DOWN, "the server is stopping");
  }
}

}  // namespace enfilade::server
