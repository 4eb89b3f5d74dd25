#include "server/net/http_pages.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>

#include "scene/import/worker/uri.hpp"
#include "server/base/version.hpp"

namespace enfilade::server {
namespace {

constexpr const char* kBoundary = "enfilade-picture";

std::optional<double> numberFrom(std::string_view text) {
  double number = 0;
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, number);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return number;
}

/// Reads the query's fields, and keeps the first problem.
class Query {
 public:
  explicit Query(const Target& target) : target_(target) {}

  bool has(const char* name) const { return target_.query.contains(name); }
  double number(const char* name, double otherwise) {
    const auto found = target_.query.find(name);
    if (found == target_.query.end()) return otherwise;
    const auto value = numberFrom(found->second);
    if (!value) complain(name, "a number");
    return value.value_or(otherwise);
  }
  std::uint32_t pixels(const char* name, std::uint32_t otherwise) {
    const double value = number(name, otherwise);
    if (value >= 1 && value <= 4096) return static_cast<std::uint32_t>(value);
    complain(name, "1 to 4096 pixels");
    return otherwise;
  }
  void point(const char* name, v1::Vec3& into) {
    const auto found = target_.query.find(name);
    std::istringstream parts(found == target_.query.end() ? "" : found->second);
    std::string part;
    std::vector<double> values;
    while (std::getline(parts, part, ',')) {
      if (const auto value = numberFrom(part)) values.push_back(*value);
    }
    if (values.size() != 3) return complain(name, "three numbers, as 1,1.6,0");
    into.set_x(values[0]);
    into.set_y(values[1]);
    into.set_z(values[2]);
  }
  void complain(const char* name, const char* wanted) {
    if (problem_.empty()) problem_ = std::string(name) + ": give " + wanted;
  }
  const std::string& problem() const { return problem_; }

 private:
  const Target& target_;
  std::string problem_;
};

std::variant<v1::ClientMessage, PageProblem> picturesFor(const Target& target) {
  constexpr std::string_view kAvatar = "/mjpeg/avatar/";
  Query query(target);
  v1::ClientMessage message;
  v1::WatchFrames& watch = *message.mutable_watch_frames();
  v1::FrameRequest& frame = *watch.mutable_frame();
  watch.set_watch(1);
  watch.set_rate(query.number("rate", 10));
  frame.set_width(query.pixels("width", 640));
  frame.set_height(query.pixels("height", 480));
  frame.set_rgb_encoding(v1::ENCODING_JPEG);
  if (target.path.starts_with(kAvatar)) {
    frame.mutable_eyes()->set_avatar(target.path.substr(kAvatar.size()));
    if (query.has("fov_y")) frame.mutable_eyes()->set_fov_y(query.number("fov_y", 0));
  } else if (target.path == "/mjpeg/camera") {
    query.point("eye", *frame.mutable_free()->mutable_eye());
    query.point("target", *frame.mutable_free()->mutable_target());
    if (query.has("fov_y")) frame.mutable_free()->set_fov_y(query.number("fov_y", 0));
  } else {
    return PageProblem{404,
                       "pictures are at /mjpeg/avatar/NAME and /mjpeg/camera?eye=..&target=.."};
  }
  if (!query.problem().empty()) return PageProblem{400, query.problem()};
  return message;
}

const char* phraseOf(unsigned status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Payload Too Large";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
    default:
      return "Error";
  }
}

/// Each metric with its help and type, and a line for each world.
class MetricsText {
 public:
  explicit MetricsText(std::span<const WorldMetrics> worlds) : worlds_(worlds) {}

  template <class Value>
  void add(const char* name, const char* type, const char* help, const Value& value) {
    begin(name, type, help);
    for (const WorldMetrics& one : worlds_)
      line(name, labelOf(one) + "}", static_cast<double>(value(one.metrics)));
  }
  void begin(const char* name, const char* type, const char* help) {
    text_ << "# HELP enfilade_" << name << ' ' << help << "\n# TYPE enfilade_" << name << ' '
          << type << '\n';
  }
  void timing(const WorldMetrics& one, const v1::StageTiming& stage, const std::string& name) {
    const std::string label = labelOf(one) + ",stage=\"" + name + "\",quantile=\"";
    line("stage_microseconds", label + "0.5\"}", stage.median_us());
    line("stage_microseconds", label + "0.99\"}", stage.p99_us());
    line("stage_microseconds", label + "1\"}", stage.max_us());
  }
  std::string text() const { return text_.str(); }

 private:
  /// Names of worlds need no escapes.
  static std::string labelOf(const WorldMetrics& one) { return "{world=\"" + one.world + "\""; }
  void line(const char* name, const std::string& labels, double value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    text_ << "enfilade_" << name << labels << ' ' << std::string_view(digits, end) << '\n';
  }

  std::span<const WorldMetrics> worlds_;
  std::ostringstream text_;
};

/// Of the worlds that are recorded.
std::string recordingPart(std::span<const WorldMetrics> worlds) {
  using M = v1::Metrics;
  std::vector<WorldMetrics> recorded;
  for (const WorldMetrics& one : worlds)
    if (one.metrics.has_recording()) recorded.push_back(one);
  if (recorded.empty()) return {};
  MetricsText page(recorded);
  page.add("recorded_ticks_total", "counter", "Ticks that were written down.",
           [](const M& m) { return m.recording().ticks(); });
  page.add("recording_bytes", "gauge", "In the recording's file.",
           [](const M& m) { return m.recording().bytes(); });
  page.add("recording_broken", "gauge", "1: the file took no more; must be 0.",
           [](const M& m) { return m.recording().broken() ? 1 : 0; });
  return page.text();
}

}  // namespace

