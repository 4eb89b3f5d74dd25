// Tests of the model cache: a second start reads the stored entry; any changed input is imported
// again.
#include "scene/import/cache/model_cache.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>

#include "scene/import/cache/deduplicate_meshes.hpp"
#include "scene/import/worker/model_stream.hpp"
#include "tests/scene/box_scene.hpp"
#include "tests/scene/hand_made_files.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;
using tests::BoxMesh;
using tests::readContent;
using tests::TemporaryFolder;

/// A glTF file with its buffer and an image next to it, and a cache in its own folder.
class CachedModel : public ::testing::Test {
 protected:
  void SetUp() override {
    const BoxMesh box({1, 2, 3});
    file_ = folder_.write(
        "box.gltf", tests::makeGltfJson(box, "0", R"({"name":"box","mesh":0})",
                                        R"("pbrMetallicRoughness":{})", R"(,"uri":"box.bin")"));
    folder_.write("box.bin", box.toBytes());
  }

  LoadedModel load(const ImportOptions& options = {}) const {
    return loadModel(file_, options, cache_);
  }

  std::vector<fs::path> getEntries() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(cache_->folder)) found.push_back(entry.path());
    return found;
  }

  TemporaryFolder folder_;
  fs::path file_;
  std::optional<ModelCache> cache_ = ModelCache{folder_.getPath() / "cache"};
};

void overwrite(const fs::path& file, const std::string& content) {
  std::ofstream(file, std::ios::binary) << content;
}

TEST_F(CachedModel, TheSecondLoadIsTheSameModelWithoutAnImport) {
  const LoadedModel first = load(), second = load();
  EXPECT_FALSE(first.fromCache);
  EXPECT_TRUE(second.fromCache);
  EXPECT_EQ(serializeModel(second.model), serializeModel(first.model));
  EXPECT_EQ(second.importSeconds, first.importSeconds);
  EXPECT_EQ(getEntries().size(), 1u);
  EXPECT_TRUE(first.notes.empty() && second.notes.empty());
  EXPECT_FALSE(loadModel(file_, {}, std::nullopt).fromCache);
}

TEST_F(CachedModel, AFileOfTheSameContentElsewhereIsTheSame) {
  load();
  fs::create_directories(folder_.getPath() / "moved");
  for (const char* name : {"box.gltf", "box.bin"})
    fs::copy_file(folder_.getPath() / name, folder_.getPath() / "moved" / name);
  file_ = folder_.getPath() / "moved/box.gltf";
  const LoadedModel moved = load();
  EXPECT_TRUE(moved.fromCache);
  EXPECT_EQ(moved.model.source, file_.string());
}

TEST_F(CachedModel, AChangeOfTheFileOrOfTheOptionsIsAnotherEntry) {
  load();
  ImportOptions inches;
  inches.metresPerUnit = 0.0254;
  EXPECT_FALSE(load(inches).fromCache);
  EXPECT_TRUE(load(inches).fromCache);
  EXPECT_NEAR(load(inches).model.metresPerUnit, 0.0254, 0);
  ImportOptions up;
  up.up = UpAxis::z;
  EXPECT_FALSE(load(up).fromCache);
  std::string text = readContent(file_);
  text.replace(text.find("\"box\""), 5, "\"cox\"");
  overwrite(file_, text);
  const LoadedModel renamed = load();
  EXPECT_FALSE(renamed.fromCache);
  EXPECT_EQ(renamed.model.objects[0].path, "cox");
}

TEST_F(CachedModel, AModelWithoutItsRequiredAppearanceIsNotFoundByALoadThatRefusesIt) {
  std::string text = readContent(file_);
  text.replace(text.find("{\"asset\""), 1, R"({"extensionsRequired":["KHR_materials_unlit"],)");
  overwrite(file_, text);
  ImportOptions ignoring;
  ignoring.ignoreAppearance = true;
  EXPECT_THROW(load(), ImportError);
  EXPECT_FALSE(load(ignoring).fromCache);
  EXPECT_TRUE(load(ignoring).fromCache);
  EXPECT_THROW(load(), ImportError);
}

