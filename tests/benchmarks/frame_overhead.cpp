// What the way over the socket adds to a picture of 128 x 128 pixels, colour and depth: rendering
// and reading back in process beside a C++ client and the Python client, microseconds.
//
//   frame_overhead [PICTURES [SCENE]]     2000, the building; run from the repository's root
//
// Told are the medians and tenths: on a machine that does other work, too, the quickest tell most.
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/client.hpp"
#include "render/render_thread.hpp"
#include "scene/import/model_cache.hpp"
#include "scene/world.hpp"
#include "server/frame_messages.hpp"
#include "server/load_scene.hpp"
#include "server/server.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace enfilade;

constexpr int kBlock = 25;  // pictures of one kind before another's turn

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
  std::printf("| %-24s | %8.1f | %8.1f | %8.1f |\n", name, quantile(times, 0.1),
              quantile(times, 0.5), quantile(times, 0.9));
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

/// The Python client, in a process of its own: told by a line what to do, it answers how long that
/// took.
class ByPython {
 public:
  explicit ByPython(std::uint16_t port) {
    const std::string fifo = tests::ownFile("orders");
    if (::mkfifo(fifo.c_str(), 0600) != 0) return;
    const std::string command =
        "PYTHONPATH=protocol/python /usr/bin/python3 "
        "tests/benchmarks/frame_overhead.py " +
        std::to_string(port) + " < " + fifo;
    times_.reset(::popen(command.c_str(), "r"));
    orders_.reset(std::fopen(fifo.c_str(), "w"));  // when Python has opened the other end
    std::signal(SIGPIPE, SIG_IGN);                 // which may be gone again
    std::filesystem::remove(fifo);
  }
  /// Nothing where there is no Python.
  std::optional<double> time(const char* what) {
    if (!times_ || !orders_ || std::fprintf(orders_.get(), "%s\n", what) < 0) return std::nullopt;
    std::fflush(orders_.get());
    char line[64];
    if (!std::fgets(line, sizeof line, times_.get())) return std::nullopt;
    return std::atof(line);
  }

 private:
  struct Ended {
    void operator()(FILE* file) const { ::pclose(file); }
  };
  struct Closed {
    void operator()(FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<FILE, Ended> times_;
  std::unique_ptr<FILE, Closed> orders_;  // closed first, which ends the other
};

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportChild(argc, argv)) return *code;
  spdlog::set_level(spdlog::level::warn);
  const int pictures = argc > 1 ? std::atoi(argv[1]) : 2000;
  server::ModelOptions model;
  model.file = argc > 2 ? std::filesystem::path(argv[2])
                        : std::filesystem::absolute(argv[0]).parent_path().parent_path() /
                              "assets/building.glb";
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
  std::vector<double> inProcess, overSocket, python, steps, stepsAndPictures;
  ByPython script(server.port());
  const auto draw = [&] {
    renderer.render(world.snapshot(), view.camera, view.options, view.renderer).get();
  };
  const auto repeat = [&](const auto& once) {
    for (int i = 0; i < kBlock; ++i) once();
  };
  // In turn, since what else the machine does shall hit all; in blocks, since who takes pictures
  // takes one after the other, and finds its caches warm.
  for (int i = 0; i < pictures; i += kBlock) {
    repeat([&] { inProcess.push_back(microseconds(draw)); });
    repeat([&] { overSocket.push_back(microseconds([&] { client.frame(request); })); });
    for (const auto& [what, times] : {std::pair{"picture", &python}, std::pair{"step", &steps},
                                      std::pair{"both", &stepsAndPictures}}) {
      repeat([&] {
        if (const auto took = script.time(what)) times->push_back(*took);
      });
    }
  }
  std::printf(
      "%s, %d pictures\n| microseconds             |      p10 |   median |      p90 |\n"
      "|---|---|---|---|\n",
      server.rendererName().c_str(), pictures);
  row("in process", inProcess);
  row("over the socket, C++", overSocket);
  if (!python.empty()) {
    row("over the socket, Python", python);
    row("a step, Python", steps);
    row("both, Python", stepsAndPictures);
  }
  const auto added = [&](const std::vector<double>& times, double q) {
    return quantile(times, q) - quantile(inProcess, q);
  };
  std::printf("the way over the socket adds %.1f us in C++", added(overSocket, 0.5));
  if (!python.empty()) {
    std::printf(", %.1f us in Python, or %.1f us where it goes with a step", added(python, 0.5),
                added(stepsAndPictures, 0.5) - quantile(steps, 0.5));
  }
  std::printf(" (medians)\n");
}
