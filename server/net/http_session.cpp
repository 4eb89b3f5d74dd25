#include "server/net/http_session.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <utility>

#include "protocol/framing.hpp"
#include "server/net/http_pages.hpp"
#include "server/net/session.hpp"
#include "server/net/tcp_transport.hpp"
#include "server/net/websocket_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

namespace {

constexpr std::uint32_t kLargestHead = 16u << 10;  // bytes; a browser's cookies are below 8 KiB
constexpr std::uint64_t kLargestBody = 0;          // nothing here takes any

Buffer bufferOf(const std::string& text) {
  return std::make_shared<const std::vector<std::uint8_t>>(text.begin(), text.end());
}

/// The world of a request went while it was asked: a fault of nobody's who asks.
bool hasEnded(const TickLoop& world, v1::ErrorCode code) {
  return code == v1::ERROR_WORLD_DROPPED || code == v1::ERROR_SHUTTING_DOWN || world.failure();
}

std::string textOf(boost::string_view view) {
  return {view.data(), view.size()};
}

}  // namespace

HttpVisit::HttpVisit(asio::ip::tcp::socket socket, const std::vector<std::uint8_t>& first,
                     Reception& reception)
    : socket_(std::move(socket)),
      timer_(socket_.get_executor()),
      reception_(reception),
      peer_(addressOf(socket_) + " by HTTP") {
  parser_.header_limit(kLargestHead);
  parser_.body_limit(kLargestBody);
  in_.commit(asio::buffer_copy(in_.prepare(first.size()), asio::buffer(first)));
}

HttpVisit::~HttpVisit() = default;

void HttpVisit::start(Clock::time_point deadline) {
  deadline_ = deadline;
  armTimer(deadline, 408, "the request did not come in time");
  http::async_read(
      socket_, in_, parser_, [self = shared_from_this()](error_code problem, std::size_t) {
        if (self->closed_ || self->answered_) return;
        if (!problem) return self->route(self->parser_.release());
        if (problem == http::error::header_limit)
          return self->refuse(431, "the request's head is too long");
        if (problem == http::error::body_limit)
          return self->refuse(413, "requests have no body here");
        if (problem.category() == http::make_error_code(http::error::bad_method).category() &&
            problem != http::error::end_of_stream && problem != http::error::partial_message) {
          return self->refuse(400, "not a request: " + problem.message());
        }
        spdlog::info("{} left: {}", self->peer_, problem.message());
        self->close();
      });
}

void HttpVisit::end(v1::ErrorCode, const std::string& reason) {
  if (closed_) return;
  if (answered_ || writing_) return close();  // in the middle of a stream of pictures
  answer(503, "text/plain", reason + "\n");
}

bool HttpVisit::giveWay() {
  if (closed_ || answered_ || !ears_.empty()) return false;
  spdlog::warn("{}: asked nothing, and a newcomer takes its place", peer_);
  close();
  return true;
}

// ---- what is asked -----------------------------------------------------------------------------

void HttpVisit::route(Request request) {
  const std::string host = textOf(request[http::field::host]);
  const std::string origin = textOf(request[http::field::origin]);
  if (const auto why = foreignPage(reception_.access, host, origin)) return refuse(403, *why);
  const Target target = targetOf(textOf(request.target()));
  path_ = target.path;
  const std::string token = tokenOf(textOf(request[http::field::authorization]), target);
  if (boost::beast::websocket::is_upgrade(request)) return upgrade(std::move(request));
  if (request.method() != http::verb::get) return refuse(405, "only GET is taken");
  const auto role = roleOf(reception_.access, token);
  // Whether all is well may be known to all, but not what there is.
  mayHearNames_ = role.has_value();
  if (!role && (path_ != "/healthz" || target.query.contains("world")))
    return refuse(401, "this server wants a token");
  const auto asked = requestFor(target);
  if (const auto* why = std::get_if<PageProblem>(&asked)) return refuse(why->status, why->text);
  if (!findWorlds(target)) return refuse(404, "there is no world of this name");
  armTimer(Clock::now() + reception_.limits.message, 503, "the tick loop did not answer in time");
  ask(std::get<v1::ClientMessage>(asked), role.value_or(Role::observe));
}

