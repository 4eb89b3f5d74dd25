#include "server/net/http_session.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <utility>

#include "collision/assert.hpp"
#include "server/log/log.hpp"
#include "server/messages/decode_message.hpp"
#include "server/net/foxglove_session.hpp"
#include "server/net/http_pages.hpp"
#include "server/net/session.hpp"
#include "server/net/tcp_transport.hpp"
#include "server/net/websocket_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr const char* kMethods = "only GET and HEAD are supported";
constexpr std::uint32_t kMaxHeaderBytes = 16u << 10;  // bytes; a browser's cookies are below 8 KiB
constexpr std::uint64_t kMaxBodyBytes = 0;            // no request has a body
/// Written at once: a peer that takes this much within the message timeout is not stuck.
constexpr std::size_t kMaxWriteBytes = std::size_t{256} << 10;

Buffer makeBuffer(const std::string& text) {
  return std::make_shared<const std::vector<std::uint8_t>>(text.begin(), text.end());
}

/// Whether an error means that the world ended during the request, which is no client error.
bool hasWorldEnded(const TickLoop& world, v1::ErrorCode code) {
  return code == v1::ERROR_WORLD_DROPPED || code == v1::ERROR_SHUTTING_DOWN || world.failure();
}

std::string toStdString(boost::string_view view) {
  return {view.data(), view.size()};
}

}  // namespace

HttpSession::HttpSession(asio::ip::tcp::socket socket, const std::vector<std::uint8_t>& first,
                         ServerContext& context)
    : socket_(std::move(socket)),
      timer_(socket_.get_executor()),
      context_(context),
      peer_(formatPeerAddress(socket_) + " by HTTP") {
  parser_.header_limit(kMaxHeaderBytes);
  parser_.body_limit(kMaxBodyBytes);
  in_.commit(asio::buffer_copy(in_.prepare(first.size()), asio::buffer(first)));
}

HttpSession::~HttpSession() {
  if (streams_) --context_.streams;
}

void HttpSession::start(Clock::time_point deadline) {
  deadline_ = deadline;
  armTimer(deadline, 408, "no complete request before the deadline");
  http::async_read(
      socket_, in_, parser_, [self = shared_from_this()](error_code problem, std::size_t) {
        if (self->closed_ || self->answered_) return;
        if (!problem) return self->route(self->parser_.release());
        if (problem == http::error::header_limit)
          return self->refuse(431, "the request's header is too long");
        if (problem == http::error::body_limit) {
          const bool reads = self->parser_.get().method() == http::verb::get;
          return reads ? self->refuse(413, "requests must have no body")
                       : self->refuse(405, kMethods);
        }
        if (problem.category() == http::make_error_code(http::error::bad_method).category() &&
            problem != http::error::end_of_stream && problem != http::error::partial_message) {
          return self->refuse(400, "not a request: " + problem.message());
        }
        logInfo("{} left: {}", self->peer_, problem.message());
        self->close();
      });
}

void HttpSession::end(v1::ErrorCode, const std::string& reason) {
  if (closed_) return;
  if (answered_ || writing_) return close();  // in the middle of a stream of frames
  sendResponse(503, "text/plain", reason + "\n");
}

bool HttpSession::evictIfAnonymous() {
  if (closed_ || answered_ || awaitsFile_ || !replies_.empty()) return false;
  logWarning("{}: sent no request and was replaced by a new connection", peer_);
  close();
  return true;
}

// ---- requests ----------------------------------------------------------------------------------

