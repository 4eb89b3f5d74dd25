// What passes through the pipe from the import child to its parent: frames of a kind, a length and
// that many bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace enfilade::scene {

enum class ImportFrame : std::uint8_t {
  progress = 'P',  ///< a double 0..1 and the stage's name
  error = 'E',     ///< text for the user
  model = 'M'      ///< a model stream; the last frame
};

struct ImportFrameHeader {
  std::uint8_t kind;
  std::uint64_t size;
  static constexpr std::size_t kSize = 9;  ///< bytes in the pipe
};

inline constexpr int kImportPipe = 3;  ///< the child's end, a file descriptor
inline constexpr char kImportVerb[] = "--enfilade-import-child";

}  // namespace enfilade::scene