Target targetOf(std::string_view text) {
  Target target;
  const std::size_t mark = text.find('?');
  target.path = scene::percentDecoded(text.substr(0, mark));
  if (mark == std::string_view::npos) return target;
  std::istringstream fields{std::string(text.substr(mark + 1))};
  std::string field;
  while (std::getline(fields, field, '&')) {
    const std::size_t equals = field.find('=');
    const std::string value = equals == std::string::npos ? "" : field.substr(equals + 1);
    target.query[scene::percentDecoded(field.substr(0, equals))] = scene::percentDecoded(value);
  }
  return target;
}

std::string tokenOf(std::string_view authorization, const Target& target) {
  constexpr std::string_view kBearer = "Bearer ";
  if (authorization.starts_with(kBearer)) return std::string(authorization.substr(kBearer.size()));
  const auto found = target.query.find("token");
  return found == target.query.end() ? "" : found->second;
}

std::variant<v1::ClientMessage, PageProblem> requestFor(const Target& target) {
  if (target.path == "/healthz" || target.path == "/metrics") {
    v1::ClientMessage message;
    message.mutable_metrics();
    return message;
  }
  if (target.path.starts_with("/mjpeg")) return picturesFor(target);
  return PageProblem{404, "there are /healthz, /metrics and /mjpeg/..., and the WebSocket at /"};
}

std::string metricsPage(std::span<const WorldMetrics> worlds) {
  using M = v1::Metrics;
  MetricsText page(worlds);
  const auto add = [&page](const char* name, const char* type, const char* help,
                           const auto& value) { page.add(name, type, help, value); };
  add("ticks_total", "counter", "Ticks made.", [](const M& m) { return m.ticks(); });
  add("contacts_total", "counter", "Contacts that began.", [](const M& m) { return m.contacts(); });
  add("narrow_queries_total", "counter", "Pairs decided by the narrow phase.",
      [](const M& m) { return m.narrow_queries(); });
  add("rational_queries_total", "counter", "Of those, decided by exact arithmetic.",
      [](const M& m) { return m.rational_queries(); });
  add("frames_total", "counter", "Pictures drawn.", [](const M& m) { return m.frames(); });
  add("dropped_total", "counter", "States and pictures left out for slow clients.",
      [](const M& m) { return m.dropped(); });
  add("squeezed_bodies_total", "counter", "Pairs that a driven body pressed together.",
      [](const M& m) { return m.squeezed_bodies(); });
  add("worst_penetration_metres", "gauge", "By the exact verdict; 0: nothing ever did.",
      [](const M& m) { return m.worst_penetration(); });
  add("clients", "gauge", "Connected now, this request among them.",
      [](const M& m) { return m.clients(); });
  add("avatars", "gauge", "In the world now.", [](const M& m) { return m.avatars(); });
  add("pairs", "gauge", "That the broad phase held in the last tick.",
      [](const M& m) { return m.pairs(); });
  add("live_contacts", "gauge", "In the last tick.", [](const M& m) { return m.live_contacts(); });
  // Worlds of one server are all audited, or none is.
  if (std::any_of(worlds.begin(), worlds.end(),
                  [](const WorldMetrics& one) { return one.metrics.has_audit(); })) {
    add("audit_missed_total", "counter", "Pairs that the broad phase missed; must be 0.",
        [](const M& m) { return m.audit().missed(); });
  }
  page.begin("stage_microseconds", "gauge", "Wall-clock time of a tick's stages.");
  for (const WorldMetrics& one : worlds) {
    for (const v1::StageTiming& stage : one.metrics.stages()) page.timing(one, stage, stage.name());
    page.timing(one, one.metrics.tick(), "tick");
  }
  return page.text() + recordingPart(worlds);
}

std::string response(unsigned status, const std::string& type, const std::string& body) {
  std::string head = "HTTP/1.1 " + std::to_string(status) + " " + phraseOf(status) +
                     "\r\nServer: enfilade " + kServerVersion + "\r\nContent-Type: " + type +
                     "\r\nContent-Length: " + std::to_string(body.size()) +
                     "\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n";
  if (status == 401) head += "WWW-Authenticate: Bearer\r\n";
  return head + "Connection: close\r\n\r\n" + body;
}

std::string mjpegHead() {
  return fmt::format(
      "HTTP/1.1 200 OK\r\nServer: enfilade {}\r\n"
      "Content-Type: multipart/x-mixed-replace; boundary={}\r\n"
      "Cache-Control: no-store\r\nConnection: close\r\n\r\n",
      kServerVersion, kBoundary);
}

std::vector<std::uint8_t> mjpegPart(const v1::Frame& frame, std::span<const std::uint8_t> jpeg) {
  const std::string head = fmt::format(
      "--{}\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n"
      "X-Tick: {}\r\nX-Dropped: {}\r\n\r\n",
      kBoundary, jpeg.size(), frame.tick(), frame.dropped());
  std::vector<std::uint8_t> part(head.begin(), head.end());
  part.insert(part.end(), jpeg.begin(), jpeg.end());
  part.push_back('\r');
  part.push_back('\n');
  return part;
}

}  // namespace enfilade::server
