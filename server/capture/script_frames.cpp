#include "server/capture/script_frames.hpp"

#include <algorithm>
#include <tuple>

#include "protocol/script/script_run.hpp"
#include "server/capture/frame_times.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/in_process_driver.hpp"

namespace enfilade::server {
namespace {

constexpr double kTrailStep = 0.05;  // metres between two points of a trail
constexpr std::size_t kMaxFrames = 10'000'000;

class FrameCollector {
 public:
  FrameCollector(const scene::World& world, const PictureOptions& options, const Shard& shard)
      : world_(world), options_(options), shard_(shard) {}

  void processStep(const protocol::StepOutcome& outcome) {
    const auto snapshot = world_.snapshot();
    for (const scene::AvatarSnapshot& avatar : snapshot->avatars)
      names_.emplace(avatar.id, avatar.name);
    if (options_.overlay.paths) extendTrails(*snapshot);
    if (options_.overlay.contacts) updateContacts(outcome);
    if (options_.every == 0) {
      for (const v1::Notice& notice : outcome.notices)
        if (notice.kind() == v1::Notice::KIND_CAPTURE)
          addFrame(snapshot, notice.avatar(), notice.text());
    } else if (snapshot->tick % options_.every == 0) {
      addFrame(snapshot, selectAvatar(*snapshot), "");
    }
  }

  CapturePlan finish() {
    for (const auto& [id, name] : names_) plan_.avatars.push_back({id, name});
    return std::move(plan_);
  }

 private:
  void extendTrails(const scene::Snapshot& snapshot) {
    for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
      auto trail = std::find_if(plan_.trails.begin(), plan_.trails.end(),
                                [&](const AvatarTrail& t) { return t.id == avatar.id; });
      if (trail == plan_.trails.end())
        trail = plan_.trails.insert(trail, AvatarTrail{avatar.id, {}});
      if (trail->steps.empty() ||
          (trail->steps.back().position - avatar.footPosition).norm() > kTrailStep)
        trail->steps.push_back({snapshot.tick, avatar.footPosition});
    }
  }

  void updateContacts(const protocol::StepOutcome& outcome) {
    using Event = v1::ContactEvent;
    for (const Event& event : outcome.contacts) {
      const bool isNearMiss = event.kind() == Event::KIND_NEAR;
      const bool begins =
          isNearMiss ? event.phase() == Event::PHASE_BEGIN : event.kind() == Event::KIND_BEGIN;
      const bool ends =
          isNearMiss ? event.phase() == Event::PHASE_END : event.kind() == Event::KIND_END;
      const std::tuple key(isNearMiss, event.a(), event.b());
      if (begins) activeContacts_[key] = {vectorFromProto(event.point_b()), isNearMiss};
      if (ends) activeContacts_.erase(key);
    }
  }

  std::string selectAvatar(const scene::Snapshot& snapshot) {
    if (options_.avatar.empty() && firstAvatar_.empty() && !snapshot.avatars.empty())
      firstAvatar_ = snapshot.avatars.front().name;
    return options_.avatar.empty() ? firstAvatar_ : options_.avatar;
  }

  void addFrame(const std::shared_ptr<const scene::Snapshot>& snapshot, const std::string& avatar,
                const std::string& name) {
    const scene::AvatarSnapshot* viewer = findAvatar(*snapshot, avatar);
    if (!viewer) return;  // the avatar is not in the world
    CaptureFrame captureFrame{snapshot->time, render::makeFirstPersonCamera(*viewer, 1, 1),
                              viewer->id,     nullptr,
                              name,           {}};
    for (const auto& [key, mark] : activeContacts_) captureFrame.contacts.push_back(mark);
    if (isInShard(shard_, plan_.frames.size())) snapshots_.keep(snapshot, captureFrame);
    if (plan_.frames.size() == kMaxFrames)
      throw CameraPathError("the walk has more than 10,000,000 frames; give a larger --every");
    plan_.frames.push_back(std::move(captureFrame));
  }

  const scene::World& world_;
  const PictureOptions& options_;
  const Shard& shard_;
  CapturePlan plan_;
  std::map<scene::EntityId, std::string> names_;
  std::map<std::tuple<bool, std::uint32_t, std::uint32_t>, ContactMark> activeContacts_;
  std::string firstAvatar_;
  SnapshotStore snapshots_;
};

/// A driver that ignores captures. Without a renderer each capture would count as failed.
class CaptureIgnoringDriver : public protocol::ScriptDriver {
 public:
  explicit CaptureIgnoringDriver(RecordableWorld& world) : driver_(world, nullptr) {}
  double tickSeconds() const override { return driver_.tickSeconds(); }
  std::optional<v1::Error> submit(const v1::Command& command) override {
    return driver_.submit(command);
  }
  std::optional<v1::Error> submit(const v1::BodyCommand& command) override {
    return driver_.submit(command);
  }
  protocol::StepOutcome step() override {
    protocol::StepOutcome outcome = driver_.step();
    outcome.frames.clear();
    return outcome;
  }

 private:
  InProcessDriver driver_;
};

}  // namespace

CapturePlan planScriptFrames(const std::shared_ptr<const scene::Scene>& scene,
                             const std::filesystem::path& script, const PictureOptions& options,
                             const Shard& shard) {
  const protocol::Script lines = protocol::readScript(script);
  RecordableWorld world{scene::World(scene)};
  CaptureIgnoringDriver driver(world);
  FrameCollector collector(world, options, shard);
  const protocol::ScriptResult result = protocol::runScript(
      lines, driver, [&](protocol::StepOutcome& outcome, const protocol::ScriptProgress&) {
        collector.processStep(outcome);
      });
  CapturePlan plan = collector.finish();
  for (const protocol::LineOutcome& outcome : result.outcomes) plan.notes.push_back(outcome.text);
  plan.failedOrders = result.outcomes.size();
  if (plan.frames.empty())
    throw CameraPathError(
        script.string() +
        (options.every == 0
             ? ": the script has no captures; add {\"capture\":NAME,\"as\":FILE}, or "
               "give --every TICKS"
             : ": no avatar of this name was in the world at these ticks; correct --avatar, "
               "or give a smaller --every"));
  return plan;
}

}  // namespace enfilade::server
