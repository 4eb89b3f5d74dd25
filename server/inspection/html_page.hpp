// Builds an HTML report: one self-contained page without scripts. All text is escaped.
#pragma once

#include <string>
#include <vector>

#include "render/image/image.hpp"

namespace enfilade::server {

/// Replaces the characters that HTML treats as markup. Control characters become U+FFFD.
std::string escapeHtml(const std::string& text);

/// A cell of a table. `style` is a class of the page's style sheet: "", "name" (not
/// wrapped), "number", "note", "warning" or "error".
struct HtmlCell {
  std::string text;
  const char* style = "";
};

class HtmlPage {
 public:
  /// `title` is the heading and the title of the window, `subtitle` a line below it.
  HtmlPage(const std::string& title, const std::string& subtitle);

  void addHeading(const std::string& text);
  void addParagraph(const std::string& text);
  /// A table of names and values, without a header.
  void addFacts(const std::vector<std::pair<std::string, std::string>>& facts);
  void addTable(const std::vector<HtmlCell>& header,
                const std::vector<std::vector<HtmlCell>>& rows);
  /// Embeds the image as PNG with a caption.
  void addImage(const render::Image& image, const std::string& caption);

  std::string finish() const;

 private:
  std::string title_, body_;
};

}  // namespace enfilade::server
