// Percent-encoding of URIs, and their form in messages.
#pragma once

#include <string>
#include <string_view>

namespace enfilade::scene {

/// Replaces each %XY with the byte of the two hexadecimal digits (RFC 3986, section 2.1); other
/// percent signs stay.
std::string decodePercent(std::string_view uri);

/// A URI as messages show it: the middle of a long one, such as one with data, is left out.
std::string shortenUri(const std::string& uri);

}  // namespace enfilade::scene
