// GLSL sources of the depth prepass, the shading passes and the sky.
#pragma once

#include <string>

namespace enfilade::render {

/// Features of a surface shader. Each combination is a separate program, so that plain surfaces do
/// not pay for unused features.
struct SurfaceVariant {
  bool textured = false;
  bool coloured = false;    ///< with vertex colours
  bool mask = false;        ///< alpha test; disables the early depth test
  bool blend = false;       ///< colour only, with alpha
  bool normals = false;     ///< writes normals to colour attachment 2
  bool shadows = false;     ///< reads the shadow mask at texture binding 1
  bool planeDepth = false;  ///< writes depth in metres to colour attachment 3
  bool plan = false;        ///< orthographic; otherwise perspective
  bool shaded = true;  ///< false: only depth and id, bit-identical to those of the shaded variant
};

/// `roundsVertices`: see DeviceChoice.
std::string makeSurfaceVertexSource(const SurfaceVariant& variant, bool roundsVertices);
std::string makeSurfaceFragmentSource(const SurfaceVariant& variant);
std::string makeSkyVertexSource();
std::string makeSkyFragmentSource();

/// Layout of the GLSL block `Frame` (std140) at uniform binding 0. Positions are relative to the
/// eye, in world axes.
struct FrameUniforms {
  float clipFromRelative[16];  ///< column-major; reversed depth: near 1, far 0
  float forward[4];            ///< w: 1 orthographic, 0 perspective
  float middle[4];             ///< world direction of the image centre; z along forward is 1
  float rightByX[4];           ///< world right / CameraBasis::scaleX; w: half the width in pixels
  float upByY[4];              ///< world up / CameraBasis::scaleY; w: half the height in pixels
};

/// Attribute locations shared by the shaders and the vertex array.
enum class Attribute : unsigned {
  position,
  normal,
  uv,
  rowX,  ///< per instance from here: relativeFromMesh, row by row
  rowY,
  rowZ,
  baseColour,
  emissive,  ///< w: 1 if the transform mirrors
  surface,   ///< alpha cutoff, metallic, roughness, 1 when double-sided
  id,
  colour  ///< per vertex: sRGB with linear alpha; enabled for meshes with vertex colours
};

}  // namespace enfilade::render
