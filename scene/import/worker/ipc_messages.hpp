// Messages from an import worker to its parent, through a pipe: kind, length and that many bytes,
// little-endian. scene/import/ifc/web_ifc/worker_io.js writes them as well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace enfilade::scene {

/// Kind of a message.
enum class ImportMessage : std::uint8_t {
  progress = 'P',  ///< a double 0..1 and the stage's name
  error = 'E',     ///< text for the user; the last message
  model = 'M',     ///< a model stream; the last message
  // Of the IFC readers, see ifc/ifc_meshes.hpp:
  trying = 'T',
  geometry = 'G',
  product = 'O',
  failure = 'F',
  done = 'D',  ///< no content; the last message
  // Of the converter of ifcXML, see ifc/web_ifc/convert_ifcxml.js:
  stepText = 'X',
  problem = 'W'
};

/// Header of a message in the pipe.
struct ImportMessageHeader {
  std::uint8_t kind;
  std::uint64_t size;
  static constexpr std::size_t kSize = 9;  ///< bytes in the pipe
};

inline constexpr char kImportVerb[] = "--enfilade-import-child";

// File descriptors of an import worker.
inline constexpr int kImportPipe = 3;  ///< messages, written
inline constexpr int kIfcFile = 4;     ///< IFC readers: the file
/// IFC readers: express ids of the requested products, 32 bits each
inline constexpr int kIfcProductIds = 5;
inline constexpr int kIfcReady = 6;  ///< web-ifc: a pipe, at its end when both are complete
/// The parent's own descriptors begin here, so that none collides with those of a worker.
inline constexpr int kFirstParentDescriptor = 10;

// ---- for the worker: it exits if the parent is gone ---------------------------------------------

void sendMessage(ImportMessage kind, const void* data, std::size_t size);
/// The header of a message in pieces; `size` bytes follow by continueMessage().
void beginMessage(ImportMessage kind, std::uint64_t size);
void continueMessage(const void* data, std::size_t size);
void sendProgress(const std::string& stage, double fraction);
void sendError(const std::string& text);

}  // namespace enfilade::scene
