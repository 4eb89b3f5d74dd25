// Proximity queries on a snapshot: separation of two entities, static or moving, of any shape, and
// the entities near one. They run outside the tick and never touch a world.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/queries/entity_index.hpp"

namespace enfilade::scene {

/// Result for a pair, `a` and `b` in the order of the request.
struct PairProximity {
  EntityId a = 0, b = 0;
  collision::SeparationResult separation;  ///< of the nearest parts, from a to b, scene frame
  double penetration = 0;                  ///< metres, of those parts; only if refined
};

/// Reason why a query has no result.
struct QueryError {
  enum class Reason : std::uint8_t {
    notSolid,   ///< the entity has no solid part
    tooComplex  ///< the work limit was exceeded
  };
  Reason reason = Reason::notSolid;
  std::string field;  ///< "a", "b" or "entity"
  std::string text;   ///< a clause that follows the field's name
};

/// Work limit of one query: one unit per tested pair of AABBs, more per separation of parts, much
/// more per refinement (constants below). The limit is about 0.3 s of one processor.
inline constexpr std::size_t kMaxQueryWork = 4'000'000;
/// Work limit for one entity among all nearby ones.
inline constexpr std::size_t kMaxWorkPerEntity = 400'000;
/// Work of refining the numbers of two parts; if they penetrate, kDepthWork is added for each pair
/// of vertices.
inline constexpr std::size_t kRefinementWork = 2000, kDepthWork = 150;

/// Exact verdict and distance of two different entities, which must be present. `refined`: numbers
/// as from refineSeparation(). Subtracts its cost from `budget`.
std::variant<PairProximity, QueryError> computePairProximity(const SceneAt& sceneAt, EntityId a,
                                                             EntityId b, bool refined,
                                                             std::size_t& budget);

struct NearbyEntities {
  std::vector<PairProximity> pairs;  ///< nearest first, then by id
  std::size_t skipped = 0;           ///< entities for which the budget did not suffice
};
/// All solid entities that touch `entity` or are closer than `within` (metres, >= 0).
std::variant<NearbyEntities, QueryError> findNearbyEntities(const SceneAt& sceneAt, EntityId entity,
                                                            double within, std::size_t& budget);

/// Solid parts of an entity, which must be present; an error if it has none.
std::variant<PlacedEntity, QueryError> findSolidParts(const SceneAt& sceneAt, EntityId entity,
                                                      const char* field);
QueryError makeTooComplexError(const char* field);

}  // namespace enfilade::scene