void HttpSession::route(Request request) {
  if (request.count(http::field::host) > 1) return refuse(400, "the request has several hosts");
  const std::string host = toStdString(request[http::field::host]);
  const std::string origin = toStdString(request[http::field::origin]);
  if (const auto reason = validateOrigin(context_.access, host, origin))
    return refuse(403, *reason);
  // Without an Origin header: a picture or another element of a foreign page.
  if (origin.empty() && toStdString(request["Sec-Fetch-Site"]) == "cross-site" &&
      toStdString(request["Sec-Fetch-Mode"]) != "navigate")
    return refuse(403, "pages of other sites may not embed this: see --allow-origin");
  const Target target = parseTarget(toStdString(request.target()));
  path_ = target.path;
  ifNoneMatch_ = toStdString(request[http::field::if_none_match]);
  acceptEncoding_ = toStdString(request[http::field::accept_encoding]);
  const std::string token = extractToken(toStdString(request[http::field::authorization]), target);
  if (boost::beast::websocket::is_upgrade(request))
    return isFull_ ? refuse(503, kServerIsFull) : upgrade(std::move(request));
  headOnly_ = request.method() == http::verb::head;
  if (request.method() != http::verb::get && !headOnly_) return refuse(405, kMethods);
  const bool isHealthCheck = path_ == "/healthz" || path_ == "/metrics";
  if (isFull_ && !isHealthCheck) return refuse(503, kServerIsFull);
  if (path_.starts_with("/mjpeg") && context_.streams >= context_.limits.streams)
    return refuse(503, "the server has reached its limit of streams: try again later");
  if (servePage()) return;
  const auto role = findRole(context_.access, token);
  // /healthz is public, but names of worlds are not.
  mayShowNames_ = role.has_value();
  if (!role && (path_ != "/healthz" || target.query.contains("world")))
    return refuse(401, "this server requires a token");
  if (path_ == "/scene.glb") return requestSceneFile(target);
  const auto parsed = parseRequest(target);
  if (const auto* httpError = std::get_if<HttpError>(&parsed))
    return refuse(httpError->status, httpError->text);
  if (!findWorlds(target)) return refuse(404, "unknown world");
  armTimer(Clock::now() + context_.limits.messageTimeout, 503,
           "the tick loop did not answer in time");
  queryWorlds(std::get<v1::ClientMessage>(parsed), role.value_or(Role::observe));
}

/// Selects the worlds of the request: the named one; otherwise all for metrics, the main world for
/// frames.
bool HttpSession::findWorlds(const Target& target) {
  ENFILADE_ASSERT(replies_.empty());
  const auto named = target.query.find("world");
  const bool one = named != target.query.end() || path_.starts_with("/mjpeg");
  if (one) {
    replies_.emplace_back();
    replies_[0].world = context_.worlds.find(named == target.query.end() ? "" : named->second);
    return replies_[0].world != nullptr;
  }
  for (auto& world : context_.worlds.allWorlds()) replies_.emplace_back().world = std::move(world);
  return true;
}

void HttpSession::upgrade(Request request) {
  const Target target = parseTarget(toStdString(request.target()));
  const std::string token = extractToken(toStdString(request[http::field::authorization]), target);
  if (path_ != "/") return refuse(404, "the WebSocket is at /");
  // RFC 6455, 4.2.1: 16 bytes in base64.
  if (request[http::field::sec_websocket_key].size() != 24)
    return refuse(400, "Sec-WebSocket-Key must have 16 bytes, in base64");
  const std::string viewer = foxglove_protocol::chooseSubprotocol(
      toStdString(request[http::field::sec_websocket_protocol]));
  if (!viewer.empty()) return upgradeToViewer(std::move(request), viewer, target, token);
  closed_ = true;  // the session takes the socket
  timer_.cancel();
  const auto executor = socket_.get_executor();
  const auto session = std::make_shared<Session>(
      std::make_unique<WebSocketTransport>(std::move(socket_), std::move(request)), executor,
      context_);
  session->start(deadline_, token);
  registerConnection(context_, session);
}

/// The Foxglove protocol has no greeting of clients: token and world are parts of the address.
void HttpSession::upgradeToViewer(Request request, const std::string& subprotocol,
                                  const Target& target, const std::string& token) {
  const auto role = findRole(context_.access, token);
  if (!role) return refuse(401, "this server requires a token: ws://HOST:PORT/?token=TOKEN");
  const auto named = target.query.find("world");
  auto world = context_.worlds.find(named == target.query.end() ? "" : named->second);
  if (!world) return refuse(404, "unknown world");
  closed_ = true;  // the session takes the socket
  timer_.cancel();
  const auto session = std::make_shared<FoxgloveSession>(
      std::move(socket_), std::move(request), subprotocol, context_, std::move(world), *role);
  session->start();
  registerConnection(context_, session);
}

// ---- files --------------------------------------------------------------------------------------

/// Sends a file of the page. Files are public, like /healthz: the page itself asks for the token.
/// Returns false if the path names another resource.
bool HttpSession::servePage() {
  const auto file = context_.page.find(path_);
  if (file != context_.page.end()) {
    sendFile(file->second);
    return true;
  }
  if (path_ == "/") {
    refuse(404, kNoPage);
    return true;
  }
  if (!path_.starts_with("/page/")) return false;
  refuse(404, "the page has no such file");
  return true;
}

