// What the way over the socket adds to a picture of 128 x 128 pixels, colour and depth: rendering
// and reading back in process beside a C++ client and the Python client, microseconds.
//
//   frame_overhead [PICTURES]     2000; run from the repository's root
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "protocol/client.hpp"
#include "render/render_thread.hpp"
#include "scene/import/model_cache.hpp"
#include "scene/world.hpp"
#include "server/frame_messages.hpp"
#include "server/load_scene.hpp"
#include "server/server.hpp"

namespace {

using namespace enfilade;

template <typename Work>
double microseconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
      .count();
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * double(values.size() - 1))];
}

void row(const char* name, const std::vector<double>& times) {
  std::printf("| %-24s | %8.1f | %8.1f |\n", name, quantile(times, 0.5), quantile(times, 0.9));
}

v1::FrameRequest smallPicture() {
  v1::FrameRequest request;
  request.mutable_free()->mutable_eye()->set_x(1.5);
  request.mutable_free()->mutable_eye()->set_y(1.6);
  request.mutable_free()->mutable_forward()->set_x(1);
  request.set_width(128);
  request.set_height(128);
  request.add_channels(v1::CHANNEL_RGB);
  request.add_channels(v1::CHANNEL_DEPTH);
  return request;
}

/// One time a line, from the Python client.
std::vector<double> byPython(std::uint16_t port, int pictures) {
  const std::string command =
      "PYTHONPATH=protocol/python /usr/bin/python3 "
      "tests/benchmarks/frame_overhead.py " +
      std::to_string(port) + " " + std::to_string(pictures);
  const std::unique_ptr<FILE, int (*)(FILE*)> output(::popen(command.c_str(), "r"), &::pclose);
  std::vector<double> times;
  char line[64];
  while (output && std::fgets(line, sizeof line, output.get())) times.push_back(std::atof(line));
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportChild(argc, argv)) return *code;
  spdlog::set_level(spdlog::level::warn);
  const int pictures = argc > 1 ? std::atoi(argv[1]) : 2000;
  server::ModelOptions model;
  model.file =
      std::filesystem::absolute(argv[0]).parent_path().parent_path() / "assets/building.glb";
  const auto scene = server::loadScene(model);
  server::Server server(scene, {"127.0.0.1", 0});
  if (server.rendererName().empty()) {
    std::fprintf(stderr, "nothing draws here\n");
    return 1;
  }
  protocol::Client client("127.0.0.1", server.port());
  render::RenderThread renderer(scene);
  const scene::World world(scene);
  const v1::FrameRequest request = smallPicture();
  const auto view = std::get<server::View>(server::viewFrom(request, *world.snapshot()));
  std::vector<double> inProcess, overSocket;
  for (int i = 0; i < pictures; ++i) {  // in turn: what else the machine does hits both
    inProcess.push_back(microseconds([&] {
      renderer.render(world.snapshot(), view.camera, view.options, view.renderer).get();
    }));
    overSocket.push_back(microseconds([&] { client.frame(request); }));
  }
  const std::vector<double> python = byPython(server.port(), pictures);
  std::printf(
      "%s, %d pictures\n| microseconds             |   median |      p90 |\n|---|---|---|\n",
      server.rendererName().c_str(), pictures);
  row("in process", inProcess);
  row("over the socket, C++", overSocket);
  if (!python.empty()) row("over the socket, Python", python);
  std::printf("the way over the socket adds %.1f us in C++",
              quantile(overSocket, 0.5) - quantile(inProcess, 0.5));
  if (!python.empty())
    std::printf(", %.1f us in Python", quantile(python, 0.5) - quantile(inProcess, 0.5));
  std::printf(" (medians)\n");
}
