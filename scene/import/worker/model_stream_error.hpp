// ModelStreamError: exception for an invalid model stream or cache entry.
#pragma once

#include <stdexcept>

namespace enfilade::scene {

/// Reports what is wrong and at which byte.
struct ModelStreamError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace enfilade::scene
