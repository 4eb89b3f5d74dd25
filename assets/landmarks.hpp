// Named positions in the bundled building, for scripts, tests and benchmarks. Metres. Positions of
// avatars are those of their feet, 0.05 m above the surface under them.
#pragma once

#include <array>

#include "collision/types.hpp"

namespace enfilade::assets::landmarks {

using collision::Vec3;

/// On the path in front of the entrance; facing 0 looks at the door.
inline const Vec3 kStart{-7, -0.40, 0};
/// Centres of the doorways on the axis, from the entrance to the hall. 1.3 m wide (the entrance 1.6
/// m), 2.45 m high, free along z = 0.
inline const std::array<Vec3, 8> kDoors{{{-0.2, 0, 0},
                                         {4.65, 0, 0},
                                         {10.95, 0, 0},
                                         {17.25, 0, 0},
                                         {23.55, 0, 0},
                                         {29.85, 0, 0},
                                         {36.15, 0, 0},
                                         {42.5, 0, 0}}};
/// Centres of the six rooms.
inline const std::array<Vec3, 6> kRooms{
    {{7.8, 0, 0}, {14.1, 0, 0}, {20.4, 0, 0}, {26.7, 0, 0}, {33.0, 0, 0}, {39.3, 0, 0}}};
/// In the hall in front of the stair, and on the gallery past its last riser.
inline const Vec3 kStairFoot{49.2, 0, -4.1}, kStairHead{59.9, 4.2, -4.1};
/// On the gallery at the railing; the view target is kHallMiddle.
inline const Vec3 kGalleryView{51.7, 4.2, 6.6}, kHallMiddle{51.7, 0.5, -1.0};
/// Walking from the first to the second ends at the side of a bench (room4/bench1/seat).
inline const Vec3 kBeforeBench{28.4, 0, -1.8}, kInBench{24.9, 0, -1.8};
/// Walking from the first to the second ends at the hall's west wall. Walking from the third to the
/// fourth ends at a picture on the north wall of room 4 (room4/picture06/frame).
inline const Vec3 kBeforeWall{44.0, 0, -1.4}, kInWall{41.5, 0, -1.4};
inline const Vec3 kBeforePicture{28.6, 0, -1.6}, kInPicture{28.6, 0, -3.6};
/// An outside camera that sees the whole building, and its view target.
inline const Vec3 kOverviewEye{-22, 22, 36}, kOverviewTarget{26, 2, -3};

}  // namespace enfilade::assets::landmarks
