#include "server/commands/replay_html.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "server/export/base64.hpp"
#include "server/inspection/html_page.hpp"

namespace enfilade::server {
namespace {

std::string readPart(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || stream.bad() || text.empty())
    throw std::runtime_error(file.string() +
                             ": not found: ./dev build makes the page of recordings (it needs "
                             "Node.js)");
  // Either would end the element, or begin a comment in a script.
  for (const char* end : {"</script", "</style", "<!--"}) {
    const std::string_view word(end);
    const auto found =
        std::search(text.begin(), text.end(), word.begin(), word.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a + 32 : a) == b; });
    if (found != text.end())
      throw std::runtime_error(file.string() + ": has '" + end + "', which HTML does not allow");
  }
  return text;
}

/// JSON that is safe inside of a script element.
std::string escapeScript(const std::string& json) {
  std::string escaped;
  escaped.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      escaped += "\\u003c";
    else
      escaped += c;
  }
  return escaped;
}

std::string makeBlock(const char* name, const char* type, const std::string& text) {
  return std::string("<script id=\"enfilade-") + name + "\" type=\"" + type + "\">" + text +
         "</script>\n";
}

}  // namespace

ReplayPage readReplayPage(const std::filesystem::path& folder) {
  const std::filesystem::path replay = folder / "replay";
  return {readPart(replay / "replay.js"), readPart(replay / "replay.css"),
          readPart(replay / "licenses.txt")};
}

std::string makeReplayHtml(const ReplayPage& page, const ReplayContent& content,
                           const std::string& nonce) {
  const char* base64 = "application/gzip;base64";
  std::string html =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
      "'nonce-" +
      nonce +
      "'; style-src 'unsafe-inline'; img-src data: blob:; connect-src data: blob:; base-uri "
      "'none'; "
      "form-action 'none'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1, "
      "viewport-fit=cover\">\n<title>" +
      escapeHtml(content.title) + "</title>\n<style>" + page.style +
      "</style>\n</head>\n<body>\n<noscript>This page needs JavaScript.</noscript>\n";
  html += makeBlock("about", "application/json", escapeScript(content.about));
  html += makeBlock("pictures", "application/json", escapeScript(content.pictures));
  html += makeBlock("messages", base64, encodeBase64(content.messages));
  html += makeBlock("scene", base64, encodeBase64(content.scene));
  html += makeBlock("licenses", "text/plain", page.licenses);
  html += "<script nonce=\"" + nonce + "\">" + page.script + "</script>\n</body>\n</html>\n";
  return html;
}

}  // namespace enfilade::server
