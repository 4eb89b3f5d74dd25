#include "server/navigation/map_format.hpp"

#include <utility>

#include "render/image/encode.hpp"

namespace enfilade::server {
namespace {

/// Each row begins with a byte; its highest bit is the first cell.
std::vector<std::uint8_t> packCells(const scene::NavigationMap& map) {
  const std::size_t rowBytes = (std::size_t{map.width} + 7) / 8;
  std::vector<std::uint8_t> bits(rowBytes * map.height, 0);
  for (std::size_t row = 0; row < map.height; ++row)
    for (std::size_t column = 0; column < map.width; ++column)
      if (map.cells[row * map.width + column] != 0)
        bits[row * rowBytes + column / 8] |= static_cast<std::uint8_t>(0x80u >> (column % 8));
  return bits;
}

}  // namespace

std::vector<std::uint8_t> encodeMap(scene::NavigationMap map,
                                    v1::NavigationQuery::Map::Format format) {
  switch (format) {
    case v1::NavigationQuery::Map::FORMAT_BITS:
      return packCells(map);
    case v1::NavigationQuery::Map::FORMAT_PNG:
      for (std::uint8_t& cell : map.cells) cell = cell != 0 ? 255 : 0;
      return render::encodePng(render::Raster<std::uint8_t>{
          static_cast<int>(map.width), static_cast<int>(map.height), 1, map.cells});
    default:
      return std::move(map.cells);
  }
}

}  // namespace enfilade::server