/// Those that are asked: the one that is named, for metrics else all, for pictures the main one.
bool HttpVisit::findWorlds(const Target& target) {
  const auto named = target.query.find("world");
  const bool one = named != target.query.end() || path_.starts_with("/mjpeg");
  if (one) {
    ears_.emplace_back();
    ears_[0].world = reception_.worlds.find(named == target.query.end() ? "" : named->second);
    return ears_[0].world != nullptr;
  }
  for (auto& world : reception_.worlds.all()) ears_.emplace_back().world = std::move(world);
  return true;
}

void HttpVisit::upgrade(Request request) {
  const std::string token =
      tokenOf(textOf(request[http::field::authorization]), targetOf(textOf(request.target())));
  if (path_ != "/") return refuse(404, "the WebSocket is at /");
  closed_ = true;  // the socket goes to somebody else
  timer_.cancel();
  const auto executor = socket_.get_executor();
  const auto session = std::make_shared<Session>(
      std::make_unique<WebSocketWire>(std::move(socket_), std::move(request)), executor,
      reception_);
  session->start(deadline_, token);
  enlist(reception_, session);
}

// ---- asking the world --------------------------------------------------------------------------

void HttpVisit::ask(v1::ClientMessage request, Role role) {
  request.set_request_id(2);
  for (Ear& ear : ears_) {
    join(ear, role);
    if (ear.client != 0) ear.world->receive(ear.client, request, {});
    ear.ended = ear.client == 0;
  }
  noticeLeaving();
  hear();
}

/// As a guest: nobody's world lasts because somebody looks at its metrics.
void HttpVisit::join(Ear& ear, Role role) {
  const auto wake = [weak = weak_from_this(), executor = socket_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) self->hear();
    });
  };
  const ServerLimits& limits = reception_.limits;
  ear.heard = std::make_shared<OutgoingQueue>(
      OutgoingBounds{limits.outgoingBytes, limits.outgoingFrames, limits.outgoingFrameBytes},
      bufferOf(""), wake);
  ear.client = ear.world->join("http", role, ear.heard, 1, true);
}

void HttpVisit::hear() {
  for (Ear& ear : ears_) hear(ear);
  const bool told = std::all_of(ears_.begin(), ears_.end(),
                                [](const Ear& ear) { return ear.metrics || ear.ended; });
  if (closed_ || answered_ || !told) {
    if (told && answered_ && !writing_) close();  // the world of a stream of pictures has ended
    return;
  }
  if (path_.starts_with("/mjpeg")) return refuse(503, "the world has ended");
  answerMetrics();
}

/// Takes what the world said, one picture at a time: what waits meanwhile is the loop's to drop.
void HttpVisit::hear(Ear& ear) {
  while (!closed_ && !writing_ && !ear.ended) {
    const OutgoingQueue::Next next = ear.heard->pop();
    if (!next.message) return;
    ear.ended = next.last;
    protocol::Decoder decoder(protocol::kClientTakes, protocol::Decoder::Expect::messages);
    std::span<const std::uint8_t> bytes(*next.message.head);
    auto framed = decoder.next(bytes);
    if (!framed && next.message.rest) {
      bytes = *next.message.rest;
      framed = decoder.next(bytes);
    }
    v1::ServerMessage message;
    if (framed && protocol::parse(framed->header, message))
      take(ear, std::move(message), std::move(framed->attachment));
  }
}

