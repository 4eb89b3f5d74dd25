#include "server/net/http_pages.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <boost/beast/http/status.hpp>
#include <cctype>
#include <sstream>

#include "collision/assert.hpp"
#include "scene/import/file/uri.hpp"
#include "scene/model/names.hpp"
#include "server/base/parse_number.hpp"
#include "server/base/version.hpp"

namespace enfilade::server {
namespace {

constexpr const char* kMultipartBoundary = "enfilade-picture";

/// Parses fields of the query and keeps the first error.
class QueryParameters {
 public:
  explicit QueryParameters(const Target& target) : target_(target) {}

  bool has(const char* name) const { return target_.query.contains(name); }
  double number(const char* name, double fallback) {
    const auto found = target_.query.find(name);
    if (found == target_.query.end()) return fallback;
    const auto value = parseNumber<double>(found->second);
    if (!value) addError(name, "a number");
    return value.value_or(fallback);
  }
  std::uint32_t pixels(const char* name, std::uint32_t fallback) {
    const double value = number(name, fallback);
    if (value >= 1 && value <= 4096) return static_cast<std::uint32_t>(value);
    addError(name, "1 to 4096 pixels");
    return fallback;
  }
  void point(const char* name, v1::Vec3& into) {
    const auto found = target_.query.find(name);
    std::istringstream parts(found == target_.query.end() ? "" : found->second);
    std::string part;
    std::vector<double> values;
    while (std::getline(parts, part, ',')) {
      if (const auto value = parseNumber<double>(part)) values.push_back(*value);
    }
    if (values.size() != 3) return addError(name, "three numbers, as 1,1.6,0");
    into.set_x(values[0]);
    into.set_y(values[1]);
    into.set_z(values[2]);
  }
  void addError(const char* name, const char* wanted) {
    if (error_.empty()) error_ = std::string(name) + ": give " + wanted;
  }
  const std::string& error() const { return error_; }

 private:
  const Target& target_;
  std::string error_;
};

std::variant<v1::ClientMessage, HttpError> parseMjpegRequest(const Target& target) {
  constexpr std::string_view kAvatar = "/mjpeg/avatar/";
  QueryParameters query(target);
  v1::ClientMessage message;
  v1::WatchFrames& subscription = *message.mutable_watch_frames();
  v1::FrameRequest& frame = *subscription.mutable_frame();
  subscription.set_watch(1);
  subscription.set_rate(query.number("rate", 10));
  frame.set_width(query.pixels("width", 640));
  frame.set_height(query.pixels("height", 480));
  frame.set_samples(query.pixels("samples", 1));
  frame.set_rgb_encoding(v1::ENCODING_JPEG);
  if (target.path.starts_with(kAvatar)) {
    frame.mutable_eyes()->set_avatar(target.path.substr(kAvatar.size()));
    if (query.has("fov_y")) frame.mutable_eyes()->set_fov_y(query.number("fov_y", 0));
  } else if (target.path == "/mjpeg/camera") {
    query.point("eye", *frame.mutable_free()->mutable_eye());
    query.point("target", *frame.mutable_free()->mutable_target());
    if (query.has("fov_y")) frame.mutable_free()->set_fov_y(query.number("fov_y", 0));
  } else {
    return HttpError{404, "streams are at /mjpeg/avatar/NAME and /mjpeg/camera?eye=..&target=.."};
  }
  if (!query.error().empty()) return HttpError{400, query.error()};
  return message;
}

/// Writes Prometheus text: each metric with help and type, and one line per world.
class MetricsWriter {
 public:
  explicit MetricsWriter(std::span<const WorldMetrics> worlds) : worlds_(worlds) {}

  template <class Value>
  void addMetric(const char* name, const char* type, const char* help, const Value& value) {
    beginMetric(name, type, help);
    for (const WorldMetrics& one : worlds_)
      addLine(name, makeLabel(one) + "}", static_cast<double>(value(one.metrics)));
  }
  void beginMetric(const char* name, const char* type, const char* help) {
    text_ << "# HELP enfilade_" << name << ' ' << help << "\n# TYPE enfilade_" << name << ' '
          << type << '\n';
  }
  void addTiming(const WorldMetrics& one, const v1::StageTiming& stage, const std::string& name) {
    const std::string label = makeLabel(one) + ",stage=\"" + name + "\",quantile=\"";
    addLine("stage_microseconds", label + "0.5\"}", stage.median_us());
    addLine("stage_microseconds", label + "0.99\"}", stage.p99_us());
    addLine("stage_microseconds", label + "1\"}", stage.max_us());
  }
  std::string text() const { return text_.str(); }

