// The audit of a tick: brute force over the scene's own still boxes and the boxes that the avatars
// announced. Nothing of what the broad phase keeps is used, but the pairs that it answers with.
//
// Where movers * (still + movers) box tests would take too long for one tick, each audit asks about
// as many movers as the bound allows, but at least one, and the next audit goes on after them in
// the order of their ids.
#include <algorithm>

#include "collision/broad_phase_audit.hpp"
#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

using collision::BoxPair;
using collision::MoverId;

/// Movers whose turn it is.
std::vector<MoverId> nextMovers(WorldState& world, std::size_t mostBoxTests) {
  std::vector<MoverId> asked;
  const std::size_t movers = world.avatarOfMover.size();
  const std::size_t most = mostBoxTests / (world.scene->stillBoxes().size() + movers + 1);
  auto at = world.avatarOfMover.lower_bound(world.audit.next);
  while (asked.size() < movers && (asked.empty() || asked.size() < most)) {
    if (at == world.avatarOfMover.end()) at = world.avatarOfMover.begin();
    asked.push_back(at->first);
    ++at;
  }
  world.audit.next = asked.empty() ? 0 : asked.back() + 1;
  return asked;
}

std::vector<std::pair<MoverId, Box>> boxesOfMovers(const WorldState& world) {
  std::vector<std::pair<MoverId, Box>> boxes;
  for (const auto& [mover, name] : world.avatarOfMover)
    boxes.emplace_back(mover, world.avatars.at(name).reach);
  return boxes;
}

struct Named {
  EntityId id = 0;
  Box box;
};

Named avatarOf(const WorldState& world, MoverId mover) {
  const auto name = world.avatarOfMover.find(mover);
  if (name == world.avatarOfMover.end()) return {};
  const Avatar& avatar = world.avatars.at(name->second);
  return {avatar.id, avatar.reach};
}

Named stillOf(const WorldState& world, collision::StillId still) {
  if (still >= world.scene->stillBoxes().size()) return {};
  return {world.scene->solidObjects()[still] + 1, world.scene->stillBoxes()[still]};
}

void tell(const WorldState& world, AuditFinding::Kind kind, const std::vector<BoxPair>& pairs,
          TickAudit& audit) {
  for (const BoxPair& pair : pairs) {
    const Named mover = avatarOf(world, pair.mover);
    const Named other = pair.otherMoves ? avatarOf(world, pair.other) : stillOf(world, pair.other);
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
  const std::vector<MoverId> asked = nextMovers(world, mostBoxTests);
  const collision::BroadPhaseAudit compared = collision::compareWithBruteForce(
      world.broadPhase, world.scene->stillBoxes(), boxesOfMovers(world), asked);
  TickAudit audit;
  audit.movers = static_cast<std::uint32_t>(asked.size());
  audit.pairs = compared.pairs;
  tell(world, AuditFinding::Kind::missed, compared.missed, audit);
  tell(world, AuditFinding::Kind::extra, compared.extra, audit);
  std::stable_sort(audit.findings.begin(), audit.findings.end(),
                   [](const AuditFinding& x, const AuditFinding& y) { return x.mover < y.mover; });
  return audit;
}

}  // namespace enfilade::scene
