// The two wings: rooms on two storeys along the enfilade, their walls, doors and windows.
#include <algorithm>
#include <array>

#include "assets/parts.hpp"

namespace enfilade::assets {
namespace {

using namespace plan;
using Axis = Wall::Axis;

/// One room of a wing and the paints of its surfaces.
struct Room {
  const char* path;
  RoomBox box;
  Paint wall;
  FloorPattern pattern;
  double cell;
  std::vector<Paint> tones;
};

const std::vector<Paint> kOakTones{Paint::oakLight, Paint::oak, Paint::oakDark};
const std::vector<Paint> kWalnutTones{Paint::walnutLight, Paint::walnut, Paint::walnutDark};
const std::vector<Paint> kStoneTones{Paint::limestone, Paint::limestoneDark};
const std::vector<Paint> kChequer{Paint::marbleWhite, Paint::slateTile};
const std::vector<Paint> kTerracotta{Paint::terracotta, Paint::terracottaDark};

Room makeEnfiladeRoom(int i, const char* path, Paint wall, FloorPattern pattern, double cell,
                      const std::vector<Paint>& tones) {
  return {path, {computeRoomWest(i), computeRoomEast(i), kMidSouth, kSouth, 0, kCeiling},
          wall, pattern,
          cell, tones};
}

Room makeNorthRoom(const char* path, double west, double east, Paint wall, double cell,
                   const std::vector<Paint>& tones) {
  return {path, {west, east, kNorth, kMidNorth, 0, kCeiling}, wall, FloorPattern::squares, cell,
          tones};
}

Room moveUpstairs(Room room, const char* path, Paint wall) {
  room.path = path;
  room.wall = wall;
  room.box.floor = kUpper;
  room.box.ceiling = kUpperCeiling;
  return room;
}

std::vector<Room> makeSouthRooms() {
  using F = FloorPattern;
  return {{"building/ground/vestibule",
           {kWest, kVestibule, kMidSouth, kSouth, 0, kCeiling},
           Paint::wallSand,
           F::squares,
           0.5,
           kChequer},
          makeEnfiladeRoom(0, "building/ground/enfilade/room1", Paint::wallRed, F::boardsAlongX,
                           0.2, kOakTones),
          makeEnfiladeRoom(1, "building/ground/enfilade/room2", Paint::wallOchre, F::squares, 0.6,
                           kWalnutTones),
          makeEnfiladeRoom(2, "building/ground/enfilade/room3", Paint::wallSage, F::boardsAlongZ,
                           0.2, kOakTones),
          makeEnfiladeRoom(3, "building/ground/enfilade/room4", Paint::wallBlue, F::boardsAlongX,
                           0.25, kWalnutTones),
          makeEnfiladeRoom(4, "building/ground/enfilade/room5", Paint::wallPlum, F::squares, 0.5,
                           kOakTones),
          makeEnfiladeRoom(5, "building/ground/enfilade/room6", Paint::wallTeal, F::boardsAlongX,
                           0.2, kOakTones)};
}

std::vector<Room> makeNorthRooms() {
  return {
      makeNorthRoom("building/ground/cloakroom", kWest, 6.0, Paint::wallMist, 0.5, kTerracotta),
      makeNorthRoom("building/ground/cafe", 6.3, 17.1, Paint::wallCafe, 0.45, kChequer),
      makeNorthRoom("building/ground/study", 17.4, 23.4, Paint::wallIvory, 0.5, kOakTones),
      makeNorthRoom("building/ground/library", 23.7, 36.0, Paint::wallLibrary, 0.6, kWalnutTones),
      makeNorthRoom("building/ground/lobby", kLobbyWest, computeRoomEast(5), Paint::wallIvory, 0.6,
                    kStoneTones)};
}

/// The three upper salons are above the vestibule and two rooms each.
std::vector<Room> makeUpperSouthRooms() {
  const auto makeSalon = [](const char* path, double west, double east, Paint wall) {
    return Room{path, {west, east, kMidSouth, kSouth, kUpper, kUpperCeiling},
                wall, FloorPattern::boardsAlongX,
                0.22, kOakTones};
  };
  return {
      makeSalon("building/upper/salon1", kWest, computeRoomEast(1), Paint::wallSand),
      makeSalon("building/upper/salon2", computeRoomWest(2), computeRoomEast(3), Paint::wallMist),
      makeSalon("building/upper/salon3", computeRoomWest(4), computeRoomEast(5), Paint::wallWhite)};
}

std::vector<Room> makeUpperNorthRooms() {
  const std::vector<Room> below = makeNorthRooms();
  Room archive = moveUpstairs(below[1], "building/upper/archive", Paint::wallSand);
  archive.box.west = kWest;
  archive.tones = kTerracotta;
  Room studio = moveUpstairs(below[3], "building/upper/studio", Paint::wallWhite);
  studio.box.west = below[2].box.west;
  studio.tones = kOakTones;
  return {archive, studio, moveUpstairs(below[4], "building/upper/lobby", Paint::wallIvory)};
}

// ---- openings
// ------------------------------------------------------------------------------------

Opening makeDoor(double at, double half, double floor, double height) {
  return {at - half, at + half, floor, floor + height};
}

std::vector<Opening> makeSideDoors() {
  return {makeDoor(1.2, 0.6, 0, 2.3),  makeDoor(9.0, 0.6, 0, 2.3),  makeDoor(14.1, 0.6, 0, 2.3),
          makeDoor(20.4, 0.6, 0, 2.3), makeDoor(26.7, 0.6, 0, 2.3), makeDoor(33.0, 0.6, 0, 2.3)};
}

std::vector<Opening> makeUpperSideDoors() {
  return {makeDoor(8.0, 0.6, kUpper, 2.3), makeDoor(22.0, 0.6, kUpper, 2.3),
          makeDoor(40.8, 0.6, kUpper, 2.3)};
}

std::vector<Opening> makeWindows(double from, double to, double pitch, double floor) {
  std::vector<Opening> windows;
  const int count = static_cast<int>((to - from) / pitch);
  const double step = (to - from) / count;
  for (int i = 0; i < count; ++i) {
    const double at = from + step * (i + 0.5);
    windows.push_back({at - 0.6, at + 0.6, floor + 0.85, floor + 2.85});
  }
  return windows;
}

/// The windows of a room in an outer wall along X.
std::vector<Opening> makeRoomWindows(const Room& room) {
  const double margin = 0.4;
  return makeWindows(room.box.west + margin, room.box.east - margin, 2.5, room.box.floor);
}

std::vector<Opening> findOpenings(const std::vector<Opening>& all, double from, double to) {
  std::vector<Opening> some;
  for (const Opening& o : all)
    if (o.from >= from && o.to <= to) some.push_back(o);
  return some;
}

// ---- rooms
// ---------------------------------------------------------------------------------------

void addCoffers(Sketch& sketch, const Room& room) {
  const RoomBox& b = room.box;
  const std::string path = std::string(room.path) + "/ceiling/";
  const int alongX = 2, alongZ = b.east - b.west > 9 ? 5 : 3;
  const double drop = 0.16, half = 0.11;
  for (int i = 1; i <= alongX; ++i) {
    const double z = b.north + (b.south - b.north) * i / (alongX + 1);
    sketch.placeBox(appendNumber(path + "beam_x", i), {b.west + 0.1, b.ceiling - drop, z - half},
                    {b.east - 0.1, b.ceiling + 0.003, z + half}, Paint::cornice);
  }
  for (int i = 1; i <= alongZ; ++i) {
    const double x = b.west + (b.east - b.west) * i / (alongZ + 1);
    sketch.placeBox(appendNumber(path + "beam_z", i),
                    {x - half, b.ceiling - drop + 0.004, b.north + 0.1},
                    {x + half, b.ceiling + 0.003, b.south - 0.1}, Paint::cornice);
  }
}

bool isLobby(const Room& room) {
  return std::string(room.path).ends_with("lobby");
}

/// The parts of a face that the lift's shaft leaves free in the lobbies' north wall; other walls
/// stay whole.
std::vector<Face> cutOutLift(const Room& room, const Face& face) {
  if (!isLobby(room) || face.along != Axis::x || face.face != room.box.north) return {face};
  Face west = face, east = face;
  west.to = kLiftWest, east.from = kLiftEast;
  return {west, east};
}

void addMouldings(Sketch& sketch, const Room& room,
                  const std::array<std::vector<Opening>, 4>& holes) {
  const RoomBox& b = room.box;
  const std::array<Face, 4> faces{{{Axis::x, b.west, b.east, b.north, 1},
                                   {Axis::x, b.west, b.east, b.south, -1},
                                   {Axis::z, b.north, b.south, b.west, 1},
                                   {Axis::z, b.north, b.south, b.east, -1}}};
  const std::array<const char*, 4> names{"north", "south", "west", "east"};
  const std::string path = room.path;
  for (std::size_t i = 0; i < 4; ++i) {
    int piece = 0;
    for (const Face& face : cutOutLift(room, faces[i])) {
      const std::string name = names[i] + (piece++ ? std::string("_beside_lift") : "");
      addSkirting(sketch, path + "/skirting_" + name, face, b.floor, holes[i]);
      addCornice(sketch, path + "/cornice_" + name, face, b.ceiling);
    }
  }
}

void addSurfaces(Sketch& sketch, const Room& room, Random& random) {
  const RoomBox& b = room.box;
  const std::string path = room.path;
  addFloor(sketch, path + "/floor", {b.west, b.floor - 0.06, b.north}, {b.east, b.floor, b.south},
           room.pattern, room.cell, room.tones, random);
  const double top = b.floor > 0 ? kEaves - 0.1 : kUpper - kSlab;
  sketch.placeBox(path + "/ceiling/plaster", {b.west - 0.002, b.ceiling, b.north - 0.002},
                  {b.east + 0.002, top, b.south + 0.002}, Paint::ceiling);
}

/// Adds the slab under an upper floor; the lobby's slab is open at the lift's shaft.
void addSlab(Sketch& sketch, const Room& room) {
  const RoomBox& b = room.box;
  const double y0 = kUpper - kSlab, y1 = kUpper - 0.06;
  const std::string path = std::string(room.path) + "/slab";
  if (std::string(room.path) != "building/upper/lobby") {
    sketch.placeBox(path, {b.west, y0, b.north}, {b.east, y1, b.south}, Paint::concrete);
    return;
  }
  sketch.placeBox(path + "_west", {b.west, y0, b.north}, {kLiftWest, y1, kLiftSouth},
                  Paint::concrete);
  sketch.placeBox(path + "_east", {kLiftEast, y0, b.north}, {b.east, y1, kLiftSouth},
                  Paint::concrete);
  sketch.placeBox(path + "_south", {b.west, y0, kLiftSouth}, {b.east, y1, b.south},
                  Paint::concrete);
}

/// Adds floor and ceiling of the lobbies around the lift's shaft.
void addLobbySurfaces(Sketch& sketch, const Room& room, Random& random) {
  const RoomBox& b = room.box;
  const std::string path = room.path;
  const double y0 = b.floor - 0.06, y1 = b.floor;
  addFloor(sketch, path + "/floor_west", {b.west, y0, b.north}, {kLiftWest, y1, kLiftSouth},
           room.pattern, room.cell, room.tones, random);
  addFloor(sketch, path + "/floor_east", {kLiftEast, y0, b.north}, {b.east, y1, kLiftSouth},
           room.pattern, room.cell, room.tones, random);
  addFloor(sketch, path + "/floor_south", {b.west, y0, kLiftSouth}, {b.east, y1, b.south},
           room.pattern, room.cell, room.tones, random);
  const double top = b.floor > 0 ? kEaves - 0.1 : kUpper - kSlab;
  const std::string plaster = path + "/ceiling/plaster_";
  sketch.placeBox(plaster + "west", {b.west, b.ceiling, b.north}, {kLiftWest, top, kLiftSouth},
                  Paint::ceiling);
  sketch.placeBox(plaster + "east", {kLiftEast, b.ceiling, b.north}, {b.east, top, kLiftSouth},
                  Paint::ceiling);
  sketch.placeBox(plaster + "south", {b.west, b.ceiling, kLiftSouth}, {b.east, top, b.south},
                  Paint::ceiling);
}

// ---- walls
// ---------------------------------------------------------------------------------------

struct Storey {
  std::vector<Room> south, north;
  double bottom, top;
  std::vector<Opening> between;  ///< doors between the bands
  std::string path;
};

/// Adds the wall between the bands, split where the paint changes on either side.
void addMiddleWall(Sketch& sketch, const Storey& s) {
  std::vector<double> cuts{-kOuter};
  for (const auto* rooms : {&s.south, &s.north})
    for (std::size_t i = 0; i + 1 < rooms->size(); ++i)
      cuts.push_back((*rooms)[i].box.east + kPartition / 2);
  cuts.push_back(computeRoomEast(5));
  std::sort(cuts.begin(), cuts.end());
  const auto findWallPaint = [](const std::vector<Room>& rooms, double x) {
    for (const Room& room : rooms)
      if (x < room.box.east + kPartition / 2) return room.wall;
    return rooms.back().wall;
  };
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    if (cuts[i + 1] - cuts[i] < 1e-6) continue;
    const double x = 0.5 * (cuts[i] + cuts[i + 1]);
    const Wall wall{Axis::x,
                    cuts[i],
                    cuts[i + 1],
                    kMidNorth,
                    kMidSouth,
                    s.bottom,
                    s.top,
                    findWallPaint(s.north, x),
                    findWallPaint(s.south, x)};
    addWall(sketch, appendNumber(s.path + "/walls/middle", static_cast<int>(i + 1)), wall,
            findOpenings(s.between, cuts[i], cuts[i + 1]));
  }
  int number = 0;
  for (const Opening& o : s.between) {
    const Wall wall{Axis::x, 0, 0, kMidNorth, kMidSouth, 0, 0, Paint::reveal, Paint::reveal};
    const std::string path = appendNumber(s.path + "/side_doors/door", ++number);
    addDoorFrame(sketch, path, wall, o, Paint::paintedWood);
    addThreshold(sketch, path + "/threshold", wall, o, Paint::oakDark);
    addLeaf(sketch, path + "/leaf",
            {{o.from + 0.025, o.bottom, kMidNorth + 0.02}, 1, 1.16, 2.28, -1});
  }
}

void addOuterWall(Sketch& sketch, const Storey& s, const std::vector<Room>& rooms, bool south) {
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    const Room& room = rooms[i];
    const double from = i == 0 ? -kOuter : rooms[i - 1].box.east + kPartition / 2;
    const double to = i + 1 == rooms.size() ? computeRoomEast(5) : room.box.east + kPartition / 2;
    const double inner = south ? kSouth : kNorth;
    Wall wall{Axis::x,
              from,
              to,
              south ? inner : inner - kOuter,
              south ? inner + kOuter : inner,
              s.bottom,
              s.top,
              south ? room.wall : Paint::facade,
              south ? Paint::facade : room.wall};
    const std::string path = std::string(room.path) + (south ? "/south_wall" : "/north_wall");
    std::vector<Opening> windows = makeRoomWindows(room);
    if (isLobby(room)) windows = {{40.1, 41.3, room.box.floor + 0.85, room.box.floor + 2.85}};
    addWall(sketch, path, wall, windows);
    int number = 0;
    for (const Opening& o : windows) {
      constexpr Paint kCurtains[] = {Paint::curtainCream, Paint::curtainRed, Paint::curtainGreen};
      WindowStyle style{2, 3, Paint::glass, south ? -1.0 : 1.0};
      if (south || room.wall == Paint::wallLibrary) style.curtain = kCurtains[i % 3];
      addWindow(sketch, appendNumber(std::string(room.path) + "/window", ++number), wall, o, style);
    }
  }
}

