// Binary archive of values. Layout<T>::archive() defines the encoding of a type once, for both
// directions: a Writer reads from a const T, a Reader writes to a T. archiveMembers() names all
// members of a struct in a structured binding, so that an added member stops the build until its
// encoding is decided. Counts, ids and enums are varints (seven bits a byte, least significant
// first); doubles are their eight bytes, little-endian.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "collision/types.hpp"
#include "scene/world/checkpoint/checkpoint_error.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

/// Argument type of a layout: const when writing.
template <class Archive, class T>
using MaybeConst = std::conditional_t<Archive::kWrites, const T, T>;

/// A struct has a function archiveMembers(archive, value).
template <class T>
struct Layout {
  template <class A>
  static void archive(A& a, MaybeConst<A, T>& value) {
    archiveMembers(a, value);
  }
};

class Writer {
 public:
  static constexpr bool kWrites = true;

  template <class... T>
  void operator()(const T&... values) {
    (Layout<T>::archive(*this, values), ...);
  }
  void writeVarint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  /// Least significant byte first.
  void writeFixed64(std::uint64_t word) {
    for (int shift = 0; shift < 64; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  }

  std::vector<std::uint8_t> bytes;
};

/// Throws CheckpointError with the byte offset if the data ends early or a value is invalid.
class Reader {
 public:
  static constexpr bool kWrites = false;
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  WorldSettings settings;  ///< of the world that is read; set after they are read

