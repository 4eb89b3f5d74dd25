// The gallery's plan: every coordinate that more than one part of the building needs.
//
//            north (-Z)
//   +----------+-----------+-------+-------------+--------+------------------+
//   | cloakroom|   cafe    | study |   library   | lobby  |                  |
//   |          |           |       |             | + lift |       hall       |
//   +---[ ]----+-[ ]--[ ]--+-[ ]---+-[ ]----[ ]--+--------+  (two storeys,   |
//   | vesti- | room1 | room2 | room3 | room4 | room5 | room6 |  gallery, stair)  |
// =[]== bule []=    []=     []=     []=     []=     []=     []      z = 0    |
//   +--------+-------+-------+-------+-------+-------+-------+                  |
//            south (+Z)                                      +-----------------+
#pragma once

namespace enfilade::assets::plan {

inline constexpr double kGround = -0.45;  ///< outside
inline constexpr double kUpper = 4.2;     ///< upper floor
inline constexpr double kSlab = 0.35;     ///< between the storeys
inline constexpr double kCeiling = 3.6;
inline constexpr double kUpperCeiling = 7.6;
inline constexpr double kEaves = 8.0;
inline constexpr double kHallCeiling = 8.6;

// Wings: the band of the enfilade (south) and the band of side rooms (north).
inline constexpr double kWest = 0, kSouth = 3, kMidSouth = -3, kMidNorth = -3.3, kNorth = -8.4;
inline constexpr double kOuter = 0.4;      ///< thickness of outer walls
inline constexpr double kPartition = 0.3;  ///< thickness of walls between rooms
inline constexpr double kVestibule = 4.5;  ///< its east face
inline constexpr double kRoom = 6.0;       ///< width of a room of the enfilade along X
inline constexpr int kRooms = 6;
/// West face of room i = 0..5; room 6 is the hall.
constexpr double computeRoomWest(int i) {
  return kVestibule + kPartition + (kRoom + kPartition) * i;
}
constexpr double computeRoomEast(int i) {
  return computeRoomWest(i) + kRoom;
}

// The doors of the enfilade, all on z = 0.
inline constexpr double kDoorHalf = 0.65, kDoorHeight = 2.45;

// Hall.
inline constexpr double kHallWest = computeRoomEast(kRooms - 1) + kOuter;  // 42.7
inline constexpr double kHallEast = kHallWest + 18;
inline constexpr double kHallHalf = 8.2;  ///< it reaches from z = -kHallHalf to +kHallHalf
inline constexpr double kWalkway = 2.2;   ///< width of the gallery round it
inline constexpr double kVoidWest = kHallWest + kWalkway, kVoidEast = kHallEast - kWalkway;
inline constexpr double kVoidHalf = kHallHalf - kWalkway;

// Stair: up along +X to the east walkway, 12 risers, a landing, 13 risers.
inline constexpr int kRisers = 25, kLandingRiser = 12;
inline constexpr double kRiser = kUpper / kRisers, kTread = 0.3, kLanding = 1.5;
inline constexpr double kStairLow = -5.0, kStairHigh = -3.2;  ///< z
inline constexpr double kStairFoot =
    kVoidEast - (kRisers - 2) * kTread - kLanding;  ///< x of the first riser

// Lift: shaft in the north-west corner of the lobby.
inline constexpr double kLobbyWest = 36.3;
inline constexpr double kLiftWest = 37.2, kLiftEast = 39.4, kLiftNorth = kNorth,
                        kLiftSouth = -6.2;  ///< outer faces of the shaft's walls

}  // namespace enfilade::assets::plan
