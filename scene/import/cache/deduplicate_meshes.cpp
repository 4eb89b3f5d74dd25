#include "scene/import/cache/deduplicate_meshes.hpp"

#include <bit>
#include <map>
#include <span>

#include "scene/import/file/content_hash.hpp"
#include "scene/model/hasher.hpp"

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;

template <class T>
void addBytes(Hasher& hash, const std::vector<T>& values) {
  const ContentHash bytes = computeContentHash(std::as_bytes(std::span(values)));
  hash.add(std::uint64_t{values.size()});
  hash.add(bytes.high);
  hash.add(bytes.low);
}

std::uint64_t computeMeshHash(const Mesh& mesh) {
  Hasher hash;
  addBytes(hash, mesh.positions);
  addBytes(hash, mesh.normals);
  addBytes(hash, mesh.uvs);
  addBytes(hash, mesh.colours);
  addBytes(hash, mesh.indices);
  hash.add(std::uint64_t{mesh.material});
  return hash.value();
}

template <class Vector>
bool areBitwiseEqual(const std::vector<Vector>& a, const std::vector<Vector>& b) {
  const auto same = [](const Vector& u, const Vector& v) {
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      if (std::bit_cast<std::uint32_t>(u[i]) != std::bit_cast<std::uint32_t>(v[i])) return false;
    }
    return true;
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

bool areMeshesEqual(const Mesh& a, const Mesh& b) {
  return a.material == b.material && a.indices == b.indices &&
         areBitwiseEqual(a.positions, b.positions) && areBitwiseEqual(a.normals, b.normals) &&
         areBitwiseEqual(a.uvs, b.uvs) && a.colours == b.colours;
}

/// Returns for each mesh the index of the first equal one.
std::vector<std::uint32_t> findFirstEqualMeshes(const std::vector<Mesh>& meshes) {
  std::multimap<std::uint64_t, std::uint32_t> byHash;
  std::vector<std::uint32_t> first;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    const std::uint64_t hash = computeMeshHash(meshes[i]);
    std::uint32_t found = i;
    const auto [begin, end] = byHash.equal_range(hash);
    for (auto other = begin; other != end && found == i; ++other) {
      if (areMeshesEqual(meshes[other->second], meshes[i])) found = other->second;
    }
    if (found == i) byHash.emplace(hash, i);
    first.push_back(found);
  }
  return first;
}

}  // namespace

std::size_t deduplicateMeshes(Model& model) {
  const std::vector<std::uint32_t> first = findFirstEqualMeshes(model.meshes);
  std::vector<bool> used(model.meshes.size(), false);
  for (const Object& object : model.objects) {
    for (const std::uint32_t mesh : object.meshes) used[first[mesh]] = true;
  }
  std::vector<std::uint32_t> number(model.meshes.size(), kNone);
  std::vector<Mesh> kept;
  for (std::uint32_t i = 0; i < model.meshes.size(); ++i) {
    if (!used[i]) continue;
    number[i] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(std::move(model.meshes[i]));
  }
  for (Object& object : model.objects) {
    for (std::uint32_t& mesh : object.meshes) mesh = number[first[mesh]];
  }
  const std::size_t removed = model.meshes.size() - kept.size();
  model.meshes = std::move(kept);
  return removed;
}

}  // namespace enfilade::scene
