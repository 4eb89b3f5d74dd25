#include "server/inspection/html_page.hpp"

#include "server/export/base64.hpp"

namespace enfilade::server {
namespace {

// The policy forbids scripts and all requests: the page can be opened from a mail.
constexpr const char* kHead = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
      content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #1e1e24; background: #faf9f6;
       max-width: 68rem; margin: 2rem auto; padding: 0 1.5rem; }
h1 { font-size: 1.7rem; margin: 0; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
.subtitle { color: #666672; margin: .2rem 0 1.5rem; }
table { border-collapse: collapse; }
th, td { text-align: left; vertical-align: top; padding: .3rem 1.2rem .3rem 0;
         border-bottom: 1px solid #e2e0da; overflow-wrap: break-word; }
thead th { color: #666672; font-weight: 600; white-space: nowrap; }
.name { white-space: nowrap; }
td:last-child { max-width: 28rem; }
tbody th { font-weight: 400; color: #666672; white-space: nowrap; }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.error, .warning, .note { font-weight: 600; white-space: nowrap; }
.error { color: #b3261e; }
.warning { color: #8a5a00; }
.note { color: #5a6270; }
figure { margin: 1rem 0 2rem; }
figure img { max-width: 100%; border: 1px solid #e2e0da; }
figcaption { color: #666672; }
@media print { body { background: #fff; margin: 0; } figure { break-inside: avoid; } }
</style>
)";

void appendElement(std::string& html, const std::string& tag, const std::string& text,
                   const std::string& style = "") {
  html += "<" + tag + (style.empty() ? "" : " class=\"" + style + "\"") + ">" + escapeHtml(text) +
          "</" + tag + ">\n";
}

}  // namespace

std::string escapeHtml(const std::string& text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '&')
      escaped += "&amp;";
    else if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '"')
      escaped += "&quot;";
    else if (c == '\'')
      escaped += "&#39;";
    else if ((code < 0x20 && c != '\n' && c != '\t') || code == 0x7f)
      escaped += "\xef\xbf\xbd";  // U+FFFD in UTF-8
    else
      escaped += c;
  }
  return escaped;
}

HtmlPage::HtmlPage(const std::string& title, const std::string& subtitle) : title_(title) {
  appendElement(body_, "h1", title);
  appendElement(body_, "p", subtitle, "subtitle");
}

void HtmlPage::addHeading(const std::string& text) {
  appendElement(body_, "h2", text);
}

void HtmlPage::addParagraph(const std::string& text) {
  appendElement(body_, "p", text);
}

void HtmlPage::addFacts(const std::vector<std::pair<std::string, std::string>>& facts) {
  body_ += "<table><tbody>\n";
  for (const auto& [name, value] : facts)
    body_ += "<tr><th>" + escapeHtml(name) + "</th><td>" + escapeHtml(value) + "</td></tr>\n";
  body_ += "</tbody></table>\n";
}

void HtmlPage::addTable(const std::vector<HtmlCell>& header,
                        const std::vector<std::vector<HtmlCell>>& rows) {
  body_ += "<table><thead><tr>\n";
  for (const HtmlCell& cell : header) appendElement(body_, "th", cell.text, cell.style);
  body_ += "</tr></thead><tbody>\n";
  for (const auto& row : rows) {
    body_ += "<tr>\n";
    for (const HtmlCell& cell : row) appendElement(body_, "td", cell.text, cell.style);
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table>\n";
}

void HtmlPage::addImage(const render::Image& image, const std::string& caption) {
  body_ += "<figure><img alt=\"" + escapeHtml(caption) + "\" src=\"data:image/png;base64," +
           encodeBase64(render::encodePng(image)) + "\"><figcaption>" + escapeHtml(caption) +
           "</figcaption></figure>\n";
}

std::string HtmlPage::finish() const {
  return kHead + ("<title>" + escapeHtml(title_)) + "</title>\n</head>\n<body>\n" + body_ +
         "</body>\n</html>\n";
}

}  // namespace enfilade::server
