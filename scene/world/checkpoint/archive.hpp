// Values to bytes and back. How a type lies in the bytes is told once, by Layout<T>::archive(), for
// both directions: a Writer takes it from a const T, a Reader gives it to a T. A struct's layout
// names all of its members in a structured binding, so that a member that is added later stops the
// build until somebody has said what becomes of it.
//
// Counts, ids and enums are of variable length, seven bits a byte, least first; doubles are their
// eight bytes, little-endian.
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
#include "scene/world/checkpoint/checkpoint.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

/// What Archive gives to a layout: what is written is not changed.
template <class Archive, class T>
using Held = std::conditional_t<Archive::kWrites, const T, T>;

template <class T>
struct Layout;

class Writer {
 public:
  static constexpr bool kWrites = true;

  template <class... T>
  void operator()(const T&... values) {
    (Layout<T>::archive(*this, values), ...);
  }
  void number(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  /// Least byte first.
  void fixed(std::uint64_t word) {
    for (int shift = 0; shift < 64; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  }

  std::vector<std::uint8_t> bytes;
};

/// Throws CheckpointError, naming the byte, where the bytes end or a value cannot be.
class Reader {
 public:
  static constexpr bool kWrites = false;
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  Lengths lengths;  ///< of the world that is read, once they are

  template <class... T>
  void operator()(T&... values) {
    (Layout<T>::archive(*this, values), ...);
  }
  std::uint64_t number(std::uint64_t most = ~std::uint64_t{0}) {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = this->byte();
      value |= std::uint64_t{byte & 0x7Fu} << shift;
      if (shift == 63 && byte > 1) refuse("a number is too long");
      if (byte < 0x80) break;
    }
    if (value > most) refuse(std::to_string(value) + " is more than " + std::to_string(most));
    return value;
  }
  std::uint64_t fixed() {
    std::uint64_t word = 0;
    for (int shift = 0; shift < 64; shift += 8) word |= std::uint64_t{byte()} << shift;
    return word;
  }
  /// Of a list: each of its elements takes a byte at least, so that nothing is grown for a number
  /// alone.
  std::size_t count() { return static_cast<std::size_t>(number(left())); }
  std::uint8_t byte() {
    if (at_ == bytes_.size()) refuse("it ends too early");
    return bytes_[at_++];
  }
  std::size_t left() const { return bytes_.size() - at_; }
  [[noreturn]] void refuse(const std::string& why) const {
    throw CheckpointError("the checkpoint is damaged at byte " + std::to_string(at_) + ": " + why);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// ---- numbers -----------------------------------------------------------------------------------

template <>
struct Layout<bool> {
  static void archive(Writer& a, bool value) { a.number(value ? 1 : 0); }
  static void archive(Reader& a, bool& value) { value = a.number(1) == 1; }
};

template <class T>
requires std::is_unsigned_v<T>
struct Layout<T> {
  static void archive(Writer& a, T value) { a.number(value); }
  static void archive(Reader& a, T& value) {
    value = static_cast<T>(a.number(std::numeric_limits<T>::max()));
  }
};

/// Not below -1: all that are signed are indices or counts.
template <>
struct Layout<std::int32_t> {
  static void archive(Writer& a, std::int32_t value) {
    a.number(static_cast<std::uint64_t>(value) + 1);
  }
  static void archive(Reader& a, std::int32_t& value) {
    value = static_cast<std::int32_t>(a.number(0x7FFF'FFFF)) - 1;
  }
};

/// Beyond any length, mass or speed of a world, and so small that what a tick makes of it stays
/// finite.
inline constexpr double kGreatestValue = 1e30;

template <>
struct Layout<double> {
  static void archive(Writer& a, double value) { a.fixed(std::bit_cast<std::uint64_t>(value)); }
  static void archive(Reader& a, double& value) {
    value = std::bit_cast<double>(a.fixed());
    if (!(std::abs(value) <= kGreatestValue)) a.refuse("a value is beyond all bounds");
  }
};

/// What may be infinite, too: a box that is empty, a leash that is none.
inline void archiveExtended(Writer& a, double value) {
  a.fixed(std::bit_cast<std::uint64_t>(value));
}
inline void archiveExtended(Reader& a, double& value) {
  value = std::bit_cast<double>(a.fixed());
  if (std::isnan(value)) a.refuse("a value is no number");
}

/// The last enumerator.
template <class Enum>
struct MostOf;

template <class Enum>
requires std::is_enum_v<Enum>
struct Layout<Enum> {
  static void archive(Writer& a, Enum value) { a.number(static_cast<std::uint64_t>(value)); }
  static void archive(Reader& a, Enum& value) {
    value = static_cast<Enum>(a.number(static_cast<std::uint64_t>(MostOf<Enum>::value)));
  }
};

/// Vectors, matrices and quaternions: their coefficients.
template <class Matrix>
struct Coefficients {
  template <class A>
  static void archive(A& a, Held<A, Matrix>& m) {
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
  static void archive(A& a, Held<A, collision::Quat>& q) {
    Coefficients<Eigen::Vector4d>::archive(a, q.coeffs());
    constexpr double kRounding = 1e-6;  // far more than a world's rotations are off
    if constexpr (!A::kWrites)
      if (!(std::abs(q.squaredNorm() - 1) <= kRounding)) a.refuse("a rotation is not of length 1");
  }
};

template <>
struct Layout<collision::Box> {
  template <class A>
  static void archive(A& a, Held<A, collision::Box>& box) {
    auto& [min, max] = box;
    for (Eigen::Index i = 0; i < 3; ++i) archiveExtended(a, min.data()[i]);
    for (Eigen::Index i = 0; i < 3; ++i) archiveExtended(a, max.data()[i]);
  }
};

// ---- lists -------------------------------------------------------------------------------------

template <>
struct Layout<std::string> {
  static void archive(Writer& a, const std::string& text) {
    a.number(text.size());
    a.bytes.insert(a.bytes.end(), text.begin(), text.end());
  }
  static void archive(Reader& a, std::string& text) {
    text.clear();
    for (std::size_t left = a.count(); left > 0; --left)
      text.push_back(static_cast<char>(a.byte()));
  }
};

/// Grown element by element, so that a count without its elements costs nothing.
template <class List>
struct ListLayout {
  static void archive(Writer& a, const List& list) {
    a.number(list.size());
    for (const auto& element : list) a(element);
  }
  static void archive(Reader& a, List& list) {
    list.clear();
    for (std::size_t left = a.count(); left > 0; --left) a(list.emplace_back());
  }
};
template <class T>
struct Layout<std::vector<T>> : ListLayout<std::vector<T>> {};
template <class T>
struct Layout<std::deque<T>> : ListLayout<std::deque<T>> {};

template <class T, std::size_t kSize>
struct Layout<std::array<T, kSize>> {
  template <class A>
  static void archive(A& a, Held<A, std::array<T, kSize>>& list) {
    for (auto& element : list) a(element);
  }
};

template <class First, class Second>
struct Layout<std::pair<First, Second>> {
  template <class A>
  static void archive(A& a, Held<A, std::pair<First, Second>>& pair) {
    a(pair.first, pair.second);
  }
};

/// Ascending keys, each once.
template <class Key, class T>
struct Layout<std::map<Key, T>> {
  static void archive(Writer& a, const std::map<Key, T>& map) {
    a.number(map.size());
    for (const auto& [key, value] : map) a(key, value);
  }
  static void archive(Reader& a, std::map<Key, T>& map) {
    map.clear();
    for (std::size_t left = a.count(); left > 0; --left) {
      Key key{};
      a(key);
      if (!map.empty() && !(map.rbegin()->first < key)) a.refuse("keys do not ascend");
      a(map.try_emplace(map.end(), std::move(key))->second);
    }
  }
};

/// What may be there: T itself follows a 1.
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
    T made{};
    a(made);
    give(std::move(made), value);
  }

 private:
  static void give(T made, std::optional<T>& to) { to = std::move(made); }
  static void give(T made, std::unique_ptr<T>& to) { to = std::make_unique<T>(std::move(made)); }
  static void give(T made, std::shared_ptr<const T>& to) {
    to = std::make_shared<const T>(std::move(made));
  }
};
template <class T>
struct Layout<std::optional<T>> : MaybeLayout<std::optional<T>, T> {};
template <class T>
struct Layout<std::unique_ptr<T>> : MaybeLayout<std::unique_ptr<T>, T> {};
template <class T>
struct Layout<std::shared_ptr<const T>> : MaybeLayout<std::shared_ptr<const T>, T> {};

/// Which it is, then itself.
template <class... Ts>
struct Layout<std::variant<Ts...>> {
  using Variant = std::variant<Ts...>;
  static void archive(Writer& a, const Variant& value) {
    a.number(value.index());
    std::visit([&](const auto& one) { a(one); }, value);
  }
  static void archive(Reader& a, Variant& value) {
    const std::uint64_t index = a.number(sizeof...(Ts) - 1);
    std::uint64_t i = 0;
    ((i++ == index ? a(value.template emplace<Ts>()) : void()), ...);
  }
};

}  // namespace enfilade::scene
