// Divides the text of a large IFC file into parts. Several processes can read their products at the
// same time, each without the geometry of the others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/import/file/step_file.hpp"

namespace enfilade::scene {

/// Bytes of a file's text.
struct TextRange {
  std::uint64_t first = 0, size = 0;
};

struct IfcFilePart {
  std::vector<std::uint32_t> products;  ///< express ids, in the order of the file's list
  std::vector<TextRange> ranges;        ///< of the text, ascending; what these products need
};

/// Divides `products` among `count` (1..8) parts of about equal bytes of geometry. Products that
/// share a mapped geometry share a part. A part lacks only statements that shapes of products in
/// other parts refer to, and nothing else. Empty: a part would have no product.
std::vector<IfcFilePart> divideIfc(const StepFile& file, const std::vector<std::uint32_t>& products,
                                   std::size_t count);

}  // namespace enfilade::scene
