// Percent-encoding of URIs.
#pragma once

#include <string>
#include <string_view>

namespace enfilade::scene {

/// Replaces each %XY with the byte of the two hexadecimal digits (RFC 3986, section 2.1); other
/// percent signs stay.
std::string decodePercent(std::string_view uri);

}  // namespace enfilade::scene
