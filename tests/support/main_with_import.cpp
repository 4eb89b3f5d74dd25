// main() of test programs that import models: importModel() starts the program again.
#include <gtest/gtest.h>

#include "scene/import/import_model.hpp"

int main(int argc, char** argv) {
  if (const auto code = enfilade::scene::runImportChild(argc, argv)) return *code;
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
