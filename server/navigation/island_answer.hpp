// Writes islands into replies, with the reasons that separate them.
#pragma once

#include <cstddef>

#include "server/navigation/path_answer.hpp"

namespace enfilade::server {

/// The `count` largest islands.
void writeIslands(const PathAnswer& answer, std::size_t count, v1::NavigationReply& reply);

}  // namespace enfilade::server
