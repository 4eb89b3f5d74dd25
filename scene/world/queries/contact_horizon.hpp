// Contact horizons: for avatars, proved times before which they come into contact with nothing,
// whatever clients command (Lin 1993, section 5.1).
#pragma once

#include <optional>

#include "collision/motion/pair_schedule.hpp"
#include "scene/world/queries/horizon_state.hpp"

namespace enfilade::scene {

/// The horizon of one avatar. It holds for the entities that are present at its tick.
struct ContactHorizon {
  static constexpr std::size_t kMaxApproaches = 16;

  struct Approach {
    /// 0: all entities that are neither listed nor touching; no later approach is listed then.
    EntityId entity = 0;
    /// Simulated seconds since tick 0: no contact begins earlier. In the past, nothing is known.
    double notBefore = 0;
  };

  EntityId avatar = 0;
  /// The earliest first, at most kMaxApproaches; empty: the avatar comes into contact with nothing.
  /// Entities that are neither here nor in `touching` come later than the last approach.
  std::vector<Approach> approaches;
  /// Entities in contact (closer than twice the contact offset), ascending. They are in no
  /// approach. An entity that parts gets an approach from that tick on.
  std::vector<EntityId> touching;
  /// The nearest dynamic body, of which nothing is proved, neither for itself nor for what it
  /// carries; `gap` is a lower bound of the distance.
  HorizonState::NearestBody unbounded;
  std::uint64_t changedTick = 0;  ///< the tick in which one of the above last changed

  /// Infinity without an approach.
  double notBefore() const;
};

/// Horizons of several avatars. All pairs of an avatar and an entity near it lie in one schedule,
/// those of two avatars once. In a tick only the pairs are examined whose proof ends.
class ContactHorizons {
 public:
  struct Options {
    /// Metres that an avatar may move until the next search of the entities near it. Of 2 to 12 m,
    /// 3 m gives the latest horizons in tests/benchmarks/contact_horizon_bench.cpp, at a third of
    /// the cost of 8 m. (Within a longer time, more bodies may push an avatar.)
    double searchDistance = 3;
    /// Examines every pair near an avatar in every tick, for comparison.
    bool examineAll = false;
    /// Work limit of one update, in the units of kMaxQueryWork: about 8 ms of distances. A search
    /// costs more than is charged (tests/benchmarks/report/horizon.md).
    std::size_t maxWork = 100'000;
  };
  /// Numbers of all updates together.
  struct Statistics {
    std::uint64_t examinations = 0;  ///< exact distances of pairs
    std::uint64_t boxChecks = 0;     ///< pairs whose boxes were sufficient
    std::uint64_t searches = 0;      ///< for the entities near an avatar
    std::uint64_t postponed = 0;     ///< pairs and searches for which the work limit was too low
  };

  ContactHorizons(std::shared_ptr<const Scene> scene, const WorldSettings& settings);
  ContactHorizons(std::shared_ptr<const Scene> scene, const WorldSettings& settings,
                  const Options& options);

  /// Selects avatars by id, from the next update on; nullopt: all.
  void select(std::optional<std::set<EntityId>> avatars) { selected_ = std::move(avatars); }
  /// Advances to a snapshot. Call it once a tick; after a gap of ticks all proofs start over.
  void update(const std::shared_ptr<const Snapshot>& snapshot);
  /// Forgets all proofs: the next snapshot is of another world.
  void reset();

  /// The tick of the last update; there must have been one.
  std::uint64_t tick() const { return state_.snapshot()->tick; }
  /// Of the selected avatars that are present, by id.
  const std::map<EntityId, ContactHorizon>& horizons() const { return horizons_; }
  const Statistics& statistics() const { return statistics_; }
  /// Checks that the schedule agrees with the avatars. Throws std::logic_error. For tests.
  void validate() const;

 private:
  using BodyPair = collision::PairSchedule::BodyPair;
  using Entry = collision::PairSchedule::Entry;
  struct Tracked {
    /// Simulated seconds: no entity outside the schedule comes into contact earlier.
    double restUntil = 0;
    bool dirty = true;            ///< its horizon must be composed again
    std::set<EntityId> touching;  ///< of touching_
  };
  /// The last examination of a pair.
  struct Examined {
    std::uint64_t tick = 0;
    double wait = 0;  ///< seconds of the proof
  };

  double now() const { return state_.snapshot()->time; }
  bool isTracked(EntityId entity) const { return tracked_.contains(entity); }
  Tracked* findTracked(EntityId entity);
  void markDirty(const BodyPair& pair);
  void endTouching(const BodyPair& pair);
  void setTime(const BodyPair& pair, double time);
  void setTouching(const BodyPair& pair);
  void removePair(const BodyPair& pair);
  void removePairs(EntityId avatar, bool keepTracked);

  bool spendWork(std::size_t cost);
  void removeLeftAvatars();
  void updateSelection();
  void restartUnbounded();
  void searchAround(const AvatarSnapshot& avatar, Tracked& tracked);
  void replacePairs(const AvatarSnapshot& avatar, Tracked& tracked,
                    const std::vector<HorizonState::Neighbour>& neighbours);
  void searchDue();

  bool isUnchanged(const BodyPair& pair, bool touching) const;
  void examineDue();
  void renewProof(const Entry& due);
  void examine(const Entry& due, double boxTime, double speed);
  void storeExamination(const BodyPair& pair, const collision::SeparationResult& separation,
                        double speed);
  void composeHorizon(EntityId avatar, Tracked& tracked);

  WorldSettings settings_;
  Options options_;
  double searchSeconds_;  ///< shortest time between two searches; no proof is longer
  HorizonState state_;
  std::optional<std::set<EntityId>> selected_ = std::set<EntityId>{};
  std::map<EntityId, Tracked> tracked_;
  collision::PairSchedule schedule_;  ///< pairs that are apart, by the end of their proof
  std::set<BodyPair> touching_;       ///< pairs in contact
  std::map<BodyPair, Examined> examined_;
  std::map<EntityId, ContactHorizon> horizons_;
  std::size_t workLeft_ = 0;  ///< of this update
  Statistics statistics_;
};

}  // namespace enfilade::scene
