// main() of test programs that import models: importModel() starts this program as its worker.
#include <gtest/gtest.h>

#include "scene/import/import_worker.hpp"

int main(int argc, char** argv) {
  if (const auto code = enfilade::scene::runImportWorker(argc, argv)) return *code;
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
