// How entities stand to one another, out of a snapshot: any two, still or moving, whatever their
// shape. Questions that somebody asks, not what the tick does: nothing here touches a world.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "scene/world/queries/entity_index.hpp"

namespace enfilade::scene {

/// Two that were compared, `a` and `b` as they were asked for.
struct PairState {
  EntityId a = 0, b = 0;
  collision::Decision decision;  ///< of their nearest parts, from a to b, scene frame
  double penetration = 0;        ///< metres, of those parts; only when it was refined
};

/// Why an answer cannot be given.
struct NoAnswer {
  enum class Why : std::uint8_t {
    notSolid,   ///< there is nothing of it to be touched
    tooComplex  ///< it needs more work than was left
  };
  Why why = Why::notSolid;
  std::string field;  ///< "a", "b" or "entity"
  std::string text;   ///< a clause that follows the name of the field
};

/// What one answer may cost: pairs of boxes that are looked at, decisions on parts more, numbers
/// that are refined much more (the constants below); some 0.3 s of one processor.
inline constexpr std::size_t kMostWork = 4'000'000;
/// What one entity may cost of it among all that are near.
inline constexpr std::size_t kMostWorkOfNear = 400'000;
/// To refine the numbers of two parts; of two that penetrate, for each pair of their vertices, too.
inline constexpr std::size_t kRefinementWork = 2000, kDepthWork = 150;

/// The verdict on two different entities that are there, exact, with their distance. `refined`: the
/// numbers as by collision::refine(). Takes what it does from `work`.
std::variant<PairState, NoAnswer> stateOfPair(const SceneThen& then, EntityId a, EntityId b,
                                              bool refined, std::size_t& work);

/// Everything solid that touches `entity`, or is nearer than `within` (metres, >= 0): the nearest
/// first, then by id. What the work does not suffice for is left out of `found` and counted.
struct Near {
  std::vector<PairState> found;
  std::size_t leftOut = 0;
};
std::variant<Near, NoAnswer> nearTo(const SceneThen& then, EntityId entity, double within,
                                    std::size_t& work);

/// Of an entity that is there, with why not when it has no solid part.
std::variant<Placed, NoAnswer> solidParts(const SceneThen& then, EntityId entity,
                                          const char* field);
NoAnswer tooComplex(const char* field);

}  // namespace enfilade::scene
