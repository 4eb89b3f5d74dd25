// Sequence alignment (Needleman and Wunsch 1970) of two event lists with minimal total cost.
// Leaving two events unpaired costs as much as pairing them at the distance kMaxMatchDistance.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "server/diff/recorded_walk.hpp"

namespace enfilade::server {

/// Metres: contacts of a pair at this distance or more do not match.
inline constexpr double kMaxMatchDistance = 2;

/// Aligns two event lists with ascending times. Returns ascending index pairs; each event is used
/// at most once. Events kMaxMatchDistance or more apart are not paired.
std::vector<std::pair<std::size_t, std::size_t>> alignEvents(const std::vector<WalkEvent>& before,
                                                             const std::vector<WalkEvent>& after);

}  // namespace enfilade::server
