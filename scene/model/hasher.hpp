// Hasher: the 64-bit hash of scenes and states, FNV-1a over words with a fold of high bits into low
// ones.
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include "collision/types.hpp"

namespace enfilade::scene {

class Hasher {
 public:
  explicit Hasher(std::uint64_t seed = 0xcbf29ce484222325ull) : state_(seed) {}

  void add(std::uint64_t word) {
    state_ = (state_ ^ word) * 0x00000100000001b3ull;
    state_ ^= state_ >> 29;
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const collision::Vec3& v) {
    add(v.x());
    add(v.y());
    add(v.z());
  }
  void add(std::string_view text) {
    add(std::uint64_t{text.size()});
    for (const char c : text) add(std::uint64_t{static_cast<unsigned char>(c)});
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_;
};

}  // namespace enfilade::scene