/// Adds walls across a band, each with its doors at the given z (empty: no door).
void addCrossWalls(Sketch& sketch, const Storey& s, const std::vector<Room>& rooms, bool south,
                   double doorZ, bool doors, bool leaves) {
  for (std::size_t i = 0; i + 1 < rooms.size(); ++i) {
    const RoomBox& b = rooms[i].box;
    const Wall wall{Axis::z,  b.north, b.south,       b.east,           b.east + kPartition,
                    s.bottom, s.top,   rooms[i].wall, rooms[i + 1].wall};
    std::vector<Opening> holes;
    if (doors) holes.push_back(makeDoor(doorZ, kDoorHalf, b.floor, kDoorHeight));
    const std::string band = s.path + (south ? "/walls/south_cross" : "/walls/north_cross");
    addWall(sketch, appendNumber(band, static_cast<int>(i + 1)), wall, holes);
    if (!doors) continue;
    const std::string path = appendNumber(
        s.path + (south ? "/enfilade_doors/door" : "/north_doors/door"), static_cast<int>(i + 1));
    addDoorFrame(sketch, path, wall, holes[0], Paint::paintedWood);
    addThreshold(sketch, path + "/threshold", wall, holes[0], Paint::marbleGrey);
    if (!leaves) continue;
    const double x = wall.high + 0.05, z = kDoorHalf + 0.03;
    addLeaf(sketch, path + "/leaf_north",
            {{x, b.floor, doorZ - z}, 0, kDoorHalf, kDoorHeight - 0.02, -1});
    addLeaf(sketch, path + "/leaf_south",
            {{x, b.floor, doorZ + z}, 0, kDoorHalf, kDoorHeight - 0.02, 1});
  }
}

