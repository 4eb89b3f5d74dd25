#include "server/capture/script_frames.hpp"

#include <algorithm>
#include <tuple>

#include "protocol/script/script.hpp"
#include "server/capture/frame_times.hpp"
#include "server/messages/world_messages.hpp"
#include "server/runs/in_process_driver.hpp"

namespace enfilade::server {
namespace {

constexpr double kStride = 0.05;  // metres between two points of a trail
constexpr std::size_t kMostShots = 10'000'000;

class Recorder {
 public:
  Recorder(const scene::World& world, const PictureOptions& options, const Shard& shard)
      : world_(world), options_(options), shard_(shard) {}

  void see(const protocol::StepOutcome& outcome) {
    const auto snapshot = world_.snapshot();
    for (const scene::AvatarView& avatar : snapshot->avatars)
      names_.emplace(avatar.id, avatar.name);
    if (options_.overlay.paths) follow(*snapshot);
    if (options_.overlay.contacts) note(outcome);
    if (options_.every == 0) {
      for (const v1::Notice& notice : outcome.notices)
        if (notice.kind() == v1::Notice::KIND_CAPTURE)
          add(snapshot, notice.avatar(), notice.text());
    } else if (snapshot->tick % options_.every == 0) {
      add(snapshot, eyes(*snapshot), "");
    }
  }

  ShotList finish() {
    for (const auto& [id, name] : names_) list_.walkers.push_back({id, name});
    return std::move(list_);
  }

 private:
  void follow(const scene::Snapshot& snapshot) {
    for (const scene::AvatarView& avatar : snapshot.avatars) {
      auto trail = std::find_if(list_.trails.begin(), list_.trails.end(),
                                [&](const WalkTrail& t) { return t.id == avatar.id; });
      if (trail == list_.trails.end()) trail = list_.trails.insert(trail, WalkTrail{avatar.id, {}});
      if (trail->feet.empty() || (trail->feet.back().at - avatar.feet).norm() > kStride)
        trail->feet.push_back({snapshot.tick, avatar.feet});
    }
  }

  void note(const protocol::StepOutcome& outcome) {
    using Event = v1::ContactEvent;
    for (const Event& event : outcome.contacts) {
      const bool near = event.kind() == Event::KIND_NEAR;
      const bool begins =
          near ? event.phase() == Event::PHASE_BEGIN : event.kind() == Event::KIND_BEGIN;
      const bool ends = near ? event.phase() == Event::PHASE_END : event.kind() == Event::KIND_END;
      const std::tuple key(near, event.a(), event.b());
      if (begins) live_[key] = {vectorFrom(event.point_b()), near};
      if (ends) live_.erase(key);
    }
  }

  std::string eyes(const scene::Snapshot& snapshot) {
    if (options_.avatar.empty() && first_.empty() && !snapshot.avatars.empty())
      first_ = snapshot.avatars.front().name;
    return options_.avatar.empty() ? first_ : options_.avatar;
  }

  void add(const std::shared_ptr<const scene::Snapshot>& snapshot, const std::string& avatar,
           const std::string& name) {
    const scene::AvatarView* seer = avatarNamed(*snapshot, avatar);
    if (!seer) return;  // not in the world now
    Shot shot{snapshot->time, render::firstPerson(*seer, 1, 1), seer->id, nullptr, name, {}};
    for (const auto& [key, mark] : live_) shot.contacts.push_back(mark);
    if (takes(shard_, list_.shots.size())) kept_.keep(snapshot, shot);
    if (list_.shots.size() == kMostShots)
      throw CameraPathError("the walk makes more than 10,000,000 frames; give a larger --every");
    list_.shots.push_back(std::move(shot));
  }

  const scene::World& world_;
  const PictureOptions& options_;
  const Shard& shard_;
  ShotList list_;
  std::map<scene::EntityId, std::string> names_;
  std::map<std::tuple<bool, std::uint32_t, std::uint32_t>, ContactMark> live_;
  std::string first_;
  KeptSnapshots kept_;
};

/// Without a renderer every capture would count as one that failed.
class Unseen : public protocol::ScriptDriver {
 public:
  explicit Unseen(RecordedWorld& world) : driver_(world, nullptr) {}
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

ShotList walkShots(const std::shared_ptr<const scene::Scene>& scene,
                   const std::filesystem::path& script, const PictureOptions& options,
                   const Shard& shard) {
  const protocol::Script lines = protocol::readScript(script);
  RecordedWorld world{scene::World(scene)};
  Unseen driver(world);
  Recorder recorder(world, options, shard);
  const protocol::ScriptResult result = protocol::runScript(
      lines, driver, [&](protocol::StepOutcome& outcome, const protocol::ScriptProgress&) {
        recorder.see(outcome);
      });
  ShotList list = recorder.finish();
  for (const protocol::LineOutcome& outcome : result.outcomes) list.notes.push_back(outcome.text);
  list.wentWrong = result.outcomes.size();
  if (list.shots.empty())
    throw CameraPathError(
        script.string() +
        (options.every == 0
             ? ": the script captures nothing; add {\"capture\":NAME,\"as\":FILE}, or "
               "give --every TICKS"
             : ": nobody called so was in the world at any such tick; mend --avatar, "
               "or give a smaller --every"));
  return list;
}

}  // namespace enfilade::server
