// Serialises a Model as one block of bytes: the answer of an import worker, and the content of a
// cache entry.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Increases with every change of the layout; other versions are refused.
inline constexpr std::uint32_t kModelStreamVersion = 6;

/// Reports what is wrong and at which byte.
struct ModelStreamError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Little-endian: magic, version, total length, then the fields in the order of model.hpp.
std::vector<std::byte> serialiseModel(const Model& model);

/// Validates everything: counts against the remaining bytes, indices against their targets, enums
/// against their values. Throws ModelStreamError.
Model deserialiseModel(std::span<const std::byte> bytes);

}  // namespace enfilade::scene
