// How entities stand to one another, out of a snapshot: any two, still or moving, whatever their
// shape. Questions that somebody asks, not what the tick does: nothing here touches a world.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "collision/continuous.hpp"
#include "collision/part_tree.hpp"
#include "collision/refine.hpp"
#include "scene/lengths.hpp"
#include "scene/scene.hpp"
#include "scene/snapshot.hpp"

namespace enfilade::scene {

/// A scene as it is at a tick. Both outlive what is asked of them.
struct SceneThen {
  const Scene& scene;
  const Snapshot& snapshot;
};

/// The entity with this id; of an object of a body the body. 0: none is there.
EntityId entityWith(const SceneThen& then, EntityId id);
/// By an avatar's or a body's name, or an object's path, in this order; 0: none is there.
EntityId entityNamed(const SceneThen& then, const std::string& name);
/// Its name, or its path; "" for none.
std::string nameOf(const SceneThen& then, EntityId entity);

/// Two that were compared, `a` and `b` as they were asked for.
struct PairState {
  EntityId a = 0, b = 0;
  collision::Decision decision;  ///< of their nearest parts, from a to b, scene frame
  double penetration = 0;        ///< metres; only when it was refined
};

/// Why an answer cannot be given: the field ("a", "b" or "entity"), and a sentence.
struct NoAnswer {
  std::string field, why;
};

/// More pairs of parts whose boxes meet are not looked at: two large meshes in one place.
inline constexpr std::size_t kMostPairsOfParts = 200'000;

/// The verdict on two different entities that are there, exact, with their distance. `refined`: the
/// numbers as by collision::refine().
std::variant<PairState, NoAnswer> stateOfPair(const SceneThen& then, EntityId a, EntityId b,
                                              bool refined = false);

/// Everything solid that touches `entity`, or is nearer than `within` (metres, >= 0): the nearest
/// first, then by id. What has too many parts near is left out of `found` and counted.
struct Near {
  std::vector<PairState> found;
  std::size_t leftOut = 0;
};
std::variant<Near, NoAnswer> nearTo(const SceneThen& then, EntityId entity, double within);

/// What is assumed of the time to come.
enum class Assume : std::uint8_t {
  presentMotion,  ///< velocity and spin stay; who falls falls on; joints do all that they may
  anyCommand      ///< avatars, doors and lifts go as fast as they may be told to, at once
};

struct TimeApart {
  PairState now;
  collision::ClosingBounds closing;
  double contact = 0;       ///< seconds before which they cannot touch; infinity: never
  collision::WakeUp again;  ///< with the least time that is worth waiting
};
/// `least` >= 0, seconds.
std::variant<TimeApart, NoAnswer> timeApart(const SceneThen& then, const Lengths& lengths,
                                            EntityId a, EntityId b, Assume assume, double least);

}  // namespace enfilade::scene
