// All materials of the bundled building, by name.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::assets {

/// The value is the material's index in every model made here.
enum class Paint : std::uint32_t {
  // walls
  wallWhite,
  wallRed,
  wallOchre,
  wallSage,
  wallBlue,
  wallPlum,
  wallTeal,
  wallIvory,
  wallSand,
  wallLibrary,
  wallCafe,
  wallMist,
  reveal,
  facade,
  facadeTrim,
  plinthStone,
  ceiling,
  cornice,
  // floors
  oakLight,
  oak,
  oakDark,
  walnutLight,
  walnut,
  walnutDark,
  limestone,
  limestoneDark,
  slateTile,
  marbleWhite,
  marbleGrey,
  terracotta,
  terracottaDark,
  concrete,
  // joinery and metal
  paintedWood,
  doorWood,
  doorPanel,
  brass,
  steel,
  darkIron,
  gilt,
  blackMetal,
  chrome,
  // furniture
  leather,
  leatherGreen,
  fabricRed,
  fabricBlue,
  fabricCream,
  fabricGrey,
  mahogany,
  birch,
  // glass and light
  glass,
  caseGlass,
  lampGlow,
  spotGlow,
  lampShade,
  screenGlow,
  // rugs and curtains
  rugRed,
  rugBlue,
  rugGold,
  curtainCream,
  curtainRed,
  curtainGreen,
  // art
  canvas,
  paintBlack,
  paintWhite,
  paintRed,
  paintOrange,
  paintYellow,
  paintGreen,
  paintDeepGreen,
  paintSky,
  paintBlue,
  paintNavy,
  paintViolet,
  paintPink,
  paintSkin,
  paintUmber,
  paintGrey,
  plaster,
  bronze,
  clay,
  celadon,
  cobalt,
  stoneDark,
  // books
  bookRed,
  bookBlue,
  bookGreen,
  bookBrown,
  bookOchre,
  bookBlack,
  bookCream,
  bookTeal,
  paper,
  // outside
  leaf,
  leafDark,
  leafLight,
  bark,
  soil,
  lawn,
  gravel,
  paving,
  pavingDark,
  slateRoof,
  copperRoof,
  asphalt,
  kerb,
  roadPaint,
  brick,
  brickDark,
  stucco,
  stuccoPink,
  stuccoGreen,
  roofTile,
  count
};

/// The materials in the order of Paint. Colours are linear.
std::vector<scene::Material> makePaletteMaterials();

}  // namespace enfilade::assets
