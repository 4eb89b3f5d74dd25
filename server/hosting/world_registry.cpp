#include "server/hosting/world_registry.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "scene/model/names.hpp"
#include "server/base/sanitize_for_log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using scene::kLongestName;

/// The model's file without its folder and its ending, as far as names go.
std::string stemOf(const scene::Scene& scene) {
  std::string stem = std::filesystem::path(scene.model().source).stem().string();
  constexpr std::size_t kRoomForNumber = 8;
  stem = stem.substr(0, kLongestName - kRoomForNumber);
  for (char& c : stem)
    if (!scene::isNameLetter(c)) c = '_';
  return scene::isName(stem) ? stem : "scene";
}

/// "stem", or "stem-2" and so on where that is taken.
template <class Taken>
std::string freeNameOf(const std::string& stem, const Taken& taken) {
  std::string name = stem;
  for (std::size_t number = 2; taken(name); ++number) name = stem + "-" + std::to_string(number);
  return name;
}

v1::Error shuttingDown() {
  return errorOf(v1::ERROR_SHUTTING_DOWN, "the server ends");
}

v1::Error unknownWorld(const std::string& name) {
  return errorOf(
      v1::ERROR_UNKNOWN_WORLD,
      "there is no world '" + printable(name, kLongestName) + "': ListWorlds tells which there are",
      "drop_world.name");
}

}  // namespace

ServedScene::ServedScene(std::string sceneName, std::shared_ptr<const scene::Scene> served,
                         const DrawingOptions& drawing)
    : name(std::move(sceneName)),
      scene(std::move(served)),
      frames(scene, drawing),
      questions(scene) {}

Worlds::Worlds(const std::vector<std::shared_ptr<const scene::Scene>>& scenes,
               const WorldOptions& options, const DrawingOptions& drawing)
    : options_(options) {
  for (const auto& scene : scenes) {
    const std::string name = freeNameOf(
        stemOf(*scene), [this](const std::string& one) { return sceneNamed(one) != nullptr; });
    scenes_.push_back(std::make_unique<ServedScene>(name, scene, drawing));
  }
  for (const auto& scene : scenes_)
    start(main_ ? freeName(scene->name) : kMainWorld, *scene, false);
}

Worlds::~Worlds() {
  stop();
}

std::shared_ptr<TickLoop> Worlds::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(name.empty() ? kMainWorld : name);
  return found == worlds_.end() ? nullptr : found->second;
}

std::vector<std::shared_ptr<TickLoop>> Worlds::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<World> worlds{main_};
  for (const auto& [name, world] : worlds_)
    if (world != main_) worlds.push_back(world);
  return worlds;
}

bool Worlds::stopping() const {
  const std::lock_guard lock(mutex_);
  return stopping_;
}

v1::WorldList Worlds::list() const {
  v1::WorldList list;
  for (const World& world : all()) *list.add_worlds() = world->glance();
  return list;
}

std::vector<std::string> Worlds::sceneNames() const {
  std::vector<std::string> names;
  for (const auto& scene : scenes_) names.push_back(scene->name);
  return names;
}

void Worlds::prepareFrames() {
  for (const auto& scene : scenes_) scene->frames.prepare();
}

// ---- made and dropped ---------------------------------------------------------------------------

/// Work for the thread; false when there is none any more.
bool Worlds::give(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (!stopping_) thread_.post(std::move(work));
  return !stopping_;
}

void Worlds::create(WorldToMake wanted,
                    std::function<void(std::variant<v1::World, v1::Error>)> done) {
  if (!give([this, wanted = std::move(wanted), done] { done(make(wanted)); })) done(shuttingDown());
}

void Worlds::drop(const std::string& name, const std::string& askedIn,
                  std::function<void(std::optional<v1::Error>)> done) {
  // Another world may have the name by then.
  const auto work = [this, name, askedIn, done, asked = find(name)] {
    if (asked && find(name) != asked) return done(unknownWorld(name));
    auto taken = takeOut(name);
    if (auto* error = std::get_if<v1::Error>(&taken)) return done(std::move(*error));
    TickLoop& world = *std::get<World>(taken);
    if (name == askedIn) done(std::nullopt);
    end(world, v1::ERROR_WORLD_DROPPED, "the world '" + name + "' was dropped");
    if (name != askedIn) done(std::nullopt);
  };
  if (!give(work)) done(shuttingDown());
}

void Worlds::dropIfEmpty(const std::string& name, const World& world, const std::string& why) {
  const std::string reason = "the world '" + name + "' was dropped " + why;
  if (!world || find(name) != world || !world->askToStopIfEmpty(v1::ERROR_WORLD_DROPPED, reason))
    return;
  takeOut(name);
  end(*world, v1::ERROR_WORLD_DROPPED, reason);
}

