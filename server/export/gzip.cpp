#include "server/export/gzip.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace enfilade::server {
namespace {

constexpr int kGzipLevel = 6;         // the library's default; 9 saves 1 % and takes twice the time
constexpr int kGzipWindow = 15 + 16;  // the largest window, with gzip's header
constexpr int kGzipMemory = 8;        // the library's default
constexpr std::size_t kGzipStep = std::size_t{1} << 20;  // bytes of output a call

}  // namespace

std::vector<std::uint8_t> gzip(std::span<const std::uint8_t> bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, kGzipLevel, Z_DEFLATED, kGzipWindow, kGzipMemory, Z_DEFAULT_STRATEGY) !=
      Z_OK)
    throw std::runtime_error("zlib cannot start: out of memory, or another version");
  std::vector<std::uint8_t> packed;
  int state = Z_OK;
  try {
    while (state == Z_OK) {
      if (stream.avail_in == 0) {  // avail_in has 32 bits
        const std::size_t part =
            std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max());
        stream.next_in = const_cast<Bytef*>(bytes.data());  // zlib does not write there
        stream.avail_in = static_cast<uInt>(part);
        bytes = bytes.subspan(part);
      }
      const std::size_t packedBytes = packed.size();
      packed.resize(packedBytes + kGzipStep);
      stream.next_out = packed.data() + packedBytes;
      stream.avail_out = static_cast<uInt>(kGzipStep);
      state = deflate(&stream, bytes.empty() ? Z_FINISH : Z_NO_FLUSH);
      packed.resize(packed.size() - stream.avail_out);
    }
  } catch (...) {  // no memory for the output
    deflateEnd(&stream);
    throw;
  }
  deflateEnd(&stream);
  if (state != Z_STREAM_END)
    throw std::runtime_error("zlib cannot compress: error " + std::to_string(state));
  return packed;
}

}  // namespace enfilade::server
