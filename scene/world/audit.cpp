// The audit of a tick: brute force over the scene's own still boxes and the boxes that avatars and
// bodies announced. Nothing of what the broad phase keeps is used, but the pairs that it answers
// with.
//
// Where movers * (still + movers) box tests would take too long for one tick, each audit asks about
// as many movers as the bound allows, but at least one, and the next audit goes on after them in
// the order of their ids.
#include <algorithm>

#include "collision/broad_phase/broad_phase_audit.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

using collision::BoxPair;
using collision::MoverId;

struct Named {
  EntityId id = 0;
  Box box;
};

/// Avatars and bodies, with the boxes that they announced.
std::map<MoverId, Named> moversOf(const WorldState& world) {
  std::map<MoverId, Named> movers;
  for (const auto& [name, avatar] : world.avatars) movers[avatar.mover] = {avatar.id, avatar.reach};
  for (const Body& body : world.bodies) movers[body.mover] = {body.id, body.reach};
  return movers;
}

/// Movers whose turn it is.
std::vector<MoverId> nextMovers(WorldState& world, const std::map<MoverId, Named>& movers,
                                std::size_t mostBoxTests) {
  std::vector<MoverId> asked;
  const std::size_t most = mostBoxTests / (world.scene->stillBoxes().size() + movers.size() + 1);
  auto at = movers.lower_bound(world.audit.next);
  while (asked.size() < movers.size() && (asked.empty() || asked.size() < most)) {
    if (at == movers.end()) at = movers.begin();
    asked.push_back(at->first);
    ++at;
  }
  world.audit.next = asked.empty() ? 0 : asked.back() + 1;
  return asked;
}

Named stillOf(const WorldState& world, collision::StillId still) {
  if (still >= world.scene->stillBoxes().size()) return {};
  return {world.scene->solidObjects()[still] + 1, world.scene->stillBoxes()[still]};
}

void tell(const WorldState& world, const std::map<MoverId, Named>& movers, AuditFinding::Kind kind,
          const std::vector<BoxPair>& pairs, TickAudit& audit) {
  const auto named = [&](MoverId mover) {
    const auto found = movers.find(mover);
    return found == movers.end() ? Named{} : found->second;
  };
  for (const BoxPair& pair : pairs) {
    const Named mover = named(pair.mover);
    const Named other = pair.otherMoves ? named(pair.other) : stillOf(world, pair.other);
    audit.findings.push_back({kind, mover.id, other.id, mover.box, other.box});
  }
}

}  // namespace

void auditBroadPhase(World& world, std::uint32_t everyTicks) {
  world.state().audit = {everyTicks, 0};
}

bool auditIsDue(const WorldState& world) {
  return world.audit.everyTicks != 0 && world.tick % world.audit.everyTicks == 0;
}

TickAudit auditTick(WorldState& world, std::size_t mostBoxTests) {
  const std::map<MoverId, Named> movers = moversOf(world);
  std::vector<std::pair<MoverId, Box>> boxes;
  for (const auto& [mover, named] : movers) boxes.emplace_back(mover, named.box);
  const std::vector<MoverId> asked = nextMovers(world, movers, mostBoxTests);
  const collision::BroadPhaseAudit compared =
      collision::compareWithBruteForce(world.broadPhase, world.scene->stillBoxes(), boxes, asked);
  TickAudit audit;
  audit.movers = static_cast<std::uint32_t>(asked.size());
  audit.pairs = compared.pairs;
  tell(world, movers, AuditFinding::Kind::missed, compared.missed, audit);
  tell(world, movers, AuditFinding::Kind::extra, compared.extra, audit);
  std::stable_sort(audit.findings.begin(), audit.findings.end(),
                   [](const AuditFinding& x, const AuditFinding& y) { return x.mover < y.mover; });
  return audit;
}

}  // namespace enfilade::scene
