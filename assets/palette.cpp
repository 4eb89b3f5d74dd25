#include "assets/palette.hpp"

#include <array>

namespace enfilade::assets {
namespace {

struct Entry {
  const char* name;
  std::uint32_t srgb;  ///< 0xRRGGBB
  float roughness = 0.9f;
  float metallic = 0;
  float alpha = 1;
  float glow = 0;  ///< emissive, in units of the colour
};

constexpr std::array<Entry, static_cast<std::size_t>(Paint::count)> kEntries{{
    {"wall_white", 0xEFEAE0},
    {"wall_red", 0xA8443A},
    {"wall_ochre", 0xD9A441},
    {"wall_sage", 0x8FA67C},
    {"wall_blue", 0x3D5E8C},
    {"wall_plum", 0x7E4A6B},
    {"wall_teal", 0x2F7F80},
    {"wall_ivory", 0xEDE3CC},
    {"wall_sand", 0xDCC6A0},
    {"wall_library", 0x5E7360},
    {"wall_cafe", 0xE3B7A0},
    {"wall_mist", 0xC4D0D6},
    {"reveal", 0xF3EFE6},
    {"facade", 0xE6D5B3},
    {"facade_trim", 0xF4ECDC},
    {"plinth_stone", 0xA79D8D},
    {"ceiling", 0xF7F4EC},
    {"cornice", 0xFFFCF4},
    {"oak_light", 0xC99A62, 0.55f},
    {"oak", 0xBC8A52, 0.55f},
    {"oak_dark", 0xAD7B45, 0.55f},
    {"walnut_light", 0x8E6340, 0.5f},
    {"walnut", 0x7F5535, 0.5f},
    {"walnut_dark", 0x6F492C, 0.5f},
    {"limestone", 0xD8CDB8, 0.7f},
    {"limestone_dark", 0xC5B89F, 0.7f},
    {"slate_tile", 0x6D747A, 0.6f},
    {"marble_white", 0xEEEAE4, 0.3f},
    {"marble_grey", 0x9A9C9F, 0.3f},
    {"terracotta", 0xC4764F, 0.8f},
    {"terracotta_dark", 0xB16542, 0.8f},
    {"concrete", 0x9B9892},
    {"painted_wood", 0xF5F1E8, 0.6f},
    {"door_wood", 0x8A5A34, 0.5f},
    {"door_panel", 0xA06C40, 0.5f},
    {"brass", 0xC9A24A, 0.35f, 0.6f},
    {"steel", 0xA9B0B5, 0.4f, 0.6f},
    {"dark_iron", 0x3B3D42, 0.6f, 0.3f},
    {"gilt", 0xD0A84C, 0.4f, 0.5f},
    {"black_metal", 0x26272B, 0.6f, 0.2f},
    {"chrome", 0xD4D8DB, 0.2f, 0.7f},
    {"leather", 0x7A4528, 0.6f},
    {"leather_green", 0x35553F, 0.6f},
    {"fabric_red", 0xA2333A, 0.95f},
    {"fabric_blue", 0x44648F, 0.95f},
    {"fabric_cream", 0xE4D6B8, 0.95f},
    {"fabric_grey", 0x8B8C8E, 0.95f},
    {"mahogany", 0x6B3423, 0.45f},
    {"birch", 0xDDBF90, 0.55f},
    {"glass", 0xCFE3EA, 0.05f, 0, 0.22f},
    {"case_glass", 0xD8ECEF, 0.05f, 0, 0.16f},
    {"lamp_glow", 0xFFE9BF, 0.8f, 0, 1, 1.0f},
    {"spot_glow", 0xFFF4DC, 0.8f, 0, 1, 1.0f},
    {"lamp_shade", 0xF6E3B4, 0.9f, 0, 1, 0.35f},
    {"screen_glow", 0x9FD0E8, 0.4f, 0, 1, 0.7f},
    {"rug_red", 0x8E2C32, 1},
    {"rug_blue", 0x2F4A73, 1},
    {"rug_gold", 0xC8A050, 1},
    {"curtain_cream", 0xEADFC4, 1},
    {"curtain_red", 0x96343A, 1},
    {"curtain_green", 0x5B7656, 1},
    {"canvas", 0xE9E0CB, 1},
    {"paint_black", 0x1F1D1E},
    {"paint_white", 0xF6F3EA},
    {"paint_red", 0xC23A2B},
    {"paint_orange", 0xE07B2F},
    {"paint_yellow", 0xEBC143},
    {"paint_green", 0x6E9B4B},
    {"paint_deep_green", 0x33563B},
    {"paint_sky", 0x9CC4DC},
    {"paint_blue", 0x3C76B5},
    {"paint_navy", 0x22375E},
    {"paint_violet", 0x6C4C8C},
    {"paint_pink", 0xE2A6A4},
    {"paint_skin", 0xDDB08C},
    {"paint_umber", 0x5D4030},
    {"paint_grey", 0x8F908C},
    {"plaster", 0xF1EDE4, 0.8f},
    {"bronze", 0x7A5A33, 0.4f, 0.5f},
    {"clay", 0xB5633F, 0.8f},
    {"celadon", 0x9CC0A5, 0.35f},
    {"cobalt", 0x2A4F9E, 0.3f},
    {"stone_dark", 0x56534F, 0.7f},
    {"book_red", 0x8D2F2C},
    {"book_blue", 0x2E4A74},
    {"book_green", 0x35593F},
    {"book_brown", 0x6B4629},
    {"book_ochre", 0xBE8B3A},
    {"book_black", 0x2A2829},
    {"book_cream", 0xDCCDA9},
    {"book_teal", 0x2F6F70},
    {"paper", 0xF2EBD8},
    {"leaf", 0x4F7F3C, 1},
    {"leaf_dark", 0x375F33, 1},
    {"leaf_light", 0x7BA451, 1},
    {"bark", 0x6A4F38, 1},
    {"soil", 0x4B382A, 1},
    {"lawn", 0x7FA05A, 1},
    {"gravel", 0xCBBfa3, 1},
    {"paving", 0xBDB4A4, 1},
    {"paving_dark", 0xA89F90, 1},
    {"slate_roof", 0x5B6370, 0.8f},
    {"copper_roof", 0x6FA08C, 0.7f},
    {"asphalt", 0x55565A, 1},
    {"kerb", 0xA6A49E, 1},
    {"road_paint", 0xEDEBE2, 1},
    {"brick", 0xA9573F, 1},
    {"brick_dark", 0x83453A, 1},
    {"stucco", 0xE2C79A, 1},
    {"stucco_pink", 0xDDA58E, 1},
    {"stucco_green", 0xB4C1A0, 1},
    {"roof_tile", 0xB5593A, 1},
}};

/// sRGB to linear by a cubic (within 1 %): pow() would differ between libraries.
float toLinear(std::uint32_t byte) {
  const double c = static_cast<double>(byte & 0xffu) / 255.0;
  return static_cast<float>(c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878));
}

scene::Material makeMaterial(const Entry& entry) {
  scene::Material m;
  m.name = entry.name;
  const Eigen::Vector3f rgb{toLinear(entry.srgb >> 16), toLinear(entry.srgb >> 8),
                            toLinear(entry.srgb)};
  m.baseColour = {rgb.x(), rgb.y(), rgb.z(), entry.alpha};
  m.emissive = entry.glow * rgb;
  m.metallic = entry.metallic;
  m.roughness = entry.roughness;
  if (entry.alpha < 1) m.alpha = scene::Material::Alpha::blend;
  return m;
}

}  // namespace

std::vector<scene::Material> makePaletteMaterials() {
  static_assert(kEntries.back().name != nullptr, "a Paint without an entry");
  std::vector<scene::Material> materials;
  for (const Entry& entry : kEntries) materials.push_back(makeMaterial(entry));
  return materials;
}

}  // namespace enfilade::assets
