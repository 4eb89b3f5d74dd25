// CheckpointError: exception for bytes that are not a valid checkpoint.
#pragma once

#include <stdexcept>

namespace enfilade::scene {

/// Reason why the bytes are not a valid checkpoint, with the place.
struct CheckpointError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace enfilade::scene
