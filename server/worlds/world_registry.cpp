#include "server/worlds/world_registry.hpp"

#include <algorithm>
#include <filesystem>

#include "collision/assert.hpp"
#include "scene/model/names.hpp"
#include "server/log/log.hpp"
#include "server/log/sanitize_for_log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

using scene::kMaxNameLength;

/// The model's file name without folder and extension, as a valid name.
std::string makeSceneName(const scene::Scene& scene) {
  std::string stem = std::filesystem::path(scene.model().source).stem().string();
  constexpr std::size_t kSuffixLength = 8;
  stem = stem.substr(0, kMaxNameLength - kSuffixLength);
  for (char& c : stem)
    if (!scene::isNameCharacter(c)) c = '_';
  return scene::isValidName(stem) ? stem : "scene";
}

/// Returns "stem", or "stem-2" and so on if the name is taken.
template <class Taken>
std::string makeUniqueName(const std::string& stem, const Taken& taken) {
  std::string name = stem;
  for (std::size_t number = 2; taken(name); ++number) name = stem + "-" + std::to_string(number);
  return name;
}

v1::Error makeShuttingDownError() {
  return makeError(v1::ERROR_SHUTTING_DOWN, "the server is stopping");
}

v1::Error makeUnknownWorldError(const std::string& name) {
  return makeError(v1::ERROR_UNKNOWN_WORLD,
                   "there is no world '" + sanitizeForLog(name, kMaxNameLength) +
                       "': ListWorlds names the worlds",
                   "drop_world.name");
}

}  // namespace

HostedScene::HostedScene(std::string sceneName, std::shared_ptr<const scene::Scene> sceneToHost,
                         const DrawingOptions& drawing)
    : name(std::move(sceneName)),
      scene(std::move(sceneToHost)),
      frames(scene, drawing),
      queries(scene),
      file(scene) {}

WorldRegistry::WorldRegistry(const std::vector<std::shared_ptr<const scene::Scene>>& scenes,
                             const WorldOptions& options, const DrawingOptions& drawing)
    : options_(options) {
  ENFILADE_ASSERT(!scenes.empty());
  for (const auto& scene : scenes) {
    const std::string name = makeUniqueName(makeSceneName(*scene), [this](const std::string& one) {
      return findScene(one) != nullptr;
    });
    scenes_.push_back(std::make_unique<HostedScene>(name, scene, drawing));
  }
  for (const auto& scene : scenes_)
    startWorld(mainWorld_ ? makeUniqueWorldName(scene->name) : kMainWorld, *scene, false);
}

WorldRegistry::~WorldRegistry() {
  stop();
}

std::shared_ptr<TickLoop> WorldRegistry::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(name.empty() ? kMainWorld : name);
  return found == worlds_.end() ? nullptr : found->second;
}

std::vector<std::shared_ptr<TickLoop>> WorldRegistry::allWorlds() const {
  const std::lock_guard lock(mutex_);
  ENFILADE_ASSERT(mainWorld_);
  std::vector<TickLoopPtr> worlds{mainWorld_};
  for (const auto& [name, world] : worlds_)
    if (world != mainWorld_) worlds.push_back(world);
  return worlds;
}

SceneFileService& WorldRegistry::getSceneFile(const TickLoop& world) const {
  HostedScene* const scene = findScene(world.identity().scene);
  ENFILADE_ASSERT(scene != nullptr);  // scenes outlive their worlds
  return scene->file;
}

bool WorldRegistry::isStopping() const {
  const std::lock_guard lock(mutex_);
  return stopping_;
}

v1::WorldList WorldRegistry::makeWorldList() const {
  v1::WorldList list;
  for (const TickLoopPtr& world : allWorlds()) *list.add_worlds() = world->makeStatus();
  return list;
}

std::vector<std::string> WorldRegistry::sceneNames() const {
  std::vector<std::string> names;
  for (const auto& scene : scenes_) names.push_back(scene->name);
  return names;
}

void WorldRegistry::prepareFrames() {
  for (const auto& scene : scenes_) scene->frames.prepare();
}

// ---- create and drop ----------------------------------------------------------------------------