 private:
  static std::string makeLabel(const WorldMetrics& one) {
    ENFILADE_ASSERT(scene::isValidName(one.world));  // and needs no escaping
    return "{world=\"" + one.world + "\"";
  }
  void addLine(const char* name, const std::string& labels, double value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    text_ << "enfilade_" << name << labels << ' ' << std::string_view(digits, end) << '\n';
  }

  std::span<const WorldMetrics> worlds_;
  std::ostringstream text_;
};

/// Metrics of the recorded worlds.
std::string makeRecordingMetrics(std::span<const WorldMetrics> worlds) {
  using M = v1::Metrics;
  std::vector<WorldMetrics> recorded;
  for (const WorldMetrics& one : worlds)
    if (one.metrics.has_recording()) recorded.push_back(one);
  if (recorded.empty()) return {};
  MetricsWriter page(recorded);
  page.addMetric("recorded_ticks_total", "counter", "Recorded ticks.",
                 [](const M& m) { return m.recording().ticks(); });
  page.addMetric("recording_bytes", "gauge", "Size of the recording's file.",
                 [](const M& m) { return m.recording().bytes(); });
  page.addMetric("recording_broken", "gauge", "1: a write to the file failed; must be 0.",
                 [](const M& m) { return m.recording().broken() ? 1 : 0; });
  return page.text();
}

}  // namespace

Target parseTarget(std::string_view text) {
  Target target;
  const std::size_t queryStart = text.find('?');
  target.path = scene::decodePercent(text.substr(0, queryStart));
  if (queryStart == std::string_view::npos) return target;
  std::istringstream fields{std::string(text.substr(queryStart + 1))};
  std::string field;
  while (std::getline(fields, field, '&')) {
    const std::size_t equals = field.find('=');
    const std::string value = equals == std::string::npos ? "" : field.substr(equals + 1);
    target.query[scene::decodePercent(field.substr(0, equals))] = scene::decodePercent(value);
  }
  return target;
}

std::string extractToken(std::string_view authorization, const Target& target) {
  constexpr std::string_view kBearer = "Bearer ";
  const bool isBearer =
      authorization.size() >= kBearer.size() &&
      std::equal(kBearer.begin(), kBearer.end(), authorization.begin(), [](char a, char b) {
        return std::tolower(static_cast<unsigned char>(a)) ==
               std::tolower(static_cast<unsigned char>(b));  // RFC 7235, 2.1
      });
  if (isBearer) return std::string(authorization.substr(kBearer.size()));
  const auto found = target.query.find("token");
  return found == target.query.end() ? "" : found->second;
}

std::variant<v1::ClientMessage, HttpError> parseRequest(const Target& target) {
  if (target.path == "/healthz" || target.path == "/metrics") {
    v1::ClientMessage message;
    message.mutable_metrics();
    return message;
  }
  if (target.path.starts_with("/mjpeg")) return parseMjpegRequest(target);
  return HttpError{404,
                   "there are /, /scene.glb, /healthz, /metrics and /mjpeg/..., and the "
                   "WebSocket at /"};
}

std::string makeMetricsPage(std::span<const WorldMetrics> worlds) {
  using M = v1::Metrics;
  MetricsWriter page(worlds);
  const auto add = [&page](const char* name, const char* type, const char* help,
                           const auto& value) { page.addMetric(name, type, help, value); };
  add("ticks_total", "counter", "Completed ticks.", [](const M& m) { return m.ticks(); });
  add("contacts_total", "counter", "Contacts that began.", [](const M& m) { return m.contacts(); });
  add("narrow_queries_total", "counter", "Pairs decided by the narrow phase.",
      [](const M& m) { return m.narrow_queries(); });
  add("rational_queries_total", "counter", "Pairs decided by exact arithmetic.",
      [](const M& m) { return m.rational_queries(); });
  add("vertices_looked_at_total", "counter",
      "Vertices read for boxes of moving bodies and avatars.",
      [](const M& m) { return m.vertices_looked_at(); });
  add("part_boxes_made_total", "counter", "Part boxes computed, of bodies and of avatars.",
      [](const M& m) { return m.part_boxes_made(); });
  add("parts_looked_at_total", "counter", "Parts in reach of the queries of avatars.",
      [](const M& m) { return m.parts_looked_at(); });
  add("costliest_avatar_queries", "gauge", "Most narrow-phase queries of an avatar in a tick.",
      [](const M& m) { return m.costliest_avatar().narrow_queries(); });
  add("frames_total", "counter", "Rendered frames.", [](const M& m) { return m.frames(); });
  add("dropped_total", "counter", "States and frames dropped for slow clients.",
      [](const M& m) { return m.dropped(); });
  add("squeezed_bodies_total", "counter", "Pairs squeezed by a kinematic body.",
      [](const M& m) { return m.squeezed_bodies(); });
  add("worst_penetration_metres", "gauge", "Deepest penetration by the exact verdict; 0: none.",
      [](const M& m) { return m.worst_penetration(); });
  add("clients", "gauge", "Connected clients, including this request.",
      [](const M& m) { return m.clients(); });
  add("avatars", "gauge", "Avatars in the world.", [](const M& m) { return m.avatars(); });
  add("pairs", "gauge", "Broad-phase pairs in the last tick.",
      [](const M& m) { return m.pairs(); });
  add("live_contacts", "gauge", "In the last tick.", [](const M& m) { return m.live_contacts(); });
  // Either all worlds of a server are audited, or none.
  if (std::any_of(worlds.begin(), worlds.end(),
                  [](const WorldMetrics& one) { return one.metrics.has_audit(); })) {
    add("audit_missed_total", "counter", "Pairs that the broad phase missed; must be 0.",
        [](const M& m) { return m.audit().missed(); });
  }
  page.beginMetric("stage_microseconds", "gauge", "Wall-clock time of the stages of a tick.");
  for (const WorldMetrics& one : worlds) {
    for (const v1::StageTiming& stage : one.metrics.stages())
      page.addTiming(one, stage, stage.name());
    page.addTiming(one, one.metrics.tick(), "tick");
  }
  return page.text() + makeRecordingMetrics(worlds);
}

std::string makeResponse(unsigned status, const std::string& type, const std::string& body) {
  std::string head = "HTTP/1.1 " + std::to_string(status) + " " +
                     std::string(obsolete_reason(boost::beast::http::int_to_status(status))) +
                     "\r\nServer: enfilade " + kServerVersion + "\r\nContent-Type: " + type +
                     "\r\nContent-Length: " + std::to_string(body.size()) +
                     "\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n";
  if (status == 401) head += "WWW-Authenticate: Bearer\r\n";
  if (status == 405) head += "Allow: GET, HEAD\r\n";
  return head + "Connection: close\r\n\r\n" + body;
}

std::string makeMjpegHeader() {
  return fmt::format(
      "HTTP/1.1 200 OK\r\nServer: enfilade {}\r\n"
      "Content-Type: multipart/x-mixed-replace; boundary={}\r\n"
      "Cache-Control: no-store\r\nCross-Origin-Resource-Policy: same-origin\r\n"
      "Connection: close\r\n\r\n",
      kServerVersion, kMultipartBoundary);
}

std::vector<std::uint8_t> makeMjpegPart(const v1::Frame& frame,
                                        std::span<const std::uint8_t> jpeg) {
  const std::string head = fmt::format(
      "--{}\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n"
      "X-Tick: {}\r\nX-Dropped: {}\r\n\r\n",
      kMultipartBoundary, jpeg.size(), frame.tick(), frame.dropped());
  std::vector<std::uint8_t> part(head.begin(), head.end());
  part.insert(part.end(), jpeg.begin(), jpeg.end());
  part.push_back('\r');
  part.push_back('\n');
  return part;
}

}  // namespace enfilade::server
