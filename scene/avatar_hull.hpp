// The shape of an avatar: a bevelled prism on twelve sides.
#pragma once

#include "collision/hull.hpp"

namespace enfilade::scene {

/// Origin in the middle of the bottom, +Y up, metres; the widest ring has the given radius. The
/// bevels at bottom and top let it glide over seams and small ledges.
collision::Hull avatarHull(double radius, double height);

}  // namespace enfilade::scene
