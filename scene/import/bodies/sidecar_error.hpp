// SidecarError: exception for an invalid sidecar, or invalid extras of a glTF node.
#pragma once

#include <stdexcept>

namespace enfilade::scene {

/// An error in a sidecar: "file.bodies[2].axis: what is wrong; remedy".
struct SidecarError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace enfilade::scene
