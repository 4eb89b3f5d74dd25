#pragma once

namespace enfilade::server {

/// Of the program.
inline constexpr const char* kServerVersion = "0.1.0";

}  // namespace enfilade::server
