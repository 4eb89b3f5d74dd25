// What passes through the pipe from an importing process to the one that started it: frames of a
// kind, a length and that many bytes, little-endian. scene/import/ifc/web_ifc/read_ifc.js writes
// them as well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace enfilade::scene {

enum class ImportFrame : std::uint8_t {
  progress = 'P',  ///< a double 0..1 and the stage's name
  error = 'E',     ///< text for the user; the last frame
  model = 'M',     ///< a model stream; the last frame
  // Of the readers of IFC, see ifc/shapes.hpp:
  trying = 'T',
  geometry = 'G',
  product = 'O',
  failure = 'F',
  done = 'D'  ///< nothing; the last frame
};

struct ImportFrameHeader {
  std::uint8_t kind;
  std::uint64_t size;
  static constexpr std::size_t kSize = 9;  ///< bytes in the pipe
};

inline constexpr char kImportVerb[] = "--enfilade-import-child";

// File descriptors of an importing process.
inline constexpr int kImportPipe = 3;  ///< frames, written
inline constexpr int kIfcFile = 4;     ///< readers of IFC: the file
inline constexpr int kIfcWanted = 5;   ///< readers of IFC: express ids, 32 bits each

// ---- for the process that writes: it ends when nobody listens any more --------------------------

void sendFrame(ImportFrame kind, const void* data, std::size_t size);
void sendProgress(const std::string& stage, double fraction);
void sendError(const std::string& text);

}  // namespace enfilade::scene
