// Assembles a recorded walk as one HTML file: the page's script, the scene, and the messages that a
// server would send. The file needs no server and makes no request.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace enfilade::server {

/// The parts of the page that `./dev build` makes: script, style sheet, licences of its packages.
struct ReplayPage {
  std::string script, style, licenses;
};

/// Reads them from the folder of the page. Throws std::runtime_error, with the remedy, if a file is
/// missing, or has text that would end its block of the HTML file.
ReplayPage readReplayPage(const std::filesystem::path& folder);

/// Binary data is compressed by gzip.
struct ReplayContent {
  std::string title;
  std::span<const std::uint8_t> scene;     ///< binary glTF
  std::span<const std::uint8_t> messages;  ///< ServerMessages in the protocol's framing
  std::string pictures;                    ///< JSON: a list of {avatar, tick, time, format, data}
  std::string about;                       ///< JSON: a list of [name, value]
};

/// `nonce` is what the content security policy requires of the script; take a random one.
std::string makeReplayHtml(const ReplayPage& page, const ReplayContent& content,
                           const std::string& nonce);

}  // namespace enfilade::server
