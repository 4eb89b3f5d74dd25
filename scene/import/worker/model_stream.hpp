// A Model as one block of bytes: what the import child sends, and what a cache may keep on disk.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Grows by one whenever the layout changes; other versions are refused.
inline constexpr std::uint32_t kModelStreamVersion = 4;

/// Says what is wrong and at which byte.
struct ModelStreamError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Little-endian: magic, version, length of the whole, then the fields in the order of model.hpp.
std::vector<std::byte> serialiseModel(const Model& model);

/// Trusts nothing: each count is checked against the bytes that remain, each index against what it
/// points into, each enum against its values. Throws ModelStreamError.
Model deserialiseModel(std::span<const std::byte> bytes);

}  // namespace enfilade::scene
