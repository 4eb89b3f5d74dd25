// Walker: a simulated avatar outside any world, which proves a path by walking it. It moves as in a
// tick, among static objects and bodies at their present poses. Other avatars are no obstacles.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/navigation/mesh/agent.hpp"
#include "scene/navigation/walk/floor_faces.hpp"
#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// The end of a straight walk.
struct WalkOutcome {
  enum class Kind {
    arrived,
    blocked,  ///< an obstacle stopped the walker, or made it slide
    fell      ///< the floor ended
  };
  Kind kind = Kind::arrived;
  Vec3 footPosition = Vec3::Zero();  ///< scene frame, metres: where the walk ended
  EntityId obstacle = 0;             ///< blocked: the entity that was hit
  int ticks = 0;                     ///< of a walk tick by tick
};

/// The path of the feet.
struct FeetTravel {
  double across = 0;  ///< metres
  double climb = 0;   ///< metres up, and down

  /// Metres. A step counts with its height, whether it is taken in one tick or in a fall.
  double length() const { return across + climb; }
};

/// Not thread-safe; several walkers may share a world that does not tick.
class Walker {
 public:
  /// `world` must outlive the walker.
  Walker(const WorldData& world, const NavigationAgent& agent);

  /// Stands at `footPosition`, or falls from there by at most `maxDrop` metres. Returns the error
  /// if there is no room or no floor.
  std::optional<std::string> place(const Vec3& footPosition, double maxDrop);
  /// Stands where it has stood before.
  void returnTo(const Vec3& footPosition);
  /// Walks straight to the waypoint `goal`; its height decides nothing. Stops at the first
  /// obstacle that is not a step, and where the floor ends. Keeps some millimetres from obstacles,
  /// or else walks tick by tick: a later walk along the same line differs by less than that.
  WalkOutcome walkTo(const Vec3& goal);

  /// Whether the straight path to `goal` is free of obstacles, with some millimetres more room, and
  /// its floor is even. Quick; walkTo() also arrives over steps and through narrower places.
  bool isPathClear(const Vec3& goal);

  /// Whether a body that moves straight and carries the agent from `from` to `to` brings it against
  /// nothing else.
  bool isRideFree(const Vec3& from, const Vec3& to, EntityId body);

  /// Walks straight to `goal` over even floor, without an obstacle; false: it does not arrive so.
  bool walkEvenly(const Vec3& goal);
  /// Walks tick by tick as an avatar in a world does, equal up to rounding. It may slide along
  /// obstacles, and may end in a fall from a step. Begins standing, or in that fall.
  /// Also ends after `maxLength` metres across, once it stands. Another call continues the walk.
  WalkOutcome walkOn(const Vec3& goal, double maxLength = std::numeric_limits<double>::infinity());
  /// Walks tick by tick to `goal`, and may fall by up to `maxDrop` metres on the way.
  WalkOutcome dropTo(const Vec3& goal, double maxDrop);
  /// Walks tick by tick towards `goal`, slides along obstacles, and ends where it gains nothing.
  WalkOutcome slideTo(const Vec3& goal);

  /// Whether a walk stepped up or down since the last call. The place where it then stands may
  /// depend on its path.
  bool takeCrossedSteps() { return std::exchange(crossedSteps_, false); }
  /// Of all walks since the last returnTo() or place().
  const FeetTravel& travel() const { return travel_; }

  const Vec3& footPosition() const { return avatar_.footPosition; }
  bool isStanding() const { return avatar_.grounded; }            ///< not in a fall
  EntityId groundEntity() const { return avatar_.groundEntity; }  ///< after place()
  const NavigationAgent& agent() const { return agent_; }
  std::shared_ptr<const AvatarShape> shape() const { return shape_; }

 private:
  WalkOutcome walkWithMargin(const Vec3& goal);
  WalkOutcome walkByTicks(const Vec3& goal, double length, bool maySlide, double maxDrop);
  /// The floor that the walker stood on last.
  struct LastFloor {
    double height = 0;
    bool isOnStair = true;  ///< since then, a floor was always within a step below
  };
  bool hasFloorBelow();
  bool hasFallen(double maxDrop);
  /// Where the feet stood, and the travel up to there.
  struct Standing {
    Vec3 footPosition;
    FeetTravel travel;
  };
  Standing getStanding() const { return {avatar_.footPosition, travel_}; }
  void restore(const Standing& standing);
  void addTravel(const Vec3& from);
  void prepareStep(const Vec3& velocity);
  void step(const Vec3& velocity);
  void collectNearObstacles();
  double measureEvenFloor(const Vec3& goal, double distance);
  bool stepEvenly(const Vec3& displacement, bool isFloorEven);

  const WorldData& world_;
  const NavigationAgent agent_;
  Avatar avatar_;
  std::shared_ptr<const AvatarShape> shape_, wideShape_, narrowShape_;
  bool hasStepped_ = false;  ///< in the present walk
  bool crossedSteps_ = false;
  bool isUneven_ = false;  ///< the present walk left even floor
  LastFloor lastFloor_;
  FeetTravel travel_;
  QueryCount count_;
  /// Obstacles around a cell, with their caches. The avatar has those of `cell_`.
  struct Neighbourhood {
    Aabb box;
    ObstacleSet obstacles;
    std::vector<FloorFace> floor;
  };
  using Cell = std::array<int, 3>;
  Cell cell_{};
  std::vector<FloorFace> floor_;
  std::map<Cell, Neighbourhood> neighbourhoods_;
};

}  // namespace enfilade::scene