/// Waits for the scene's file without a timeout: it may be made first, and a peer that leaves is
/// noticed.
void HttpSession::requestSceneFile(const Target& target) {
  const auto named = target.query.find("world");
  const auto world = context_.worlds.find(named == target.query.end() ? "" : named->second);
  if (!world) return refuse(404, "unknown world");
  awaitsFile_ = true;
  timer_.expires_at(Clock::time_point::max());
  const bool compressed = acceptsGzip(acceptEncoding_);
  context_.worlds.getSceneFile(*world).request(
      compressed ? SceneFileKind::gzip : SceneFileKind::glb,
      [weak = weak_from_this(), executor = socket_.get_executor(),
       compressed](const SceneFile& file) {
        asio::post(executor, [weak, file, compressed] {
          if (const auto self = weak.lock()) self->sendSceneFile(file, compressed);
        });
      });
  watchDisconnect();
}

void HttpSession::sendSceneFile(const SceneFile& file, bool compressed) {
  awaitsFile_ = false;
  if (closed_ || answered_) return;
  if (!file.bytes) return refuse(500, "the scene cannot be written: " + file.error);
  sendFile({.bytes = file.bytes,
            .contentType = findContentType(path_),
            .tag = file.tag,
            .isCompressed = compressed,
            .mayBeCompressed = true,
            .isPage = false});
}

void HttpSession::sendFile(const HttpFile& file) {
  if (answered_) return;
  answered_ = true;
  if (matchesTag(ifNoneMatch_, file.tag)) return write(makeBuffer(makeNotModified(file)), true);
  if (!file.bytes->empty() && !headOnly_) body_ = file.bytes;
  write(makeBuffer(makeFileHeader(file)), !body_);
}

// ---- world queries -----------------------------------------------------------------------------

void HttpSession::queryWorlds(v1::ClientMessage request, Role role) {
  request.set_request_id(2);
  for (WorldReply& reply : replies_) {
    joinWorld(reply, role);
    if (reply.client != 0) reply.world->receive(reply.client, request, {});
    reply.ended = reply.client == 0;
  }
  watchDisconnect();
  pollReplies();
}

/// Joins as a guest: metrics requests must not keep a world with dropWhenEmpty alive.
void HttpSession::joinWorld(WorldReply& reply, Role role) {
  const auto wake = [weak = weak_from_this(), executor = socket_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) self->pollReplies();
    });
  };
  reply.queue = std::make_shared<OutgoingQueue>(makeOutgoingLimits(context_), makeBuffer(""), wake);
  reply.client = reply.world->join("http", role, reply.queue, 1, true);
}

void HttpSession::pollReplies() {
  for (WorldReply& reply : replies_) pollWorld(reply);
  const bool complete = std::all_of(replies_.begin(), replies_.end(), [](const WorldReply& reply) {
    return reply.metrics || reply.ended;
  });
  if (closed_ || answered_ || !complete) {
    if (complete && answered_ && !writing_) close();  // the world of a stream has ended
    return;
  }
  if (path_.starts_with("/mjpeg")) return refuse(503, "the world has ended");
  sendMetrics();
}

/// Handles the world's messages, one frame at a time. The tick loop drops waiting frames.
void HttpSession::pollWorld(WorldReply& reply) {
  while (!closed_ && !writing_ && !reply.ended) {
    const OutgoingQueue::Next next = reply.queue->pop();
    if (!next.message) return;
    reply.ended = next.last;
    if (auto decoded = decodeMessage(next.message))
      handleReply(reply, std::move(decoded->message), std::move(decoded->attachment));
  }
}

void HttpSession::handleReply(WorldReply& reply, v1::ServerMessage message,
                              std::vector<std::uint8_t> attachment) {
  if (message.has_error() && hasWorldEnded(*reply.world, message.error().code())) {
    reply.ended = true;  // other worlds may still answer
    return;
  }
  if (message.has_error()) {
    const bool missing = message.error().code() == v1::ERROR_UNKNOWN_AVATAR;
    return refuse(missing ? 404 : 400, message.error().message());
  }
  if (message.has_metrics()) reply.metrics = message.metrics();
  if (message.has_watch_frames()) {
    streams_ = true;
    ++context_.streams;
    // An avatar may enter later.
    return armTimer(Clock::now() + context_.limits.streamTimeout, 404,
                    "no picture within the time limit: is the avatar in the world?");
  }
  if (message.has_frame()) startStream(message.frame(), attachment);
}

/// Sends a picture; before the first one the header.
void HttpSession::startStream(const v1::Frame& frame, std::span<const std::uint8_t> attachment) {
  std::vector<std::uint8_t> part = makeMjpegPart(frame, attachment);
  lastPart_ = std::make_shared<const std::vector<std::uint8_t>>(part);
  if (!std::exchange(answered_, true)) {
    const std::string header = makeMjpegHeader();
    if (headOnly_) return write(makeBuffer(header), true);
    part.insert(part.begin(), header.begin(), header.end());
  }
  write(std::make_shared<const std::vector<std::uint8_t>>(std::move(part)), false);
}

