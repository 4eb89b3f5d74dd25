#include "server/net/server.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <thread>

#include "server/net/listener.hpp"
#include "server/net/page_files.hpp"

namespace enfilade::server {

namespace {

std::vector<std::shared_ptr<const scene::Scene>> prependScene(
    std::shared_ptr<const scene::Scene> first,
    std::vector<std::shared_ptr<const scene::Scene>> further) {
  further.insert(further.begin(), std::move(first));
  return further;
}

}  // namespace

struct Server::State {
  State(std::shared_ptr<const scene::Scene> scene, const HostPort& listen, ServerOptions options)
      : listener(context, listen, worlds, options.world.limits, std::move(options.access),
                 readPageFiles(options.pageFolder)),
        worlds(prependScene(std::move(scene), std::move(options.additionalScenes)), options.world,
               options.drawing) {}

  boost::asio::io_context context{1};  ///< one thread: its handlers need no lock
  Listener listener;                   ///< before `worlds`: a bind error must not start a recording
  WorldRegistry worlds;
  std::thread network;
};

void requireListenable(const HostPort& listen, const Access& access) {
  resolveProtected(listen, access);
}

Server::Server(std::shared_ptr<const scene::Scene> scene, const HostPort& listen,
               ServerOptions options)
    : state_(std::make_unique<State>(std::move(scene), listen, std::move(options))) {
  state_->listener.start();
  state_->network = std::thread([state = state_.get()] { state->context.run(); });
  state_->worlds.prepareFrames();
}

Server::~Server() {
  stop();
}

std::uint16_t Server::port() const {
  return state_->listener.port();
}

const std::string& Server::rendererName() const {
  return state_->worlds.rendererName();
}

std::vector<std::string> Server::worldNames() const {
  std::vector<std::string> names;
  for (const auto& world : state_->worlds.allWorlds()) names.push_back(world->identity().name);
  return names;
}

void Server::rethrowFailure() const {
  if (const auto failure = state_->worlds.mainWorld().failure()) std::rethrow_exception(failure);
}

AuditTotals Server::auditTotals() const {
  return state_->worlds.auditTotals();
}

bool Server::isRecordingComplete() const {
  return state_->worlds.mainWorld().isRecordingComplete();
}

void Server::stop() {
  if (!state_->network.joinable()) return;
  state_->worlds.stop();
  boost::asio::post(state_->context, [state = state_.get()] { state->listener.stop(); });
  state_->network.join();  // returns after the last session has closed
  state_->worlds.finishServices();
}

}  // namespace enfilade::server