TEST_F(CachedModel, AChangeOfADependencyIsNoticed) {
  load();
  overwrite(folder_.getPath() / "box.bin", BoxMesh({4, 2, 3}).toBytes());
  const LoadedModel changed = load();
  EXPECT_FALSE(changed.fromCache);
  EXPECT_EQ(changed.model.meshes[0].positions[1].x(), 4);
  EXPECT_TRUE(load().fromCache);
}

TEST_F(CachedModel, TheLibraryThatReadItIsAmongTheFilesThatMatter) {
  const Model model = load().model;
  EXPECT_TRUE(
      std::any_of(model.dependencies.begin(), model.dependencies.end(), [](const auto& file) {
        return file.find("/libassimp.so") != std::string::npos && fs::is_regular_file(file);
      }));
}

TEST_F(CachedModel, APictureThatWasMissingAndCameIsSeen) {
  file_ =
      folder_.write("box.obj", "mtllib box.mtl\nusemtl wall\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  folder_.write("box.mtl", "newmtl wall\nKd 0.5 0.5 0.5\nmap_Kd brick.png\n");
  EXPECT_FALSE(load().fromCache);
  EXPECT_TRUE(load().fromCache);
  folder_.write("brick.png", "no picture, but a file");
  EXPECT_FALSE(load().fromCache);
  folder_.write("box.mtl", "newmtl wall\nKd 0.9 0.5 0.5\n");
  EXPECT_FALSE(load().fromCache);
  EXPECT_TRUE(load().fromCache);
}

TEST_F(CachedModel, AnEntryWithAnyBitFlippedOrCutShortIsImportedAgain) {
  const std::vector<std::byte> expected = serializeModel(load().model);
  const fs::path entry = getEntries().at(0);
  const std::string whole = readContent(entry);
  std::mt19937 random(1);
  for (int i = 0; i < 12; ++i) {
    std::string damaged = whole;
    const std::size_t place = i == 0 ? 0 : random() % whole.size();
    if (i % 3 == 2) {
      damaged.resize(place);
    } else {
      damaged[place] = static_cast<char>(damaged[place] ^ (1 << random() % 8));
    }
    overwrite(entry, damaged);
    const LoadedModel again = load();
    EXPECT_FALSE(again.fromCache) << place;
    EXPECT_EQ(again.notes.size(), 1u) << place;
    EXPECT_EQ(serializeModel(again.model), expected);
    EXPECT_EQ(readContent(entry).size(), whole.size()) << "the entry was not rewritten";
    EXPECT_TRUE(load().fromCache);
  }
}

TEST_F(CachedModel, AnEntryUnderAWrongNameIsNotUsed) {
  load();
  const fs::path entry = getEntries().at(0);
  const std::string box = readContent(entry);
  overwrite(folder_.getPath() / "box.gltf", readContent(file_) + " ");
  load();
  for (const fs::path& other : getEntries()) overwrite(other, box);
  EXPECT_FALSE(load().fromCache);
}

TEST_F(CachedModel, TheLeastRecentlyReadEntryIsEvictedFirst) {
  load();
  const std::uintmax_t bytes = fs::file_size(getEntries().at(0));
  cache_->maxBytes = 3 * bytes + bytes / 2;
  const std::string text = readContent(file_);
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(48);
  fs::last_write_time(getEntries().at(0), old);
  for (int i = 1; i <= 2; ++i) {
    overwrite(file_, text + std::string(i, ' '));
    load();
  }
  overwrite(file_, text);
  EXPECT_TRUE(load().fromCache) << "which makes it the most recently used";
  for (const fs::path& entry : getEntries()) {
    if (fs::last_write_time(entry) > old + std::chrono::hours(1)) continue;
    FAIL() << "not reported as read:" << entry;
  }
  overwrite(file_, text + " ");
  ASSERT_TRUE(load().fromCache);
  overwrite(file_, text + "    ");
  load();
  EXPECT_EQ(getEntries().size(), 3u);
  cache_->maxBytes = bytes / 2;
  overwrite(file_, text + "      ");
  const LoadedModel large = load();
  ASSERT_EQ(large.notes.size(), 1u);
  EXPECT_NE(large.notes[0].find("exceed the cache limit"), std::string::npos);
}

TEST_F(CachedModel, WithoutAFolderToWriteToItWorksAndSaysSo) {
  cache_->folder = file_ / "below a file";
  const LoadedModel loaded = load();
  EXPECT_EQ(loaded.model.objects.size(), 1u);
  ASSERT_EQ(loaded.notes.size(), 1u);
  EXPECT_NE(loaded.notes[0].find("not cached"), std::string::npos);
  cache_->folder = "/dev/full";
  EXPECT_EQ(load().notes.size(), 1u);
}

TEST_F(CachedModel, AFailedImportIsAnErrorWithoutAnEntry) {
  file_ = folder_.write("broken.gltf", "{");
  EXPECT_THROW(load(), ImportError);
  EXPECT_THROW(loadModel(folder_.getPath() / "none.gltf", {}, cache_), ImportError);
  EXPECT_FALSE(fs::exists(cache_->folder));
}

TEST(ModelCacheFolder, FollowsTheEnvironment) {
  const std::string home = std::getenv("HOME") == nullptr ? "" : std::getenv("HOME");
  const auto with = [](const char* name, const char* value) {
    for (const char* each : {"ENFILADE_CACHE", "XDG_CACHE_HOME", "ENFILADE_CACHE_MB"})
      unsetenv(each);
    setenv("HOME", "/home/ann", 1);
    if (name != nullptr) setenv(name, value, 1);
    return findDefaultModelCache();
  };
  EXPECT_EQ(with(nullptr, "")->folder, "/home/ann/.cache/enfilade");
  EXPECT_EQ(with("XDG_CACHE_HOME", "/var/tmp/ann")->folder, "/var/tmp/ann/enfilade");
  EXPECT_EQ(with("XDG_CACHE_HOME", "not/absolute")->folder, "/home/ann/.cache/enfilade");
  EXPECT_FALSE(with("ENFILADE_CACHE", "off"));
  EXPECT_EQ(with("ENFILADE_CACHE", "/srv/models")->folder, "/srv/models");
  EXPECT_EQ(with("ENFILADE_CACHE_MB", "100")->maxBytes, 100u << 20);
  EXPECT_FALSE(with("HOME", ""));
  setenv("HOME", home.c_str(), 1);
}

TEST(DeduplicateMeshes, EqualMeshesAreStoredOnceAndUnusedOnesGo) {
  Model model = testing::makeBoxModel({{"a", {0, 0, 0}, {1, 1, 1}},
                                       {"b", {0, 0, 0}, {1, 1, 1}},
                                       {"c", {0, 0, 0}, {1, 1, 2}},
                                       {"d", {0, 0, 0}, {1, 1, 1}}});
  model.meshes[1].name = "another name";
  model.meshes.push_back(model.meshes[0]);  // a mesh without users
  model.materials.resize(2);
  model.meshes[3].material = 1;
  EXPECT_EQ(deduplicateMeshes(model), 2u);
  ASSERT_EQ(model.meshes.size(), 3u);
  EXPECT_EQ(model.objects[0].meshes, model.objects[1].meshes);
  EXPECT_NE(model.objects[0].meshes, model.objects[2].meshes);
  EXPECT_NE(model.objects[0].meshes, model.objects[3].meshes);
  EXPECT_EQ(model.meshes[model.objects[2].meshes[0]].positions[7].z(), 2);
}

TEST(DeduplicateMeshes, TheSceneStaysTheSame) {
  Model model = testing::makeBoxModel(
      {{"a", {0, 0, 0}, {1, 1, 1}}, {"b", {0, 0, 0}, {1, 1, 1}}, {"c", {0, 0, 0}, {2, 1, 1}}});
  const std::uint64_t hash = Scene(model).hash();
  deduplicateMeshes(model);
  const Scene shared(std::move(model));
  EXPECT_EQ(shared.hash(), hash);
  EXPECT_EQ(shared.shapeCount(), 2u);
}

}  // namespace
}  // namespace enfilade::scene
