// ModelStreamSink: the receiver of the bytes of a model stream.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace enfilade::scene {

/// Takes the bytes of a stream, block by block.
using ModelStreamSink = std::function<void(std::span<const std::byte>)>;

}  // namespace enfilade::scene
