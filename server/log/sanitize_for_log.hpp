// Makes text from clients safe for logs and error messages.
#pragma once

#include <string>

namespace enfilade::server {

/// Returns at most `maxBytes` bytes, with '?' for each byte that is not printable ASCII. A cut
/// inside a UTF-8 character would otherwise make the quoting message unreadable.
inline std::string sanitizeForLog(std::string text, std::size_t maxBytes) {
  if (text.size() > maxBytes) text.resize(maxBytes);
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

}  // namespace enfilade::server
