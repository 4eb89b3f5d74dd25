// Runs code that may abort or hang in child processes, so that the parent survives.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <type_traits>
#include <vector>

namespace enfilade::benchmarks {

/// Calls `one` with 0, 1, ..., count - 1 in a child, in this order, each with `record` zeroed bytes
/// that the caller receives. If the child dies or needs more than `seconds` for one number, a new
/// child continues with the next number. Returns for each number whether it finished.
std::vector<bool> runGuarded(std::size_t count, unsigned seconds, std::span<std::byte> records,
                             const std::function<void(std::size_t, std::byte*)>& one);

/// The same with a record type; records of unfinished calls are T{}.
template <typename T>
std::vector<T> computeGuarded(std::size_t count, unsigned seconds,
                              const std::function<T(std::size_t)>& one) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<T> results(count);
  const auto bytes = std::as_writable_bytes(std::span(results));
  const auto ended = runGuarded(count, seconds, bytes, [&](std::size_t k, std::byte* record) {
    const T result = one(k);
    std::copy_n(reinterpret_cast<const std::byte*>(&result), sizeof(T), record);
  });
  for (std::size_t k = 0; k < count; ++k) {
    if (!ended[k]) results[k] = T{};
  }
  return results;
}

}  // namespace enfilade::benchmarks
