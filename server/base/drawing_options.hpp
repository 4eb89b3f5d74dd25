// Choice of renderer and graphics device.
#pragma once

#include "render/device.hpp"
#include "render/renderer_kind.hpp"

namespace enfilade::server {

struct DrawingOptions {
  render::RendererKind renderer = render::RendererKind::automatic;
  render::DeviceChoice device;

  /// True if a renderer or device was requested; the command then fails without one.
  bool isRequested() const {
    return renderer != render::RendererKind::automatic || device.requireGpu ||
           !device.device.empty();
  }
};

}  // namespace enfilade::server
