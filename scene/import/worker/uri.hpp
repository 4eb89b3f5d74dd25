#pragma once

#include <string>
#include <string_view>

namespace enfilade::scene {

/// With each %XY replaced by the byte of these two hexadecimal digits (RFC 3986, 2.1); other
/// percent signs stay.
std::string percentDecoded(std::string_view uri);

}  // namespace enfilade::scene