  template <class... T>
  void operator()(T&... values) {
    (Layout<T>::archive(*this, values), ...);
  }
  std::uint64_t readVarint(std::uint64_t maxValue = ~std::uint64_t{0}) {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = this->readByte();
      value |= std::uint64_t{byte & 0x7Fu} << shift;
      if (shift == 63 && byte > 1) refuse("a number is too long");
      if (byte < 0x80) break;
    }
    if (value > maxValue)
      refuse(std::to_string(value) + " is more than " + std::to_string(maxValue));
    return value;
  }
  std::uint64_t readFixed64() {
    std::uint64_t word = 0;
    for (int shift = 0; shift < 64; shift += 8) word |= std::uint64_t{readByte()} << shift;
    return word;
  }
  /// Length of a list. Each element takes at least one byte, so a corrupt count allocates nothing.
  std::size_t readCount() { return static_cast<std::size_t>(readVarint(remaining())); }
  std::uint8_t readByte() {
    if (at_ == bytes_.size()) refuse("unexpected end of data");
    return bytes_[at_++];
  }
  std::size_t remaining() const { return bytes_.size() - at_; }
  [[noreturn]] void refuse(const std::string& reason) const {
    throw CheckpointError("the checkpoint is damaged at byte " + std::to_string(at_) + ": " +
                          reason);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// ---- numbers -----------------------------------------------------------------------------------

template <>
struct Layout<bool> {
  static void archive(Writer& a, bool value) { a.writeVarint(value ? 1 : 0); }
  static void archive(Reader& a, bool& value) { value = a.readVarint(1) == 1; }
};

template <class T>
requires std::is_unsigned_v<T>
struct Layout<T> {
  static void archive(Writer& a, T value) { a.writeVarint(value); }
  static void archive(Reader& a, T& value) {
    value = static_cast<T>(a.readVarint(std::numeric_limits<T>::max()));
  }
};

/// At least -1: all signed values are indices or counts.
template <>
struct Layout<std::int32_t> {
  static void archive(Writer& a, std::int32_t value) {
    a.writeVarint(static_cast<std::uint64_t>(value) + 1);
  }
  static void archive(Reader& a, std::int32_t& value) {
    value = static_cast<std::int32_t>(a.readVarint(0x7FFF'FFFF)) - 1;
  }
};

/// Above any length, mass or speed of a world, and so small that a tick's arithmetic stays finite.
inline constexpr double kMaxMagnitude = 1e30;

template <>
struct Layout<double> {
  static void archive(Writer& a, double value) {
    a.writeFixed64(std::bit_cast<std::uint64_t>(value));
  }
  static void archive(Reader& a, double& value) {
    value = std::bit_cast<double>(a.readFixed64());
    if (!(std::abs(value) <= kMaxMagnitude)) a.refuse("a value is out of range");
  }
};

/// Values that may be infinite: an empty box, an unlimited step.
inline void archiveExtended(Writer& a, double value) {
  a.writeFixed64(std::bit_cast<std::uint64_t>(value));
}
inline void archiveExtended(Reader& a, double& value) {
  value = std::bit_cast<double>(a.readFixed64());
  if (std::isnan(value)) a.refuse("a value is not a number");
}

/// The last enumerator of an enum.
template <class Enum>
constexpr Enum kMaxEnumerator;

template <class Enum>
requires std::is_enum_v<Enum>
struct Layout<Enum> {
  static void archive(Writer& a, Enum value) { a.writeVarint(static_cast<std::uint64_t>(value)); }
  static void archive(Reader& a, Enum& value) {
    value = static_cast<Enum>(a.readVarint(static_cast<std::uint64_t>(kMaxEnumerator<Enum>)));
  }
};

/// Vectors, matrices and quaternions, by coefficient.
template <class Matrix>
struct Coefficients {
  template <class A>
  static void archive(A& a, MaybeConst<A, Matrix>& m) {
    for (Eigen::Index i = 0; i < Matrix::SizeAtCompileTime; ++i) a(m.data()[i]);
  }
};
template <>
struct Layout<collision::Vec3> : Coefficients<collision::Vec3> {};
template <>
struct Layout<collision::Mat3> : Coefficients<collision::Mat3> {};
template <>
struct Layout<collision::Quat> {
  template <class A>
  static void archive(A& a, MaybeConst<A, collision::Quat>& q) {
    Coefficients<Eigen::Vector4d>::archive(a, q.coeffs());
    constexpr double kRounding = 1e-6;  // far above the error of a world's rotations
    if constexpr (!A::kWrites)
      if (!(std::abs(q.squaredNorm() - 1) <= kRounding)) a.refuse("a rotation is not unit length");
  }
};

template <class A>
void archiveMembers(A& a, MaybeConst<A, collision::Aabb>& box) {
  auto& [min, max] = box;
  for (Eigen::Index i = 0; i < 3; ++i) archiveExtended(a, min.data()[i]);
  for (Eigen::Index i = 0; i < 3; ++i) archiveExtended(a, max.data()[i]);
}

// ---- lists -------------------------------------------------------------------------------------

template <>
struct Layout<std::string> {
  static void archive(Writer& a, const std::string& text) {
    a.writeVarint(text.size());
    a.bytes.insert(a.bytes.end(), text.begin(), text.end());
  }
  static void archive(Reader& a, std::string& text) {
    text.clear();
    for (std::size_t left = a.readCount(); left > 0; --left)
      text.push_back(static_cast<char>(a.readByte()));
  }
};

/// Grows element by element, so that a count without elements costs nothing.
template <class List>
struct ListLayout {
  static void archive(Writer& a, const List& list) {
    a.writeVarint(list.size());
    for (const auto& element : list) a(element);
  }
  static void archive(Reader& a, List& list) {
    list.clear();
    for (std::size_t left = a.readCount(); left > 0; --left) a(list.emplace_back());
  }
};
template <class T>
struct Layout<std::vector<T>> : ListLayout<std::vector<T>> {};
template <class T>
struct Layout<std::deque<T>> : ListLayout<std::deque<T>> {};

template <class T, std::size_t kSize>
struct Layout<std::array<T, kSize>> {
  template <class A>
  static void archive(A& a, MaybeConst<A, std::array<T, kSize>>& list) {
    for (auto& element : list) a(element);
  }
};

template <class First, class Second>
struct Layout<std::pair<First, Second>> {
  template <class A>
  static void archive(A& a, MaybeConst<A, std::pair<First, Second>>& pair) {
    a(pair.first, pair.second);
  }
};

/// Keys ascend strictly.
template <class Key, class T>
struct Layout<std::map<Key, T>> {
  static void archive(Writer& a, const std::map<Key, T>& map) {
    a.writeVarint(map.size());
    for (const auto& [key, value] : map) a(key, value);
  }
  static void archive(Reader& a, std::map<Key, T>& map) {
    map.clear();
    for (std::size_t left = a.readCount(); left > 0; --left) {
      Key key{};
      a(key);
      if (!map.empty() && !(map.rbegin()->first < key)) a.refuse("keys do not ascend");
      a(map.try_emplace(map.end(), std::move(key))->second);
    }
  }
};

/// Optional value: a bool, then T if it is present.
template <class Pointer, class T>
struct MaybeLayout {
  static void archive(Writer& a, const Pointer& value) {
    a(static_cast<bool>(value));
    if (value) a(*value);
  }
  static void archive(Reader& a, Pointer& value) {
    bool isThere = false;
    a(isThere);
    value = {};
    if (!isThere) return;
    T loaded{};
    a(loaded);
    store(std::move(loaded), value);
  }

 private:
  static void store(T loaded, std::optional<T>& to) { to = std::move(loaded); }
  static void store(T loaded, std::unique_ptr<T>& to) {
    to = std::make_unique<T>(std::move(loaded));
  }
  static void store(T loaded, std::shared_ptr<const T>& to) {
    to = std::make_shared<const T>(std::move(loaded));
  }
};
template <class T>
struct Layout<std::optional<T>> : MaybeLayout<std::optional<T>, T> {};
template <class T>
struct Layout<std::unique_ptr<T>> : MaybeLayout<std::unique_ptr<T>, T> {};
template <class T>
struct Layout<std::shared_ptr<const T>> : MaybeLayout<std::shared_ptr<const T>, T> {};

/// Index of the alternative, then its value.
template <class... Ts>
struct Layout<std::variant<Ts...>> {
  using Variant = std::variant<Ts...>;
  static void archive(Writer& a, const Variant& value) {
    a.writeVarint(value.index());
    std::visit([&](const auto& one) { a(one); }, value);
  }
  static void archive(Reader& a, Variant& value) {
    const std::uint64_t index = a.readVarint(sizeof...(Ts) - 1);
    std::uint64_t i = 0;
    ((i++ == index ? a(value.template emplace<Ts>()) : void()), ...);
  }
};

}  // namespace enfilade::scene
