// Encodes navigation maps as bytes for a reply.
#pragma once

#include <cstdint>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/navigation/navigation.hpp"

namespace enfilade::server {

/// The cells in a format; FORMAT_UNSPECIFIED: a byte per cell.
std::vector<std::uint8_t> encodeMap(scene::NavigationMap map,
                                    v1::NavigationQuery::Map::Format format);

}  // namespace enfilade::server
