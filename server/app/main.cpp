#include "scene/import/import_model.hpp"
#include "server/app/program.hpp"

int main(int argc, char** argv) {
  // The importer's child is this same program with a hidden verb.
  if (const auto code = enfilade::scene::runImportChild(argc, argv)) return *code;
  return static_cast<int>(enfilade::server::runProgram(argc, argv));
}
