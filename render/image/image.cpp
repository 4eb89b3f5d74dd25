#include "render/image/image.hpp"

#include <fcntl.h>
#include <png.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "render/camera_basis.hpp"
#include "render/image/encode.hpp"

namespace enfilade::render {
namespace {

constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;

std::size_t pixelCount(const Image& image) {
  return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

std::runtime_error pngFailure(const char* call, const png_image& png) {
  return std::runtime_error(std::string(call) + " failed: " + png.message);
}

[[noreturn]] void fileFailure(const char* call, const std::filesystem::path& file, int error) {
  throw std::runtime_error("cannot write " + file.string() + ": " + call + ": " +
                           std::strerror(error) +
                           "; the folder must exist, be writable and have room");
}

/// Closes it as well. errno of the call that failed, named in `call`; 0 when all was written.
int writeAll(int descriptor, const void* data, std::size_t bytes, const char*& call) {
  const auto* next = static_cast<const char*>(data);
  call = "write";
  int error = 0;
  while (bytes > 0 && error == 0) {
    const ssize_t written = ::write(descriptor, next, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      error = written < 0 ? errno : EIO;
    } else {
      next += written;
      bytes -= static_cast<std::size_t>(written);
    }
  }
  if (::close(descriptor) != 0 && error == 0) {
    call = "close";
    error = errno;
  }
  return error;
}

/// What `file` leads to when it is a link: renaming would replace the link instead.
std::filesystem::path followed(std::filesystem::path file) {
  constexpr int kMostLinks = 40;  // as the kernel
  std::error_code failure;
  for (int i = 0; i < kMostLinks; ++i) {
    const std::filesystem::path target = std::filesystem::read_symlink(file, failure);
    if (failure) return file;
    file = file.parent_path() / target;
  }
  fileFailure("readlink", file, ELOOP);
}

/// Whether it must be written through, not replaced.
bool isStream(std::filesystem::file_type type) {
  using Type = std::filesystem::file_type;
  return type == Type::character || type == Type::block || type == Type::fifo;
}

void writeInto(const std::filesystem::path& stream, const void* data, std::size_t bytes) {
  const int descriptor = ::open(stream.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) fileFailure("open", stream, errno);
  const char* call = "";
  if (const int error = writeAll(descriptor, data, bytes, call)) fileFailure(call, stream, error);
}

/// A box filter over one axis: which source pixels a target pixel covers.
struct Span {
  int first, last;
};
Span covered(int target, int targetSize, int sourceSize) {
  const auto edge = [&](int t) {
    return static_cast<int>(static_cast<std::int64_t>(t) * sourceSize / targetSize);
  };
  const int first = edge(target);
  return {first, std::max(edge(target + 1), first + 1)};
}

std::array<float, 256> linearOfSrgb() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double s = static_cast<double>(i) / 255;
    table[i] = static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
  }
  return table;
}

std::uint8_t srgbOfLinear(float linear) {
  const double l = linear;
  const double s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(std::clamp(s, 0.0, 1.0) * 255));
}

}  // namespace

Image colourOf(const Frame& frame) {
  return {frame.camera.width, frame.camera.height, frame.rgb};
}

std::vector<std::uint8_t> encodePng(const Image& image) {
  return encodePng(Raster<std::uint8_t>{image.width, image.height, 3, image.rgb});
}

Image decodePng(const std::vector<std::uint8_t>& bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&png, bytes.data(), bytes.size())) {
    throw pngFailure("png_image_begin_read_from_memory", png);
  }
  if (std::uint64_t{png.width} * png.height > kMostPixels) {
    png_image_free(&png);
    throw std::runtime_error("decodePng: the picture has more than 2^28 pixels");
  }
  png.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.rgb.resize(3 * pixelCount(image));
  const png_color black{0, 0, 0};
  if (!png_image_finish_read(&png, &black, image.rgb.data(), 0, nullptr)) {
    throw pngFailure("png_image_finish_read", png);
  }
  return image;
}

void writeFileWhole(const std::filesystem::path& asked, const void* data, std::size_t bytes) {
  const std::filesystem::path file = followed(asked);
  std::error_code unknown;
  if (isStream(std::filesystem::status(file, unknown).type())) {
    writeInto(file, data, bytes);
    return;
  }
  static std::atomic<unsigned> count{0};
  std::filesystem::path part = file;
  part += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(count++);
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) fileFailure("open", file, errno);
  const char* call = "";
  int error = writeAll(descriptor, data, bytes, call);
  if (error == 0 && ::rename(part.c_str(), file.c_str()) != 0) {
    call = "rename";
    error = errno;
  }
  if (error == 0) return;
  ::unlink(part.c_str());
  fileFailure(call, file, error);
}

void writePng(const std::filesystem::path& file, const Image& image) {
  const std::vector<std::uint8_t> png = encodePng(image);
  writeFileWhole(file, png.data(), png.size());
}

Image scaled(const Image& image, int width, int height) {
  static const std::array<float, 256> linear = linearOfSrgb();
  Image result{width, height, {}};
  result.rgb.reserve(3 * pixelCount(result));
  for (int y = 0; y < height; ++y) {
    const Span rows = covered(y, height, image.height);
    for (int x = 0; x < width; ++x) {
      const Span columns = covered(x, width, image.width);
      std::array<float, 3> sum{};
      for (int v = rows.first; v < rows.last; ++v) {
        for (int u = columns.first; u < columns.last; ++u) {
          const std::size_t at =
              3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                   static_cast<std::size_t>(u));
          for (std::size_t c = 0; c < 3; ++c) sum[c] += linear[image.rgb[at + c]];
        }
      }
      const auto count =
          static_cast<float>((rows.last - rows.first) * (columns.last - columns.first));
      for (const float s : sum) result.rgb.push_back(srgbOfLinear(s / count));
    }
  }
  return result;
}

Vec3 project(const Camera& camera, const Vec3& worldPoint) {
  const View view = viewOf(camera);
  const Vec3 toPoint = worldPoint - camera.eye;
  const double z = view.forward.dot(toPoint);
  const bool perspective = camera.projection == Camera::Projection::perspective;
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  if (perspective && !(z > 0)) return {kNowhere, kNowhere, z};
  const double shrink = perspective ? z : 1;
  const double x = view.scaleX * view.right.dot(toPoint) / shrink + view.shiftX;
  const double y = view.scaleY * view.up.dot(toPoint) / shrink + view.shiftY;
  return {(1 + x) * camera.width / 2, (1 - y) * camera.height / 2, z};
}

}  // namespace enfilade::render