void HttpVisit::take(Ear& ear, v1::ServerMessage message, std::vector<std::uint8_t> attachment) {
  if (message.has_error() && hasEnded(*ear.world, message.error().code())) {
    ear.ended = true;  // the others answer
    return;
  }
  if (message.has_error()) {
    const bool missing = message.error().code() == v1::ERROR_UNKNOWN_AVATAR;
    return refuse(missing ? 404 : 400, message.error().message());
  }
  if (message.has_metrics()) ear.metrics = message.metrics();
  if (message.has_watch_frames()) {
    timer_.cancel();  // pictures come for as long as the other side stays
    answered_ = true;
    return write(bufferOf(mjpegHead()), false);
  }
  if (message.has_frame()) {
    std::vector<std::uint8_t> part = mjpegPart(message.frame(), attachment);
    return write(std::make_shared<const std::vector<std::uint8_t>>(std::move(part)), false);
  }
}

/// Of the worlds that live. One that failed makes the server ill; one that was dropped meanwhile
/// does not.
void HttpVisit::answerMetrics() {
  std::vector<WorldMetrics> told;
  for (Ear& ear : ears_) {
    const std::string& name = ear.world->place().name;
    if (ear.world->failure() && path_ == "/healthz")
      return refuse(503, (mayHearNames_ ? "the world '" + name + "'" : "a world") +
                             " failed: drop it, or start the server anew");
    if (ear.metrics) told.push_back({name, std::move(*ear.metrics)});
  }
  if (told.empty()) return refuse(503, "the world has ended");
  if (path_ == "/healthz") return answer(200, "text/plain", "ok\n");
  answer(200, kMetricsType, metricsPage(told));
}

// ---- out ---------------------------------------------------------------------------------------

void HttpVisit::refuse(unsigned status, const std::string& why) {
  if (answered_) return close();
  spdlog::warn("{}: {} {}", peer_, status, why);
  answer(status, "text/plain", why + "\n");
}

void HttpVisit::answer(unsigned status, const std::string& type, std::string body) {
  if (answered_) return;
  answered_ = true;
  write(bufferOf(response(status, type, body)), true);
}

void HttpVisit::write(Buffer bytes, bool last) {
  writing_ = true;
  // Who does not read is given up, as by the protocol itself.
  timer_.expires_after(reception_.limits.message);
  timer_.async_wait([weak = weak_from_this()](error_code stopped) {
    const auto self = weak.lock();
    if (!stopped && self && self->writing_) self->close();
  });
  const auto view = asio::buffer(*bytes);
  asio::async_write(
      socket_, view,
      [self = shared_from_this(), bytes = std::move(bytes), last](error_code problem, std::size_t) {
        self->writing_ = false;
        if (problem) return self->close();
        if (!last) return self->hear();
        error_code ignored;
        self->socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
        self->timer_.expires_after(self->reception_.limits.farewell);
        self->timer_.async_wait([self](error_code) { self->close(); });
        self->noticeLeaving();
      });
}

/// Reads and forgets, so that the end of the connection is seen.
void HttpVisit::noticeLeaving() {
  if (std::exchange(noticing_, true)) return;
  socket_.async_read_some(asio::buffer(thrownAway_),
                          [self = shared_from_this()](error_code problem, std::size_t) {
                            if (self->closed_) return;
                            if (problem) return self->close();
                            self->noticing_ = false;
                            self->noticeLeaving();
                          });
}

void HttpVisit::armTimer(Clock::time_point deadline, unsigned status, std::string why) {
  timer_.expires_at(deadline);
  timer_.async_wait([weak = weak_from_this(), status, why = std::move(why)](error_code stopped) {
    const auto self = weak.lock();
    if (stopped || !self || self->closed_ || self->answered_) return;
    if (self->timer_.expiry() <= Clock::now()) self->refuse(status, why);
  });
}

void HttpVisit::close() {
  if (closed_) return;
  closed_ = true;
  timer_.cancel();
  error_code ignored;
  socket_.close(ignored);
  for (const Ear& ear : ears_)
    if (ear.client != 0) ear.world->leave(ear.client);
}

}  // namespace enfilade::server
