#include "server/base/audit_log.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace enfilade::server {
namespace {

constexpr std::size_t kMostTold = 8;  // findings of one tick

std::string textOf(const scene::Box& box) {
  if (box.empty()) return "no box";
  return fmt::format("box ({}, {}, {}) to ({}, {}, {})", box.min.x(), box.min.y(), box.min.z(),
                     box.max.x(), box.max.y(), box.max.z());
}

std::string nameFor(const scene::World& world, scene::EntityId id) {
  return id == 0 ? "something that is gone" : "'" + nameOf(world, id) + "'";
}

}  // namespace

void AuditTotals::add(const AuditTotals& others) {
  ticks += others.ticks;
  pairs += others.pairs;
  missed += others.missed;
  extra += others.extra;
}

void AuditTotals::add(const scene::TickAudit& audit) {
  using Kind = scene::AuditFinding::Kind;
  ++ticks;
  pairs += audit.pairs;
  for (const scene::AuditFinding& finding : audit.findings) {
    ++(finding.kind == Kind::missed ? missed : extra);
  }
}

std::string textOf(const scene::World& world, std::uint64_t tick,
                   const scene::AuditFinding& finding) {
  const bool missed = finding.kind == scene::AuditFinding::Kind::missed;
  return fmt::format("tick {}: the broad phase {} the pair of {}, {}, and {}, {}", tick,
                     missed ? "missed" : "holds, without an overlap,",
                     nameFor(world, finding.mover), textOf(finding.moverBox),
                     nameFor(world, finding.other), textOf(finding.otherBox));
}

void logFindings(const scene::World& world, const scene::TickReport& report) {
  if (!report.audit || report.audit->findings.empty()) return;
  const auto& findings = report.audit->findings;
  const std::size_t told = std::min(findings.size(), kMostTold);
  for (std::size_t i = 0; i < told; ++i) {
    spdlog::error("audit: {}", textOf(world, report.snapshot->tick, findings[i]));
  }
  if (told == findings.size()) return;
  spdlog::error("audit: tick {}: and {} more", report.snapshot->tick, findings.size() - told);
}

void logTotals(const AuditTotals& totals) {
  const auto level = totals.right() ? spdlog::level::info : spdlog::level::err;
  spdlog::log(level, "audit: {} ticks, {} pairs by brute force, {} missed, {} extra", totals.ticks,
              totals.pairs, totals.missed, totals.extra);
}

}  // namespace enfilade::server