void addWestWall(Sketch& sketch, const Storey& s) {
  const bool ground = s.bottom < 1;
  const double floor = s.south[0].box.floor;
  const Wall south{Axis::z,  kMidSouth, kSouth,        -kOuter,        kWest,
                   s.bottom, s.top,     Paint::facade, s.south[0].wall};
  std::vector<Opening> holes;
  if (ground)
    holes.push_back({-0.8, 0.8, 0, 2.7});
  else
    holes.push_back({-0.7, 0.7, floor + 0.85, floor + 2.85});
  for (const double z : {-2.0, 2.0})
    holes.push_back({z - 0.4, z + 0.4, floor + 0.85, floor + 2.85});
  addWall(sketch, s.path + "/walls/west_south", south, holes);
  for (std::size_t i = ground ? 1 : 0; i < holes.size(); ++i)
    addWindow(sketch, appendNumber(s.path + "/walls/west_window", static_cast<int>(i)), south,
              holes[i], {i == 0 ? 2 : 1, 3, Paint::glass, 1});
  const Wall north{Axis::z,  kNorth, kMidNorth,     -kOuter,        kWest,
                   s.bottom, s.top,  Paint::facade, s.north[0].wall};
  const std::vector<Opening> windows{{-6.5, -5.3, floor + 0.85, floor + 2.85}};
  addWall(sketch, s.path + "/walls/west_north", north, windows);
  addWindow(sketch, s.path + "/walls/west_window09", north, windows[0], {2, 3, Paint::glass, 1});
  if (!ground) return;
  addDoorFrame(sketch, "building/ground/entrance", south, holes[0], Paint::facadeTrim);
  addThreshold(sketch, "building/ground/entrance/threshold", south, holes[0], Paint::plinthStone);
  addLeaf(sketch, "building/ground/entrance/leaf_north",
          {{kWest + 0.05, 0, -0.82}, 0, 0.8, 2.66, -1, true});
  addLeaf(sketch, "building/ground/entrance/leaf_south",
          {{kWest + 0.05, 0, 0.82}, 0, 0.8, 2.66, 1, true});
}

