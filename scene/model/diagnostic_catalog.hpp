// What the problems that an import or a report tells mean, and what to do about them.
#pragma once

#include <string_view>

#include "scene/model/model.hpp"

namespace enfilade::scene {

struct ProblemKind {
  std::string_view word;     ///< Problem::kind
  bool note = false;         ///< told so that nobody looks for it: nothing is wrong
  std::string_view meaning;  ///< what it is and, where something can be done, what; for people
};

/// That of `problem`; of a kind that nobody knows the meaning is empty.
ProblemKind kindOf(const Problem& problem);

}  // namespace enfilade::scene