std::variant<Worlds::World, v1::Error> Worlds::takeOut(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(name);
  if (found == worlds_.end()) return unknownWorld(name);
  if (found->second == main_) {
    return errorOf(v1::ERROR_NOT_ALLOWED,
                   "the world 'main' lasts as long as the server: Restart begins it anew",
                   "drop_world.name");
  }
  World world = std::move(found->second);
  worlds_.erase(found);
  return world;
}

void Worlds::end(TickLoop& world, v1::ErrorCode code, const std::string& reason) {
  world.stop(code, reason);
  audit_.add(world.auditTotals());
  spdlog::info("{}", reason);
}

std::variant<v1::World, v1::Error> Worlds::make(WorldToMake wanted) {
  try {
    if (auto problem = problemOf(wanted)) return std::move(*problem);
    ServedScene& scene = *sceneNamed(wanted.scene);
    if (wanted.name.empty()) wanted.name = freeName(scene.name);
    const World world = start(wanted.name, scene, wanted.dropWhenEmpty);
    spdlog::info("the world '{}' was made of '{}'", wanted.name, wanted.scene);
    return world->glance();
  } catch (const std::exception& error) {  // no memory, or no thread
    spdlog::error("no world '{}': {}", wanted.name, error.what());
    return errorOf(v1::ERROR_INTERNAL, std::string("the world could not be made: ") + error.what());
  }
}

std::optional<v1::Error> Worlds::problemOf(const WorldToMake& wanted) const {
  if (!wanted.name.empty() && !scene::isName(wanted.name)) {
    return errorOf(v1::ERROR_BAD_MESSAGE, std::string("name") + scene::kNameRule,
                   "create_world.name");
  }
  if (!sceneNamed(wanted.scene)) {
    return errorOf(v1::ERROR_UNKNOWN_WORLD,
                   "this server has no scene '" + printable(wanted.scene, kLongestName) +
                       "': Welcome.scenes names those that it was started with",
                   "create_world.scene");
  }
  const std::lock_guard lock(mutex_);
  if (worlds_.contains(wanted.name)) {
    return errorOf(v1::ERROR_NOT_ALLOWED,
                   "there is a world '" + wanted.name + "' already: enter it, or take another name",
                   "create_world.name");
  }
  if (worlds_.size() >= options_.limits.worlds) {
    return errorOf(
        v1::ERROR_TOO_LARGE,
        "the server has its " + std::to_string(options_.limits.worlds) + " worlds: drop one first");
  }
  return std::nullopt;
}

Worlds::World Worlds::start(const std::string& name, ServedScene& scene, bool dropWhenEmpty) {
  WorldPlace place{name, scene.name, this, dropWhenEmpty, {}};
  const auto itself = std::make_shared<std::weak_ptr<TickLoop>>();
  place.becameEmpty = [this, name, itself] {
    give([this, name, world = itself->lock()] {
      dropIfEmpty(name, world, "when its last client left");
    });
  };
  WorldOptions options = options_;
  if (main_) options.record.reset(), options.replay.reset();  // one file holds one world: the first
  auto world = std::make_shared<TickLoop>(scene.scene, scene.frames, scene.questions, options,
                                          std::move(place));
  *itself = world;  // before anybody can enter, and so leave
  if (dropWhenEmpty) {
    thread_.postAfter(options_.limits.entry, [this, name, itself] {
      dropIfEmpty(name, itself->lock(), "since nobody entered it");
    });
  }
  const std::lock_guard lock(mutex_);
  if (!main_) main_ = world;
  worlds_[name] = world;
  return world;
}

std::string Worlds::freeName(const std::string& stem) const {
  const std::lock_guard lock(mutex_);
  return freeNameOf(stem, [this](const std::string& name) { return worlds_.contains(name); });
}

ServedScene* Worlds::sceneNamed(const std::string& name) const {
  const auto found = std::find_if(scenes_.begin(), scenes_.end(),
                                  [&](const auto& scene) { return scene->name == name; });
  return found == scenes_.end() ? nullptr : found->get();
}

// ---- the end ------------------------------------------------------------------------------------

void Worlds::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
  }
  thread_.finish();
  const std::vector<World> worlds = all();
  const std::string reason = "the server ends";
  for (const World& world : worlds) world->askToStop(v1::ERROR_SHUTTING_DOWN, reason);
  for (const World& world : worlds) {
    world->stop(v1::ERROR_SHUTTING_DOWN, reason);
    audit_.add(world->auditTotals());
  }
}

void Worlds::finishServices() {
  for (const auto& scene : scenes_) {
    scene->frames.finish();
    scene->questions.finish();
  }
}

}  // namespace enfilade::server
