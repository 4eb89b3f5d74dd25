// Measures the socket's overhead for an image of 128 x 128 pixels, colour and depth, for a C++
// client and the Python client. First: waiting time minus drawing and read-back time of the same
// image (Frame.drawing_seconds), which is least sensitive to machine noise. Second: waiting time
// minus the time of rendering in process on another thread.
//
//   frame_overhead [PICTURES [SCENE]]     2000, the building; run from the repository's root
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

#include "protocol/clients/cpp/client.hpp"
#include "render/service/render_thread.hpp"
#include "scene/import/cache/model_cache.hpp"
#include "scene/import/import_worker.hpp"
#include "scene/world/world.hpp"
#include "server/base/load_scene.hpp"
#include "server/messages/frame_messages.hpp"
#include "server/net/server.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace enfilade;

constexpr int kBlock = 25;  // images of one kind before the next kind's turn

template <typename Work>
double measureMicroseconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
      .count();
}

double computeQuantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * double(values.size() - 1))];
}

void printRow(const char* name, const std::vector<double>& times) {
  std::printf("| %-24s | %8.1f | %8.1f | %8.1f |\n", name, computeQuantile(times, 0.1),
              computeQuantile(times, 0.5), computeQuantile(times, 0.9));
}

v1::FrameRequest makeSmallPicture() {
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

/// Microseconds until a client had its image, and the part without drawing and read-back.
struct Waited {
  std::vector<double> whole, added;
  void push(double waited, double drawn) {
    whole.push_back(waited);
    added.push_back(waited - drawn);
  }
};

/// The Python client in a child process. It reads a command line and answers with the time taken
/// and the drawing time.
class ByPython {
 public:
  explicit ByPython(std::uint16_t port) {
    const std::string fifo = tests::makeOwnFile("orders");
    if (::mkfifo(fifo.c_str(), 0600) != 0) return;
    const std::string command =
        "PYTHONPATH=protocol/clients/python /usr/bin/python3 "
        "tests/benchmarks/frame_overhead.py " +
        std::to_string(port) + " < " + fifo;
    times_.reset(::popen(command.c_str(), "r"));
    orders_.reset(std::fopen(fifo.c_str(), "w"));  // opens once Python has opened the other end
    std::signal(SIGPIPE, SIG_IGN);                 // Python may exit before us
    std::filesystem::remove(fifo);
  }
  /// Adds no values without Python.
  void time(const char* what, Waited& to) {
    if (!times_ || !orders_ || std::fprintf(orders_.get(), "%s\n", what) < 0) return;
    std::fflush(orders_.get());
    double waited = 0, drawn = 0;
    if (std::fscanf(times_.get(), "%lf %lf", &waited, &drawn) == 2) to.push(waited, drawn);
  }

 private:
  struct Ended {
    void operator()(FILE* file) const { ::pclose(file); }
  };
  struct Closed {
    void operator()(FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<FILE, Ended> times_;
  std::unique_ptr<FILE, Closed> orders_;  // closed first, which ends the child
};

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportWorker(argc, argv)) return *code;
  spdlog::set_level(spdlog::level::warn);
  const int pictures = argc > 1 ? std::atoi(argv[1]) : 2000;
  server::ModelOptions model;
  model.file = argc > 2 ? std::filesystem::path(argv[2])
                        : std::filesystem::absolute(argv[0]).parent_path().parent_path() /
                              "assets/building.glb";
  const auto scene = server::loadScene(model);
  server::Server server(scene, {"127.0.0.1", 0});
  if (server.rendererName().empty()) {
    std::fprintf(stderr, "no renderer available\n");
    return 1;
  }
  protocol::Client client("127.0.0.1", server.port());
  render::RenderThread renderer(scene);
  const scene::World world(scene);
  const v1::FrameRequest request = makeSmallPicture();
  const auto view =
      std::get<render::ViewRequest>(server::viewFromProto(request, *world.snapshot()));
  constexpr double kMicro = 1e6;
  Waited inProcess, overSocket, python, steps, stepsAndPictures;
  ByPython script(server.port());
  const auto draw = [&] {
    double drawn = 0;
    const double waited = measureMicroseconds([&] {
      drawn = renderer.render(world.snapshot(), view.camera, view.options, view.renderer)
                  .get()
                  .statistics.seconds;
    });
    inProcess.push(waited, kMicro * drawn);
  };
  const auto fetch = [&] {
    double drawn = 0;
    const double waited =
        measureMicroseconds([&] { drawn = client.frame(request).description.drawing_seconds(); });
    overSocket.push(waited, kMicro * drawn);
  };
  const auto repeat = [&](const auto& once) {
    for (int i = 0; i < kBlock; ++i) once();
  };
  // Kinds alternate, so that other load affects all of them. They run in blocks, because a client
  // that takes images takes several in a row and finds its caches warm.
  for (int i = 0; i < pictures; i += kBlock) {
    repeat(draw);
    repeat(fetch);
    repeat([&] { script.time("picture", python); });
    repeat([&] { script.time("step", steps); });
    repeat([&] { script.time("both", stepsAndPictures); });
  }
  std::printf(
      "%s, %d pictures\n| microseconds             |      p10 |   median |      p90 |\n"
      "|---|---|---|---|\n",
      server.rendererName().c_str(), pictures);
  printRow("in process", inProcess.whole);
  printRow("over the socket, C++", overSocket.whole);
  printRow("  without drawing it", overSocket.added);
  if (!python.whole.empty()) {
    printRow("over the socket, Python", python.whole);
    printRow("  without drawing it", python.added);
    printRow("a step, Python", steps.whole);
    printRow("both, Python", stepsAndPictures.whole);
    printRow("  without drawing it", stepsAndPictures.added);
  }
  const double step = python.whole.empty() ? 0 : computeQuantile(steps.whole, 0.5);
  const auto printRow = [&](const char* who, const Waited& waited, double others) {
    if (waited.whole.empty()) return;
    std::printf(
        "%s: %.1f us more than drawing the same image, %.1f us more than in process\n", who,
        computeQuantile(waited.added, 0.5) - others,
        computeQuantile(waited.whole, 0.5) - computeQuantile(inProcess.whole, 0.5) - others);
  };
  std::printf("Overhead of the socket (medians)\n");
  printRow("C++", overSocket, 0);
  printRow("Python", python, 0);
  printRow("Python, beyond its step", stepsAndPictures, step);
}
