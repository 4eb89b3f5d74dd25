#include "scene/import/import_worker.hpp"
#include "server/app/program.hpp"

int main(int argc, char** argv) {
  // The import worker is this program with a hidden command.
  if (const auto code = enfilade::scene::runImportWorker(argc, argv)) return *code;
  return static_cast<int>(enfilade::server::runProgram(argc, argv));
}
