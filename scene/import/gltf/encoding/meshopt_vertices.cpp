// The stream of KHR_meshopt_compression, appendix A, mode 0. It has a byte with the version, blocks
// of up to 256 elements, padding, and the element before the first. In version 1, a byte for each
// channel follows. A channel is four bytes of an element. A block stores for each byte of the
// element one plane. The plane has the deltas of this byte for all elements of the block, in groups
// of 16. The channel's mode says how deltas and the previous element give the next one.
#include "scene/import/gltf/encoding/meshopt_vertices.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace enfilade::scene {
namespace {

constexpr std::size_t kGroup = 16;           ///< deltas
constexpr std::size_t kBlockBytes = 8192;    ///< of decoded elements, at most
constexpr std::size_t kBlockElements = 256;  ///< at most
constexpr std::size_t kMaxStride = 256;

using BitLengths = std::array<unsigned, 4>;
constexpr BitLengths kBitsOfVersion0{0, 2, 4, 8};
constexpr std::array<BitLengths, 2> kBitsOfControl{{{0, 1, 2, 4}, {1, 2, 4, 8}}};
constexpr unsigned kPlainDeltas = 3;  ///< a control; below 2: groups; 2: all deltas are 0
enum ChannelMode : unsigned { kByteDeltas, kShortDeltas, kXorDeltas };

struct VertexStream {
  unsigned version = 0;
  std::size_t stride = 0;
  std::string_view blocks;    ///< the rest of them
  std::string_view first;     ///< the element before the first
  std::string_view channels;  ///< a byte each; empty in version 0
};

unsigned getByte(std::string_view bytes, std::size_t at) {
  return static_cast<unsigned char>(bytes[at]);
}

/// Removes `count` bytes from the front of `from`. False if it is shorter.
bool takeBytes(std::string_view& from, std::size_t count, std::string_view& taken) {
  if (from.size() < count) return false;
  taken = from.substr(0, count);
  from.remove_prefix(count);
  return true;
}

// ---- deltas -------------------------------------------------------------------------------------

/// Reads 16 deltas of 1, 2 or 4 bits. A delta with all bits set is a byte behind the group instead.
/// Single bits begin at the lowest of a byte, longer ones at the highest.
template <unsigned kBits>
bool readShortDeltas(std::string_view& from, unsigned char* deltas) {
  std::string_view packed;
  if (!takeBytes(from, kGroup * kBits / 8, packed)) return false;
  constexpr unsigned kEach = 8 / kBits, kEscape = (1u << kBits) - 1;
  std::size_t escapes = 0;
  for (unsigned i = 0; i < kGroup; ++i) {
    const unsigned place = kBits == 1 ? i % kEach : kEach - 1 - i % kEach;
    unsigned delta = getByte(packed, i / kEach) >> (place * kBits) & kEscape;
    if (delta == kEscape) {
      if (escapes == from.size()) return false;
      delta = getByte(from, escapes++);
    }
    deltas[i] = static_cast<unsigned char>(delta);
  }
  from.remove_prefix(escapes);
  return true;
}

/// Reads `count` deltas of a byte.
bool readPlainDeltas(std::string_view& from, std::size_t count, unsigned char* deltas) {
  std::string_view plain;
  if (!takeBytes(from, count, plain)) return false;
  std::memcpy(deltas, plain.data(), count);
  return true;
}

bool readGroup(std::string_view& from, unsigned bits, unsigned char* deltas) {
  switch (bits) {
    case 0:
      std::memset(deltas, 0, kGroup);
      return true;
    case 1:
      return readShortDeltas<1>(from, deltas);
    case 2:
      return readShortDeltas<2>(from, deltas);
    case 4:
      return readShortDeltas<4>(from, deltas);
    default:
      return readPlainDeltas(from, kGroup, deltas);
  }
}

/// Reads a plane in groups: two bits each that choose a bit length, then the groups' deltas.
bool readGroups(std::string_view& from, const BitLengths& lengths, std::size_t count,
                unsigned char* deltas) {
  const std::size_t groups = (count + kGroup - 1) / kGroup;
  std::string_view headers;
  if (!takeBytes(from, (groups + 3) / 4, headers)) return false;
  for (std::size_t i = 0; i < groups; ++i) {
    const unsigned choice = getByte(headers, i / 4) >> (i % 4 * 2) & 3;
    if (!readGroup(from, lengths[choice], deltas + i * kGroup)) return false;
  }
  return true;
}

/// Reads the plane of a block of version 1.
bool readPlane(std::string_view& from, unsigned control, std::size_t count, unsigned char* deltas) {
  if (control < kBitsOfControl.size())
    return readGroups(from, kBitsOfControl[control], count, deltas);
  if (control == kPlainDeltas) return readPlainDeltas(from, count, deltas);
  std::memset(deltas, 0, count);
  return true;
}

// ---- elements -----------------------------------------------------------------------------------

/// Adds zigzag-coded deltas to the lanes of a word. `ones` has the lowest bit of each lane.
std::uint32_t addToLanes(std::uint32_t word, std::uint32_t deltas, unsigned laneBits,
                         std::uint32_t ones) {
  const std::uint32_t highs = ones << (laneBits - 1);
  const std::uint32_t signs = (deltas & ones) * ((1u << laneBits) - 1);  // a lane of 0 or ~0
  const std::uint32_t plain = (deltas >> 1 & ~highs) ^ signs;
  return ((word & ~highs) + (plain & ~highs)) ^ ((word ^ plain) & highs);
}

/// Decodes the channel of four planes for all elements of a block. `word` is the previous value.
template <class Next>
std::uint32_t decodeElements(const unsigned char* planes, std::size_t planeBytes, std::size_t count,
                             std::size_t stride, std::uint32_t word, char* to, const Next& next) {
  for (std::size_t i = 0; i < count; ++i, to += stride) {
    std::uint32_t deltas = 0;
    for (unsigned k = 0; k < 4; ++k) deltas |= std::uint32_t{planes[k * planeBytes + i]} << 8 * k;
    word = next(word, deltas);
    std::memcpy(to, &word, sizeof word);
  }
  return word;
}

/// `channel`: the mode in the low four bits; in the high ones the rotation of XOR deltas.
std::uint32_t decodeChannel(unsigned channel, const unsigned char* planes, std::size_t planeBytes,
                            std::size_t count, std::size_t stride, std::uint32_t word, char* to) {
  const auto decode = [&](const auto& next) {
    return decodeElements(planes, planeBytes, count, stride, word, to, next);
  };
  const unsigned mode = channel & 15;
  if (mode == kByteDeltas)
    return decode([](auto w, auto deltas) { return addToLanes(w, deltas, 8, 0x01010101); });
  if (mode == kShortDeltas)
    return decode([](auto w, auto deltas) { return addToLanes(w, deltas, 16, 0x00010001); });
  const int rotation = static_cast<int>(channel >> 4);
  return decode([rotation](auto w, auto deltas) { return w ^ std::rotr(deltas, rotation); });
}

/// Decodes the next block: `count` elements to `to`. `previous` is the element before them.
bool decodeBlock(VertexStream& stream, std::size_t count, std::array<char, kMaxStride>& previous,
                 char* to) {
  std::array<unsigned char, 4 * kBlockElements> planes;
  const std::size_t stride = stream.stride;
  std::string_view controls;
  if (stream.version > 0 && !takeBytes(stream.blocks, stride / 4, controls)) return false;
  for (std::size_t channel = 0; channel < stride / 4; ++channel) {
    for (unsigned k = 0; k < 4; ++k) {
      unsigned char* plane = planes.data() + k * kBlockElements;
      const bool read =
          controls.empty()
              ? readGroups(stream.blocks, kBitsOfVersion0, count, plane)
              : readPlane(stream.blocks, getByte(controls, channel) >> 2 * k & 3, count, plane);
      if (!read) return false;
    }
    std::uint32_t word = 0;
    std::memcpy(&word, previous.data() + 4 * channel, sizeof word);
    word = decodeChannel(stream.channels.empty() ? 0 : getByte(stream.channels, channel),
                         planes.data(), kBlockElements, count, stride, word, to + 4 * channel);
    std::memcpy(previous.data() + 4 * channel, &word, sizeof word);
  }
  return true;
}

// ---- the stream ---------------------------------------------------------------------------------

/// Splits the source. Returns what is wrong with it; "" for a valid one.
std::string openStream(std::string_view source, VertexStream& stream) {
  const unsigned header = source.empty() ? 0 : getByte(source, 0);
  if (header >> 4 != 0xa) return "its compressed data is not of the vertex codec";
  stream.version = header & 15;
  if (stream.version > 1)
    return "compressed by version " + std::to_string(stream.version) +
           " of the vertex codec, which is not supported; compress with version 1";
  const std::size_t channels = stream.version == 0 ? 0 : stream.stride / 4;
  const std::size_t tail = stream.stride + channels;
  const std::size_t padded = std::max<std::size_t>(tail, stream.version == 0 ? 32 : 24);
  if (source.size() < 1 + padded) return "its compressed data ends too early";
  stream.blocks = source.substr(1, source.size() - 1 - padded);
  stream.first = source.substr(source.size() - tail, stream.stride);
  stream.channels = source.substr(source.size() - channels);
  for (const unsigned char channel : stream.channels)
    if ((channel & 15) > kXorDeltas || ((channel & 15) < kXorDeltas && channel > 15))
      return "its compressed data has a channel of the unknown mode " + std::to_string(channel);
  return "";
}

}  // namespace

std::string decodeMeshoptVertices(std::string_view source, std::size_t count, std::size_t stride,
                                  std::string& bytes) {
  VertexStream stream;
  stream.stride = stride;
  if (std::string fault = openStream(source, stream); !fault.empty()) return fault;
  const std::size_t maxElements = std::min(kBlockBytes / stride / kGroup * kGroup, kBlockElements);
  // A block has at least one byte for each channel, in version 0 for each byte of the element.
  const std::size_t blocks = count / maxElements + (count % maxElements > 0 ? 1 : 0);
  if (blocks > stream.blocks.size() / (stride / 4)) return "its compressed data ends too early";
  bytes.resize(count * stride);
  std::array<char, kMaxStride> previous{};
  stream.first.copy(previous.data(), stride);
  for (std::size_t done = 0; done < count; done += maxElements)
    if (!decodeBlock(stream, std::min(maxElements, count - done), previous,
                     bytes.data() + done * stride))
      return "its compressed data ends too early";
  return stream.blocks.empty() ? ""
                               : "its compressed data has " + std::to_string(stream.blocks.size()) +
                                     " bytes too many";
}

}  // namespace enfilade::scene