void addStorey(Sketch& sketch, const Storey& s, Random& random) {
  const std::vector<Opening> axis{makeDoor(0, kDoorHalf, s.south[0].box.floor, kDoorHeight)};
  for (const auto* rooms : {&s.south, &s.north}) {
    for (const Room& room : *rooms) {
      isLobby(room) ? addLobbySurfaces(sketch, room, random) : addSurfaces(sketch, room, random);
      if (room.box.floor > 0) addSlab(sketch, room);
      const bool south = rooms == &s.south;
      const bool enfilade = south || isLobby(room);
      const std::vector<Opening> across =
          south ? axis
                : std::vector<Opening>{makeDoor(-5.7, kDoorHalf, room.box.floor, kDoorHeight)};
      const std::vector<Opening> none;
      if (!isLobby(room)) addCoffers(sketch, room);
      addMouldings(sketch, room,
                   {south ? s.between : none, south ? none : s.between,
                    enfilade || room.box.floor > 0 ? across : none,
                    enfilade || room.box.floor > 0 ? across : none});
    }
  }
  addMiddleWall(sketch, s);
  addOuterWall(sketch, s, s.south, true);
  addOuterWall(sketch, s, s.north, false);
  addCrossWalls(sketch, s, s.south, true, 0, true, true);
  addCrossWalls(sketch, s, s.north, false, -5.7, s.bottom > 1, false);
  addWestWall(sketch, s);
}

}  // namespace

