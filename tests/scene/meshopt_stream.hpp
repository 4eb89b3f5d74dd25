// Writer of streams of version 1 of meshopt's vertex codec, which Debian 12's library lacks. Its
// modes are drawn from a seed among those that can represent the data, not the shortest ones.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace enfilade::tests {

struct MeshoptStream {
  std::string bytes;
  std::array<unsigned, 4> controls{};                ///< how often each control was used
  std::array<std::array<unsigned, 4>, 2> headers{};  ///< of control 0 and 1, each bit length
  std::array<unsigned, 3> channels{};                ///< how often each mode of a channel was used
};

class MeshoptStreamWriter {
 public:
  MeshoptStreamWriter(const std::string& elements, std::size_t stride, unsigned seed)
      : elements_(elements), stride_(stride), random_(seed) {}

  MeshoptStream write() {
    const std::size_t count = elements_.size() / stride_;
    const std::size_t maxElements = std::min<std::size_t>(8192 / stride_ / 16 * 16, 256);
    std::string baseline, channels;
    for (std::size_t i = 0; i < stride_; ++i) baseline += static_cast<char>(random_());
    for (std::size_t i = 0; i < stride_ / 4; ++i) {
      const unsigned mode = draw(3);
      ++stream_.channels[mode];
      channels += static_cast<char>(mode == 2 ? mode | draw(16) << 4 : mode);
    }
    elements_.insert(0, baseline);
    stream_.bytes = "\xa1";
    for (std::size_t first = 0; first < count; first += maxElements)
      writeBlock(first, std::min(maxElements, count - first), channels);
    const std::size_t tail = stride_ + stride_ / 4;
    stream_.bytes.append(tail < 24 ? 24 - tail : 0, '\0');
    stream_.bytes += baseline + channels;
    return stream_;
  }

 private:
  using Plane = std::vector<unsigned char>;

  unsigned draw(unsigned choices) { return static_cast<unsigned>(random_()) % choices; }

  /// Of the word of a channel and the one before it.
  static std::uint32_t encodeDelta(unsigned channel, std::uint32_t word, std::uint32_t before) {
    if ((channel & 15) == 2) return std::rotl(word ^ before, static_cast<int>(channel >> 4));
    const unsigned bits = channel == 1 ? 16 : 8;
    const std::uint32_t mask = (1u << bits) - 1;
    std::uint32_t deltas = 0;
    for (unsigned at = 0; at < 32; at += bits) {
      const std::uint32_t delta = ((word >> at) - (before >> at)) & mask;
      const std::uint32_t zigzag = delta >> (bits - 1) != 0 ? ~(delta << 1) : delta << 1;
      deltas |= (zigzag & mask) << at;
    }
    return deltas;
  }

  void writeBlock(std::size_t first, std::size_t count, const std::string& channels) {
    std::string controls, data;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      std::array<Plane, 4> planes;
      for (std::size_t i = first; i < first + count; ++i) {
        std::uint32_t before = 0, word = 0;
        std::memcpy(&before, elements_.data() + i * stride_ + 4 * c, 4);
        std::memcpy(&word, elements_.data() + (i + 1) * stride_ + 4 * c, 4);
        const auto delta = encodeDelta(static_cast<unsigned char>(channels[c]), word, before);
        for (unsigned k = 0; k < 4; ++k)
          planes[k].push_back(static_cast<unsigned char>(delta >> 8 * k));
      }
      unsigned control = 0;
      for (unsigned k = 0; k < 4; ++k) control |= writePlane(planes[k], data) << 2 * k;
      controls += static_cast<char>(control);
    }
    stream_.bytes += controls + data;
  }

  static bool isZero(const Plane& deltas) {
    return std::ranges::all_of(deltas, [](unsigned char delta) { return delta == 0; });
  }

  /// Returns the plane's control.
  unsigned writePlane(const Plane& deltas, std::string& to) {
    unsigned control = draw(4);
    if (control == 2 && !isZero(deltas)) control = 1;
    ++stream_.controls[control];
    if (control == 2) return control;
    if (control == 3) to.append(deltas.begin(), deltas.end());
    if (control == 3) return control;
    const std::size_t groups = (deltas.size() + 15) / 16, headers = to.size();
    to.append((groups + 3) / 4, '\0');
    for (std::size_t g = 0; g < groups; ++g) {
      Plane group(deltas.begin() + static_cast<std::ptrdiff_t>(16 * g), deltas.end());
      group.resize(16);
      unsigned header = draw(4);
      if (control == 0 && header == 0 && !isZero(group)) header = 1 + draw(3);
      ++stream_.headers[control][header];
      to[headers + g / 4] |= static_cast<char>(header << 2 * (g % 4));
      writeGroup(group, control == 0 ? header == 0 ? 0 : 1u << (header - 1) : 1u << header, to);
    }
    return control;
  }

  static void writeGroup(const Plane& group, unsigned bits, std::string& to) {
    if (bits == 0) return;
    const unsigned escape = (1u << bits) - 1;
    std::string packed(2 * bits, '\0'), escaped;
    for (unsigned i = 0; i < 16; ++i) {
      const unsigned value = bits == 8 ? group[i] : std::min<unsigned>(group[i], escape);
      const unsigned at = i * bits % 8;
      packed[i * bits / 8] |= static_cast<char>(value << (bits == 1 ? at : 8 - bits - at));
      if (bits < 8 && value == escape) escaped += static_cast<char>(group[i]);
    }
    to += packed + escaped;
  }

  std::string elements_;  ///< with the one before the first
  std::size_t stride_;
  std::mt19937 random_;
  MeshoptStream stream_;
};

inline std::string packVerticesOfVersion1(const std::string& elements, std::size_t stride) {
  return MeshoptStreamWriter(elements, stride, 1).write().bytes;
}

}  // namespace enfilade::tests
