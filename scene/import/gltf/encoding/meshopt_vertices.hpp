// Decoder of meshopt's vertex codec, versions 0 and 1. Private to the import.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// Decodes `count` elements of `stride` bytes, a multiple of 4 up to 256, into `bytes`. Returns "",
/// or the reason why it failed. Memory is allocated only for elements that the stream can contain.
std::string decodeMeshoptVertices(std::string_view source, std::size_t count, std::size_t stride,
                                  std::string& bytes);

}  // namespace enfilade::scene
