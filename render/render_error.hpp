// What goes wrong in drawing.
#pragma once

#include <stdexcept>

namespace enfilade::render {

/// Names the call or the thing refused, its error code and what to try.
struct RenderError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The renderer that was asked for cannot be had here; another may.
struct NoRenderer : RenderError {
  using RenderError::RenderError;
};

}  // namespace enfilade::render
