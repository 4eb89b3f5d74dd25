// Fields of the model stream as bytes in memory order; each read is checked. Private to
// model_stream.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "scene/import/worker/model_stream_error.hpp"
#include "scene/import/worker/model_stream_sink.hpp"

namespace enfilade::scene {

static_assert(std::endian::native == std::endian::little, "the stream has memory byte order");

/// Scalars of a vector of scalars or of fixed-size Eigen vectors, which lie without gaps.
template <class T>
constexpr std::size_t kPackedSize = sizeof(T);
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(Eigen::Vector2f) == 8);

/// Passes bytes on in large blocks, or only counts them.
class StreamWriter {
 public:
  /// Empty: counts.
  explicit StreamWriter(const ModelStreamSink& sink) : sink_(sink) {}

  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { append(&value, sizeof value); }
  void put(const std::string& text) {
    put(std::uint64_t{text.size()});
    append(text.data(), text.size());
  }
  template <class T>
  void putArray(const std::vector<T>& values) {
    put(std::uint64_t{values.size()});
    append(values.data(), values.size() * kPackedSize<T>);
  }
  template <class Derived>
  void putMatrix(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index r = 0; r < m.rows(); ++r) {
      for (Eigen::Index c = 0; c < m.cols(); ++c) put(m(r, c));
    }
  }
  /// Passes the rest on. Returns the number of bytes.
  std::uint64_t finish() {
    flush();
    return size_;
  }

 private:
  static constexpr std::size_t kBlockBytes = 1 << 20;

  void append(const void* data, std::size_t size) {
    size_ += size;
    if (size == 0 || !sink_) return;
    const auto* begin = static_cast<const std::byte*>(data);
    if (block_.size() + size > kBlockBytes) flush();
    if (size > kBlockBytes) return sink_({begin, size});
    block_.insert(block_.end(), begin, begin + size);
  }
  void flush() {
    if (!block_.empty()) sink_(block_);
    block_.clear();
  }

  const ModelStreamSink& sink_;
  std::uint64_t size_ = 0;
  std::vector<std::byte> block_;
};

class StreamReader {
 public:
  explicit StreamReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> T get(const char* field) {
    T value;
    take(&value, sizeof value, field);
    return value;
  }
  bool getBool(const char* field) { return getUpTo(1, field) == 1; }
  std::uint8_t getUpTo(std::uint8_t maxValue, const char* field) {
    const auto value = get<std::uint8_t>(field);
    if (value > maxValue) fail(field, "value " + std::to_string(value) + " is unknown");
    return value;
  }
  double getFinite(const char* field) {
    const double value = get<double>(field);
    if (!std::isfinite(value)) fail(field, "not a finite number");
    return value;
  }
  std::string getText(const char* field) {
    const std::size_t size = count(1, field);
    const auto* first = reinterpret_cast<const char*>(bytes_.data() + position_);
    position_ += size;
    return {first, size};
  }
  std::vector<std::uint8_t> getBytes(const char* field) {
    const std::size_t size = count(1, field);
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes_.data() + position_);
    position_ += size;
    return {first, first + size};
  }
  template <class T>
  std::vector<T> getArray(const char* field) {
    std::vector<T> values(count(kPackedSize<T>, field));
    take(values.data(), values.size() * kPackedSize<T>, field);
    return values;
  }
  template <class Matrix>
  Matrix getMatrix(const char* field) {
    Eigen::Array<typename Matrix::Scalar, Matrix::RowsAtCompileTime, Matrix::ColsAtCompileTime,
                 Matrix::ColsAtCompileTime == 1 ? Eigen::ColMajor : Eigen::RowMajor>
        rows;
    take(rows.data(), sizeof rows, field);
    if (!rows.allFinite()) fail(field, "not a finite number");
    return rows.matrix();
  }
  /// Reads a count of items that take at least `smallest` bytes each.
  std::size_t count(std::size_t smallest, const char* field) {
    const auto n = get<std::uint64_t>(field);
    if (n > remaining() / smallest) {
      fail(field, "count " + std::to_string(n) + " exceeds the " + std::to_string(remaining()) +
                      " bytes that remain");
    }
    return static_cast<std::size_t>(n);
  }
  std::size_t remaining() const { return bytes_.size() - position_; }

  [[noreturn]] void fail(const char* field, const std::string& what) const {
    throw ModelStreamError("model stream, byte " + std::to_string(position_) + ", " + field + ": " +
                           what);
  }

 private:
  void take(void* to, std::size_t size, const char* field) {
    if (size > remaining()) fail(field, "the stream ends here");
    // Eigen vectors are plain arrays of scalars, as checked above; hence void.
    if (size > 0) std::memcpy(to, bytes_.data() + position_, size);
    position_ += size;
  }

  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
};

}  // namespace enfilade::scene