void addFloor(Sketch& sketch, const std::string& path, const Vec3& low, const Vec3& high,
              FloorPattern pattern, double cell, const std::vector<Paint>& tones, Random& random) {
  const auto countCells = [&](double length) {
    const int n = static_cast<int>(length / cell + 0.5);
    return n < 1 ? 1 : n;
  };
  const int nx = pattern == FloorPattern::boardsAlongX ? 1 : countCells(high.x() - low.x());
  const int nz = pattern == FloorPattern::boardsAlongZ ? 1 : countCells(high.z() - low.z());
  std::vector<Paint> cellTones;
  for (int i = 0; i < nx; ++i)
    for (int k = 0; k < nz; ++k) {
      const bool chequered = tones.size() == 2;
      const int pick = chequered ? (i + k) % 2 : random.below(static_cast<int>(tones.size()));
      cellTones.push_back(tones[static_cast<std::size_t>(pick)]);
    }
  const Vec3 half = 0.5 * (high - low);
  PaintedMesh shape;
  addTiledSlab(shape, -half, half, nx, nz, tones[0], cellTones);
  sketch.place(path, shape, makeTranslation(0.5 * (low + high)));
}

void addWings(Sketch& sketch, Random& random) {
  sketch.placeBox("building/ground/slab", {-kOuter, kGround, kNorth - kOuter},
                  {kHallWest, -0.06, kSouth + kOuter}, Paint::concrete);
  addStorey(sketch,
            {makeSouthRooms(), makeNorthRooms(), -0.06, 4.0, makeSideDoors(), "building/ground"},
            random);
  addStorey(sketch,
            {makeUpperSouthRooms(), makeUpperNorthRooms(), 4.0, kEaves, makeUpperSideDoors(),
             "building/upper"},
            random);
}

}  // namespace enfilade::assets