/// Posts work to the thread; returns false if the server is stopping.
bool WorldRegistry::postWork(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (!stopping_) thread_.post(std::move(work));
  return !stopping_;
}

void WorldRegistry::work(std::vector<std::function<void()>> received) {
  const std::lock_guard lock(mutex_);
  if (!stopping_) workers_.post(std::move(received));  // else the worlds' own threads answer
}

void WorldRegistry::create(CreateWorldRequest request,
                           std::function<void(std::variant<v1::World, v1::Error>)> done) {
  if (!postWork([this, request = std::move(request), done] { done(createNow(request)); }))
    done(makeShuttingDownError());
}

void WorldRegistry::drop(const std::string& name, const std::string& requestingWorld,
                         std::function<void(std::optional<v1::Error>)> done) {
  // Another world may have this name when the work runs.
  const auto work = [this, name, requestingWorld, done, requested = find(name)] {
    if (requested && find(name) != requested) return done(makeUnknownWorldError(name));
    auto removed = remove(name);
    if (auto* error = std::get_if<v1::Error>(&removed)) return done(std::move(*error));
    TickLoop& world = *std::get<TickLoopPtr>(removed);
    if (name == requestingWorld) done(std::nullopt);
    endWorld(world, v1::ERROR_WORLD_DROPPED, "the world '" + name + "' was dropped");
    if (name != requestingWorld) done(std::nullopt);
  };
  if (!postWork(work)) done(makeShuttingDownError());
}

namespace {

class TickLoopMembership final : public WorldMembership {
 public:
  TickLoopMembership(std::shared_ptr<TickLoop> world, ClientId id)
      : world_(std::move(world)), id_(id) {}
  ~TickLoopMembership() override { world_->leave(id_); }
  std::function<void()> receive(std::vector<v1::ClientMessage> messages) override {
    world_->queue(id_, std::move(messages));
    return [world = world_] { world->workIfAtRest(); };
  }

 private:
  std::shared_ptr<TickLoop> world_;
  ClientId id_;
};

}  // namespace

std::unique_ptr<WorldMembership> WorldRegistry::join(const std::string& world,
                                                     const std::string& name, Role role,
                                                     std::shared_ptr<OutgoingQueue> out,
                                                     MessagePacker pack) {
  const TickLoopPtr found = find(world);
  const ClientId id =
      found ? found->join(name, role, std::move(out), 0, false, std::move(pack)) : 0;
  return id == 0 ? nullptr : std::make_unique<TickLoopMembership>(found, id);
}

void WorldRegistry::dropIfEmpty(const std::string& name, const TickLoopPtr& world,
                                const std::string& cause) {
  const std::string reason = "the world '" + name + "' was dropped " + cause;
  if (!world || find(name) != world || !world->requestStopIfEmpty(v1::ERROR_WORLD_DROPPED, reason))
    return;
  remove(name);
  endWorld(*world, v1::ERROR_WORLD_DROPPED, reason);
}

std::variant<WorldRegistry::TickLoopPtr, v1::Error> WorldRegistry::remove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(name);
  if (found == worlds_.end()) return makeUnknownWorldError(name);
  if (found->second == mainWorld_) {
    return makeError(v1::ERROR_NOT_ALLOWED, "the world 'main' cannot be dropped: Restart resets it",
                     "drop_world.name");
  }
  TickLoopPtr world = std::move(found->second);
  worlds_.erase(found);
  return world;
}

void WorldRegistry::endWorld(TickLoop& world, v1::ErrorCode code, const std::string& reason) {
  ENFILADE_ASSERT(&world != mainWorld_.get());
  world.stop(code, reason);
  auditTotals_.addTotals(world.auditTotals());
  logInfo("{}", reason);
}

