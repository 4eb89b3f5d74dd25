// Serializes a Model as one block of bytes: the answer of an import worker, and the content of a
// cache entry.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/import/worker/model_stream_error.hpp"
#include "scene/import/worker/model_stream_sink.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Increases with every change of the layout; other versions are refused.
inline constexpr std::uint32_t kModelStreamVersion = 9;

/// The size of the stream in bytes.
std::uint64_t measureModelStream(const Model& model);

/// Writes the stream without keeping it: a model may take most of the memory. `size` is that of
/// measureModelStream().
void writeModelStream(const Model& model, std::uint64_t size, const ModelStreamSink& sink);

/// The stream in one piece. Little-endian: magic, version, total length, then the fields in the
/// order of model.hpp.
std::vector<std::byte> serializeModel(const Model& model);

/// Validates everything: counts against the remaining bytes, indices against their targets, enums
/// against their values. Throws ModelStreamError.
Model deserializeModel(std::span<const std::byte> bytes);

}  // namespace enfilade::scene
