// What a client wrote, as it may stand in logs and in errors.
#pragma once

#include <string>

namespace enfilade::server {

/// At most `longest` bytes of it, with '?' for all that is not ASCII to print: a cut through a
/// character would make the message that quotes it unreadable.
inline std::string printable(std::string text, std::size_t longest) {
  if (text.size() > longest) text.resize(longest);
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

}  // namespace enfilade::server