/// Sends the last picture once more if none follows: Chromium shows a part when the next one
/// begins.
void HttpSession::waitForNextPart() {
  if (!lastPart_ || writing_ || closed_) return;
  timer_.expires_after(context_.limits.repeatDelay);
  timer_.async_wait([weak = weak_from_this()](error_code stopped) {
    const auto self = weak.lock();
    if (stopped || !self || self->writing_ || self->closed_ || !self->lastPart_) return;
    self->write(std::exchange(self->lastPart_, nullptr), false);
  });
}

/// Responds with the metrics of the active worlds. A failed world makes /healthz fail; a world
/// dropped meanwhile does not.
void HttpSession::sendMetrics() {
  std::vector<WorldMetrics> worldMetrics;
  for (WorldReply& reply : replies_) {
    const std::string& name = reply.world->identity().name;
    if (reply.world->failure() && path_ == "/healthz")
      return refuse(503, (mayShowNames_ ? "the world '" + name + "'" : "a world") +
                             " failed: drop it, or restart the server");
    if (reply.metrics) worldMetrics.push_back({name, std::move(*reply.metrics)});
  }
  if (worldMetrics.empty()) return refuse(503, "the world has ended");
  if (path_ == "/healthz") return sendResponse(200, "text/plain", "ok\n");
  sendResponse(200, kMetricsContentType, makeMetricsPage(worldMetrics));
}

// ---- responses ---------------------------------------------------------------------------------

void HttpSession::refuse(unsigned status, const std::string& reason) {
  if (answered_) return close();
  logWarning("{}: {} {}", peer_, status, reason);
  sendResponse(status, "text/plain", reason + "\n");
}

void HttpSession::sendResponse(unsigned status, const std::string& type, std::string body) {
  if (answered_) return;
  answered_ = true;
  std::string response = makeResponse(status, type, body);
  if (headOnly_) response.resize(response.size() - body.size());
  write(makeBuffer(response), true);
}

/// Writes the bytes from `offset` on, a part at a time: the timeout applies to each part.
void HttpSession::write(Buffer bytes, bool last, std::size_t offset) {
  writing_ = true;
  // Close if the peer does not read, as in the protocol's own sessions.
  timer_.expires_after(context_.limits.messageTimeout);
  timer_.async_wait([weak = weak_from_this()](error_code stopped) {
    const auto self = weak.lock();
    if (!stopped && self && self->writing_) self->close();
  });
  const auto view = asio::buffer(asio::buffer(*bytes) + offset, kMaxWriteBytes);
  asio::async_write(socket_, view,
                    [self = shared_from_this(), bytes = std::move(bytes), last, offset](
                        error_code problem, std::size_t written) mutable {
                      self->writing_ = false;
                      if (problem) return self->close();
                      offset += written;
                      if (offset < bytes->size())
                        return self->write(std::move(bytes), last, offset);
                      if (self->body_)
                        return self->write(std::exchange(self->body_, nullptr), true);
                      if (!last) {
                        self->timer_.cancel();
                        self->pollReplies();
                        return self->waitForNextPart();
                      }
                      error_code ignored;
                      self->socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
                      self->timer_.expires_after(self->context_.limits.closeTimeout);
                      self->timer_.async_wait([self](error_code) { self->close(); });
                      self->watchDisconnect();
                    });
}

/// Reads and discards data, to detect the end of the connection.
void HttpSession::watchDisconnect() {
  if (std::exchange(watching_, true)) return;
  socket_.async_read_some(asio::buffer(discarded_),
                          [self = shared_from_this()](error_code problem, std::size_t) {
                            if (self->closed_) return;
                            if (problem) return self->close();
                            self->watching_ = false;
                            self->watchDisconnect();
                          });
}

void HttpSession::armTimer(Clock::time_point deadline, unsigned status, std::string reason) {
  timer_.expires_at(deadline);
  timer_.async_wait(
      [weak = weak_from_this(), status, reason = std::move(reason)](error_code stopped) {
        const auto self = weak.lock();
        if (stopped || !self || self->closed_ || self->answered_) return;
        if (self->timer_.expiry() <= Clock::now()) self->refuse(status, reason);
      });
}

void HttpSession::close() {
  if (closed_) return;
  closed_ = true;
  timer_.cancel();
  error_code ignored;
  socket_.close(ignored);
  for (const WorldReply& reply : replies_)
    if (reply.client != 0) reply.world->leave(reply.client);
}

}  // namespace enfilade::server
