// Tests that every import failure is an ImportError with a remedy.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdlib>

#include "scene/import/file/model_format.hpp"
#include "scene/import/import_model.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::BoxMesh;
using tests::kOneNode;
using tests::TemporaryFolder;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Sets ENFILADE_IMPORT_FAULT for the lifetime of the object.
struct Fault {
  explicit Fault(const char* kind) { setenv("ENFILADE_IMPORT_FAULT", kind, 1); }
  ~Fault() { unsetenv("ENFILADE_IMPORT_FAULT"); }
};

void expectNoChildren() {
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST(ImportFailures, MissingFileFolderAndEmptyFileAreReported) {
  const TemporaryFolder folder;
  const auto missing = folder.getPath() / "missing.glb";
  EXPECT_TRUE(contains(catchFailure(missing), missing.string() + ": no such file"));
  EXPECT_TRUE(contains(catchFailure(folder.getPath()), "is a folder"));
  EXPECT_TRUE(contains(catchFailure(folder.write("empty.obj", "")), "empty.obj: is empty"));
}

TEST(ImportFailures, AMissingReaderModuleIsReported) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto missing = folder.getPath() / "missing.so";
  setenv("ENFILADE_ASSIMP", missing.c_str(), 1);
  const std::string text = catchFailure(file);
  unsetenv("ENFILADE_ASSIMP");
  for (const std::string& part : {file.string(), missing.string(), std::string("install it")})
    EXPECT_TRUE(contains(text, part)) << text;
  EXPECT_EQ(catchFailure(file), "");
}

TEST(ImportFailures, AnUnknownExtensionListsTheKnownOnes) {
  const TemporaryFolder folder;
  const std::string text = catchFailure(folder.write("house.skp", "x"));
  EXPECT_TRUE(contains(text, "'.skp'"));
  for (const std::string_view known : listImportableExtensions()) {
    EXPECT_TRUE(contains(text, std::string(known))) << known;
  }
}

TEST(ImportFailures, AGlbCutOffAnywhereIsAnError) {
  const TemporaryFolder folder;
  const std::string whole = tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode);
  ASSERT_EQ(catchFailure(folder.write("whole.glb", whole)), "");
  for (std::size_t size = 1; size < whole.size(); size += 97) {
    const std::string text = catchFailure(folder.write("cut.glb", whole.substr(0, size)));
    EXPECT_TRUE(contains(text, "cut.glb")) << size << ": " << text;
  }
}

TEST(ImportFailures, AGlbWithNoiseInItNeverHurtsTheCaller) {
  const TemporaryFolder folder;
  const std::string whole = tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode);
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 61) {
    std::string noisy = whole;
    noisy[at] = static_cast<char>(~noisy[at]);
    refused += static_cast<std::size_t>(!catchFailure(folder.write("noise.glb", noisy)).empty());
  }
  EXPECT_GT(refused, 5u);
  expectNoChildren();
}

TEST(ImportFailures, TruncatedAndMislabelledTextFilesAreErrors) {
  const TemporaryFolder folder;
  const std::string gltf = tests::makeGltfFile(BoxMesh({1, 1, 1}), "0", kOneNode);
  EXPECT_TRUE(contains(catchFailure(folder.write("cut.gltf", gltf.substr(0, 300))), "cut.gltf"));
  EXPECT_TRUE(contains(catchFailure(folder.write("x.dae", "<COLLADA><asset>")), "x.dae"));
  EXPECT_TRUE(contains(catchFailure(folder.write("x.ifc", "ISO-10303-21;\nDATA;\n")), "cut off"));
  EXPECT_TRUE(contains(catchFailure(folder.write("y.ifc", "hello")), "not an IFC file"));
  EXPECT_TRUE(contains(catchFailure(folder.write("x.fbx", "hello")), "x.fbx"));
  EXPECT_TRUE(contains(catchFailure(folder.write("x.obj", "v 0 0 0\n")), "x.obj"));
}

TEST(ImportFailures, AChildThatHangsIsKilledWhenTheTimeIsOver) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.glb", tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  const Fault fault("hang");
  ImportOptions options;
  options.timeLimit = 0.3;
  const std::string text = catchFailure(file, options);
  EXPECT_TRUE(contains(text, "box.glb: not read within 0.3 s")) << text;
  expectNoChildren();
}

TEST(ImportFailures, ACrashNamesTheFileTheStageAndARemedy) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.glb", tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  const Fault fault("crash");
  const std::string text = catchFailure(file);
  EXPECT_TRUE(contains(text, "box.glb")) << text;
  EXPECT_TRUE(contains(text, "crashed")) << text;
  EXPECT_TRUE(contains(text, "'open'")) << text;
  EXPECT_TRUE(contains(text, "re-export")) << text;
  expectNoChildren();
}

TEST(ImportFailures, AChildThatAnswersNothingOrNoiseIsAnError) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.glb", tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  {
    const Fault fault("exit");
    EXPECT_TRUE(contains(catchFailure(file), "ended without an answer"));
  }
  {
    const Fault fault("garbage");
    EXPECT_TRUE(contains(catchFailure(file), "sent invalid data"));
  }
  {
    const Fault fault("memory");
    EXPECT_TRUE(contains(catchFailure(file), "MiB of memory"));
  }
  EXPECT_EQ(catchFailure(file), "");
  expectNoChildren();
}

TEST(ImportFailures, AnExceptionFromProgressLeavesNoChild) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.glb", tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  const auto interrupt = [](const std::string&, double) { throw std::runtime_error("enough"); };
  EXPECT_THROW(importModel(file, {}, interrupt), std::runtime_error);
  expectNoChildren();
}

TEST(ImportFailures, OptionsOutOfRangeAreRefused) {
  const TemporaryFolder folder;
  const auto file = folder.write("box.glb", tests::makeGlbFile(BoxMesh({1, 1, 1}), "0", kOneNode));
  ImportOptions options;
  options.metresPerUnit = -1;
  EXPECT_TRUE(contains(catchFailure(file, options), "metres per unit"));
}

}  // namespace
}  // namespace enfilade::scene
