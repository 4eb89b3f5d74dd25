#include "server/server.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <thread>

#include "server/listener.hpp"

namespace enfilade::server {

struct Server::State {
  State(std::shared_ptr<const scene::Scene> scene, const Endpoint& listen, ServerOptions options)
      : frames(scene, options.drawing),
        rays(scene),
        loop(std::move(scene), frames, rays, options.world),
        listener(context, listen, loop, options.world.limits, std::move(options.access)) {}

  boost::asio::io_context context{1};  ///< one thread: its handlers need no lock
  FrameService frames;
  RayService rays;
  TickLoop loop;
  Listener listener;
  std::thread network;
};

Server::Server(std::shared_ptr<const scene::Scene> scene, const Endpoint& listen,
               ServerOptions options)
    : state_(std::make_unique<State>(std::move(scene), listen, std::move(options))) {
  state_->listener.start();
  state_->network = std::thread([state = state_.get()] { state->context.run(); });
}

Server::~Server() {
  stop();
}

std::uint16_t Server::port() const {
  return state_->listener.port();
}

const std::string& Server::rendererName() const {
  return state_->frames.deviceName();
}

void Server::rethrowFailure() const {
  if (const auto failure = state_->loop.failure()) std::rethrow_exception(failure);
}

AuditTotals Server::auditTotals() const {
  return state_->loop.auditTotals();
}

void Server::stop() {
  if (!state_->network.joinable()) return;
  state_->loop.stop();
  boost::asio::post(state_->context, [state = state_.get()] { state->listener.stop(); });
  state_->network.join();  // when the last session is closed
  state_->frames.finish();
  state_->rays.finish();
}

}  // namespace enfilade::server
