#include "server/base/audit_log.hpp"

#include <algorithm>

#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxLoggedFindings = 8;  // findings of one tick

std::string formatBox(const scene::Aabb& box) {
  if (box.empty()) return "no box";
  return fmt::format("box ({}, {}, {}) to ({}, {}, {})", box.min.x(), box.min.y(), box.min.z(),
                     box.max.x(), box.max.y(), box.max.z());
}

std::string formatEntity(const scene::World& world, scene::EntityId id) {
  return id == 0 ? "a removed entity" : "'" + findEntityName(world, id) + "'";
}

}  // namespace

void AuditTotals::addTotals(const AuditTotals& others) {
  ticks += others.ticks;
  pairs += others.pairs;
  missed += others.missed;
  extra += others.extra;
}

void AuditTotals::addTick(const scene::TickAudit& audit) {
  using Kind = scene::AuditFinding::Kind;
  ++ticks;
  pairs += audit.pairs;
  for (const scene::AuditFinding& finding : audit.findings) {
    ++(finding.kind == Kind::missed ? missed : extra);
  }
}

std::string formatFinding(const scene::World& world, std::uint64_t tick,
                          const scene::AuditFinding& finding) {
  const bool missed = finding.kind == scene::AuditFinding::Kind::missed;
  return fmt::format("tick {}: the broad phase {} the pair of {}, {}, and {}, {}", tick,
                     missed ? "missed" : "has, without an overlap,",
                     formatEntity(world, finding.entity), formatBox(finding.entityBox),
                     formatEntity(world, finding.other), formatBox(finding.otherBox));
}

void logFindings(const scene::World& world, const scene::TickReport& report) {
  if (!report.audit || report.audit->findings.empty()) return;
  const auto& findings = report.audit->findings;
  const std::size_t loggedCount = std::min(findings.size(), kMaxLoggedFindings);
  for (std::size_t i = 0; i < loggedCount; ++i) {
    logError("audit: {}", formatFinding(world, report.snapshot->tick, findings[i]));
  }
  if (loggedCount == findings.size()) return;
  logError("audit: tick {}: and {} more", report.snapshot->tick, findings.size() - loggedCount);
}

void logTotals(const AuditTotals& totals) {
  writeLog(totals.isClean() ? LogLevel::info : LogLevel::error,
           "audit: {} ticks, {} pairs by brute force, {} missed, {} extra", totals.ticks,
           totals.pairs, totals.missed, totals.extra);
}

}  // namespace enfilade::server
