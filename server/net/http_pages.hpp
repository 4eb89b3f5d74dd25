// Converts HTTP requests to requests of the protocol, and replies to HTTP responses. No sockets.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"

namespace enfilade::server {

/// The target of a request, decoded.
struct Target {
  std::string path;
  std::map<std::string, std::string> query;
};

/// Parses a target and decodes %XX.
Target parseTarget(std::string_view text);

/// The token of "Authorization: Bearer TOKEN" (the scheme in any case), otherwise of the query's
/// `token`; "": no token.
std::string extractToken(std::string_view authorization, const Target& target);

/// An error response.
struct HttpError {
  unsigned status = 404;
  std::string text;
};

/// Converts a target to a request of the protocol: /healthz, /metrics,
/// /mjpeg/avatar/NAME?width=&height=&rate=&fov_y=, /mjpeg/camera?eye=X,Y,Z&target=X,Y,Z&...
std::variant<v1::ClientMessage, HttpError> parseRequest(const Target& target);

inline constexpr const char* kMetricsContentType = "text/plain; version=0.0.4; charset=utf-8";

struct WorldMetrics {
  std::string world;  ///< the world's name
  v1::Metrics metrics;
};

/// Prometheus text format, version 0.0.4: each metric of each world, labelled with its name.
std::string makeMetricsPage(std::span<const WorldMetrics> worlds);

/// A complete response; the connection closes after it.
std::string makeResponse(unsigned status, const std::string& type, const std::string& body);

std::string makeMjpegHeader();
std::vector<std::uint8_t> makeMjpegPart(const v1::Frame& frame, std::span<const std::uint8_t> jpeg);

}  // namespace enfilade::server
