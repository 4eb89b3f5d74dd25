// Lenses that bend straight lines: fisheye and equirectangular pictures.
#pragma once

#include <optional>

#include "render/camera/camera.hpp"

namespace enfilade::render {

/// Maps the pixels of a camera with a lens to directions.
class LensMapping {
 public:
  /// `camera` must have a lens and satisfy validateCamera().
  explicit LensMapping(const Camera& camera);

  /// The unit direction, world, of a point of the picture, pixels from the top left corner.
  /// nullopt: the lens sees nothing there.
  std::optional<Vec3> directionAt(double x, double y) const;
  /// Pixels per radian in the middle of the picture.
  double pixelsPerRadian() const { return pixelsPerRadian_; }

 private:
  std::optional<double> findAngle(double radius) const;

  Camera::Lens lens_;
  Pinhole pinhole_;  ///< of a fisheye
  int width_, height_;
  Vec3 right_, up_, forward_;
  double pixelsPerRadian_ = 1;
  double maxAngle_ = 0;  ///< of a fisheye, radians: the polynomial increases up to here
};

}  // namespace enfilade::render
