// RenderError: exception of the renderers, and RendererUnavailable.
#pragma once

#include <stdexcept>

namespace enfilade::render {

/// Its text names the failed call or invalid value, the error code and a remedy.
struct RenderError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The requested renderer is unavailable on this machine; another one may work.
struct RendererUnavailable : RenderError {
  using RenderError::RenderError;
};

}  // namespace enfilade::render
