// What HTTP asks for, as requests of the protocol, and the answers as pages. Knows no socket.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"

namespace enfilade::server {

struct Target {
  std::string path;
  std::map<std::string, std::string> query;
};

/// A request's target, with %XX read.
Target targetOf(std::string_view text);

/// Of "Authorization: Bearer TOKEN", else the query's `token`; "" where there is none.
std::string tokenOf(std::string_view authorization, const Target& target);

struct PageProblem {
  unsigned status = 404;
  std::string text;
};

/// /healthz, /metrics, /mjpeg/avatar/NAME?width=&height=&rate=&fov_y=,
/// /mjpeg/camera?eye=X,Y,Z&target=X,Y,Z&...
std::variant<v1::ClientMessage, PageProblem> requestFor(const Target& target);

inline constexpr const char* kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

struct WorldMetrics {
  std::string world;  ///< its name
  v1::Metrics metrics;
};

/// In Prometheus' text format, version 0.0.4: each metric of each world, labelled with its name.
std::string metricsPage(std::span<const WorldMetrics> worlds);

/// A whole response; the connection closes after it.
std::string response(unsigned status, const std::string& type, const std::string& body);

std::string mjpegHead();
std::vector<std::uint8_t> mjpegPart(const v1::Frame& frame, std::span<const std::uint8_t> jpeg);

}  // namespace enfilade::server
