// The audit of a tick: brute force over the scene's static boxes and the motion bounds of avatars
// and bodies. It uses no data of the broad phase except the pairs that it reports.
//
// If proxies * (static boxes + proxies) box tests would take too long for one tick, each audit
// checks fewer proxies. They are as many as the bound allows, but at least one. The next audit
// continues with the following proxy ids.
#include "scene/world/audit.hpp"

#include <algorithm>

#include "collision/broad_phase/broad_phase_audit.hpp"

namespace enfilade::scene {
namespace {

using collision::ProxyId;
using collision::ProxyPair;

struct EntityBox {
  EntityId id = 0;
  Aabb box;
};

/// Avatars and bodies with their motion bounds, by proxy.
std::map<ProxyId, EntityBox> collectDynamicProxies(const WorldData& world) {
  std::map<ProxyId, EntityBox> proxies;
  for (const Avatar& avatar : world.avatars)
    proxies[avatar.proxy] = {avatar.id, avatar.motionBounds};
  for (const Body& body : world.bodies) proxies[body.proxy] = {body.id, body.motionBounds};
  return proxies;
}

/// Proxies to check in this audit; advances the cursor.
std::vector<ProxyId> selectNextProxies(WorldData& world,
                                       const std::map<ProxyId, EntityBox>& proxies,
                                       std::size_t maxBoxTests) {
  std::vector<ProxyId> selected;
  const std::size_t maxProxies =
      maxBoxTests / (world.scene->staticBoxes().size() + proxies.size() + 1);
  auto next = proxies.lower_bound(world.auditCursor.next);
  while (selected.size() < proxies.size() && (selected.empty() || selected.size() < maxProxies)) {
    if (next == proxies.end()) next = proxies.begin();
    selected.push_back(next->first);
    ++next;
  }
  world.auditCursor.next = selected.empty() ? 0 : selected.back() + 1;
  return selected;
}

EntityBox findStaticEntity(const WorldData& world, collision::StaticId staticId) {
  if (staticId >= world.scene->staticBoxes().size()) return {};
  return {world.scene->solidObjects()[staticId] + 1, world.scene->staticBoxes()[staticId]};
}

void addFindings(const WorldData& world, const std::map<ProxyId, EntityBox>& proxies,
                 AuditFinding::Kind kind, const std::vector<ProxyPair>& pairs, TickAudit& audit) {
  const auto findEntity = [&](ProxyId proxy) {
    const auto found = proxies.find(proxy);
    return found == proxies.end() ? EntityBox{} : found->second;
  };
  for (const ProxyPair& pair : pairs) {
    const EntityBox entity = findEntity(pair.proxy);
    const EntityBox other =
        pair.otherIsDynamic ? findEntity(pair.other) : findStaticEntity(world, pair.other);
    audit.findings.push_back({kind, entity.id, other.id, entity.box, other.box});
  }
}

}  // namespace

bool isAuditDue(const WorldData& world) {
  return world.auditCursor.everyTicks != 0 && world.tick % world.auditCursor.everyTicks == 0;
}

TickAudit auditTick(WorldData& world, std::size_t maxBoxTests) {
  const std::map<ProxyId, EntityBox> proxies = collectDynamicProxies(world);
  std::vector<std::pair<ProxyId, Aabb>> boxes;
  for (const auto& [proxy, entity] : proxies) boxes.emplace_back(proxy, entity.box);
  const std::vector<ProxyId> selected = selectNextProxies(world, proxies, maxBoxTests);
  const collision::BroadPhaseAudit compared = collision::compareWithBruteForce(
      world.broadPhase, world.scene->staticBoxes(), boxes, selected);
  TickAudit audit;
  audit.proxies = static_cast<std::uint32_t>(selected.size());
  audit.pairs = compared.pairs;
  addFindings(world, proxies, AuditFinding::Kind::missed, compared.missed, audit);
  addFindings(world, proxies, AuditFinding::Kind::extra, compared.extra, audit);
  std::stable_sort(
      audit.findings.begin(), audit.findings.end(),
      [](const AuditFinding& x, const AuditFinding& y) { return x.entity < y.entity; });
  return audit;
}

}  // namespace enfilade::scene
