// The GLSL of both passes: which depth surfaces have, and how what is nearest is lit.
#pragma once

#include <string>

namespace enfilade::render {

/// What a surface's shader has to do; each combination is a program of its own, so that plain
/// surfaces pay for nothing else.
struct SurfaceVariant {
  bool textured = false;
  bool mask = false;     ///< cuts holes: costs the early depth test
  bool blend = false;    ///< colour only, with alpha
  bool normals = false;  ///< writes them to colour attachment 2
  bool shadows = false;  ///< the sun shines where the texture at binding 1 says
  bool plan = false;     ///< orthographic; else a perspective
  bool shaded = true;    ///< else depth and id alone, to the last bit those of the shaded one
};

std::string surfaceVertexSource();
std::string surfaceFragmentSource(const SurfaceVariant& variant);
std::string skyVertexSource();
std::string skyFragmentSource();

/// Twin of the GLSL block `Frame` (std140), at uniform binding 0. Positions are relative to the
/// eye, with the world's axes.
struct FrameUniforms {
  float clipFromRelative[16];  ///< column-major; reversed depth: near 1, far 0
  float forward[4];            ///< w: 1 orthographic, 0 perspective
  float middle[4];             ///< world direction of the picture's middle; z along forward is 1
  float rightByX[4];           ///< world right, divided by View::scaleX
  float upByY[4];              ///< world up, divided by View::scaleY
};

/// Attribute places shared by the shaders and the vertex array.
enum class Attribute : unsigned {
  position,
  normal,
  uv,
  rowX,  ///< per instance from here: relativeFromMesh, row by row
  rowY,
  rowZ,
  baseColour,
  emissive,  ///< w: 1 when the transform mirrors
  surface,   ///< alpha cutoff, metallic, roughness, 1 when double-sided
  id
};

}  // namespace enfilade::render