std::variant<v1::World, v1::Error> WorldRegistry::createNow(CreateWorldRequest request) {
  try {
    if (auto error = validateRequest(request)) return std::move(*error);
    HostedScene& scene = *findScene(request.scene);
    if (request.name.empty()) request.name = makeUniqueWorldName(scene.name);
    const TickLoopPtr world = startWorld(request.name, scene, request.dropWhenEmpty);
    logInfo("created the world '{}' of the scene '{}'", request.name, request.scene);
    return world->makeStatus();
  } catch (const std::exception& error) {  // no memory, or no thread
    logError("cannot create the world '{}': {}", request.name, error.what());
    return makeError(v1::ERROR_INTERNAL, std::string("cannot create the world: ") + error.what());
  }
}

std::optional<v1::Error> WorldRegistry::validateRequest(const CreateWorldRequest& request) const {
  if (!request.name.empty() && !scene::isValidName(request.name)) {
    return makeError(v1::ERROR_BAD_MESSAGE, std::string("name") + scene::kNameRule,
                     "create_world.name");
  }
  if (!findScene(request.scene)) {
    return makeError(v1::ERROR_UNKNOWN_WORLD,
                     "this server has no scene '" + sanitizeForLog(request.scene, kMaxNameLength) +
                         "': Welcome.scenes lists its scenes",
                     "create_world.scene");
  }
  const std::lock_guard lock(mutex_);
  if (worlds_.contains(request.name)) {
    return makeError(
        v1::ERROR_NOT_ALLOWED,
        "there is a world '" + request.name + "' already: enter it, or take another name",
        "create_world.name");
  }
  if (worlds_.size() >= options_.limits.worlds) {
    return makeError(
        v1::ERROR_TOO_LARGE,
        "the server has its " + std::to_string(options_.limits.worlds) + " worlds: drop one first");
  }
  return std::nullopt;
}

WorldRegistry::TickLoopPtr WorldRegistry::startWorld(const std::string& name, HostedScene& scene,
                                                     bool dropWhenEmpty) {
  WorldIdentity identity{name, scene.name, this, dropWhenEmpty, {}};
  const auto weakWorld = std::make_shared<std::weak_ptr<TickLoop>>();
  identity.becameEmpty = [this, name, weakWorld] {
    postWork([this, name, world = weakWorld->lock()] {
      dropIfEmpty(name, world, "because its last client left");
    });
  };
  WorldOptions options = options_;
  if (mainWorld_) options.record.reset(), options.replay.reset();  // only "main" uses them
  auto world = std::make_shared<TickLoop>(scene.scene, scene.frames, scene.queries, options,
                                          std::move(identity));
  *weakWorld = world;  // before a client can enter and leave
  if (dropWhenEmpty) {
    thread_.postAfter(options_.limits.emptyWorldTimeout, [this, name, weakWorld] {
      dropIfEmpty(name, weakWorld->lock(), "because no client entered it");
    });
  }
  const std::lock_guard lock(mutex_);
  ENFILADE_ASSERT(!worlds_.contains(name));
  if (!mainWorld_) mainWorld_ = world;
  worlds_[name] = world;
  return world;
}

std::string WorldRegistry::makeUniqueWorldName(const std::string& stem) const {
  const std::lock_guard lock(mutex_);
  return makeUniqueName(stem, [this](const std::string& name) { return worlds_.contains(name); });
}

HostedScene* WorldRegistry::findScene(const std::string& name) const {
  const auto found = std::find_if(scenes_.begin(), scenes_.end(),
                                  [&](const auto& scene) { return scene->name == name; });
  return found == scenes_.end() ? nullptr : found->get();
}

// ---- shutdown -----------------------------------------------------------------------------------

void WorldRegistry::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    stopping_ = true;
  }
  thread_.finish();
  const std::vector<TickLoopPtr> worlds = allWorlds();
  const std::string reason = "the server is stopping";
  for (const TickLoopPtr& world : worlds) world->requestStop(v1::ERROR_SHUTTING_DOWN, reason);
  for (const TickLoopPtr& world : worlds) {
    world->stop(v1::ERROR_SHUTTING_DOWN, reason);
    auditTotals_.addTotals(world->auditTotals());
  }
  workers_.finish();
}

void WorldRegistry::finishServices() {
  for (const auto& scene : scenes_) {
    scene->frames.finish();
    scene->queries.finish();
    scene->file.finish();
  }
}

}  // namespace enfilade::server
