#include "scene/import/file_metadata.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "scene/import/file/import_options.hpp"
#include "scene/import/file/read_file.hpp"
#include "scene/import/file/zip_archive.hpp"
#include "scene/import/ifc/ifc_units.hpp"
#include "scene/model/ascii.hpp"

namespace enfilade::scene {
namespace {

std::optional<double> parseNumber(std::string_view text) {
  while (!text.empty() && std::strchr(" \t\r\n\"'", text.front()) != nullptr) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// ---- glTF ---------------------------------------------------------------------------------------

std::uint32_t readLittleEndian32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

void requireWholeGlb(const std::filesystem::path& file) {
  const std::string start = readModelFile(file, 12);
  if (start.size() < 12 || start.compare(0, 4, "glTF") != 0) {
    throw ImportError(file.string() + ": not a GLB file (it does not begin with 'glTF'); export " +
                      "it again, or rename a JSON file to .gltf");
  }
  if (readLittleEndian32(start, 4) != 2) {
    throw ImportError(file.string() + ": glTF version " +
                      std::to_string(readLittleEndian32(start, 4)) +
                      " cannot be read; export it as glTF 2.0");
  }
  const std::uint64_t declaredSize = readLittleEndian32(start, 8);
  if (declaredSize > file_size(file)) {
    throw ImportError(file.string() + ": cut off: its header says " + std::to_string(declaredSize) +
                      " bytes, the file has " + std::to_string(file_size(file)) +
                      "; copy or download it again");
  }
}

/// Throws if a .gltf file is a GLB file.
void rejectGlb(const std::filesystem::path& file) {
  if (readModelFile(file, 4) == "glTF")
    throw ImportError(file.string() +
                      ": is a GLB file by its first bytes; check where it comes from and rename " +
                      "it to .glb");
}

// ---- COLLADA ------------------------------------------------------------------------------------

constexpr std::array<std::string_view, 1> kColladaExtension{".dae"};

bool isZippedCollada(const std::filesystem::path& file) {
  return toLowerCase(file.extension().string()) == ".zae";
}

std::string readColladaText(const std::filesystem::path& file, std::size_t limit) {
  if (!isZippedCollada(file)) return readModelFile(file, limit);
  // Limited by limitZipMembers().
  return readOnlyZipMember(file, kColladaExtension, std::string::npos).substr(0, limit);
}

FileMetadata readColladaMetadata(const std::filesystem::path& file, std::size_t maxUnpacked) {
  // All files of the archive: assimp unzips pictures, too.
  if (isZippedCollada(file)) limitZipMembers(file, maxUnpacked);
  // The <asset> of the whole document comes before all libraries.
  const std::string start = readColladaText(file, 1 << 20);
  const std::size_t begin = start.find("<asset");
  const std::size_t end = begin == std::string::npos ? begin : start.find("</asset>", begin);
  const std::string asset =
      end == std::string::npos ? std::string() : start.substr(begin, end - begin);

  FileMetadata metadata;
  const std::size_t unit = asset.find("<unit");
  std::optional<double> metres;
  if (unit != std::string::npos) {
    const std::string tag = asset.substr(unit, asset.find('>', unit) - unit);
    const std::size_t meter = tag.find("meter=");
    if (meter != std::string::npos) metres = parseNumber(std::string_view(tag).substr(meter + 6));
  }
  if (metres && *metres > 0) {
    metadata.metresPerUnit = metadata.assimpScale = *metres;
  } else {
    metadata.problems.push_back(
        {"no_unit", 1, "<asset> has no <unit meter=...>: taken for metres"});
  }
  if (asset.find("Z_UP") != std::string::npos) metadata.up = metadata.assimpUp = UpAxis::z;
  if (asset.find("X_UP") != std::string::npos) metadata.up = metadata.assimpUp = UpAxis::x;
  return metadata;
}

// ---- FBX ----------------------------------------------------------------------------------------

/// Returns the number of property `name` in text or binary settings. ASCII files write it after
/// three strings; binary files as 'D' or 'I' and its bytes.
std::optional<double> findFbxSetting(const std::string& text, const std::string& name) {
  for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    const char before = at == 0 ? ' ' : text[at - 1];
    std::size_t next = at + name.size();
    if (before == '"' && next < text.size() && text[next] == '"') {
      const std::size_t lineEnd = std::min(text.find('\n', next), text.size());
      const std::size_t comma = text.rfind(',', lineEnd);
      if (comma != std::string::npos && comma > next) {
        return parseNumber(std::string_view(text).substr(comma + 1, lineEnd - comma - 1));
      }
    } else if (before == '\0') {  // the last byte of the length of a short string
      for (int strings = 0; strings < 3 && next + 5 <= text.size() && text[next] == 'S';
           ++strings) {
        next += 5 + readLittleEndian32(text, next + 1);
        if (next > text.size()) return std::nullopt;
      }
      if (next + 9 <= text.size() && text[next] == 'D') {
        double value = 0;
        std::memcpy(&value, text.data() + next + 1, sizeof value);
        return std::isfinite(value) ? std::optional(value) : std::nullopt;
      }
      if (next + 5 <= text.size() && text[next] == 'I') {
        return static_cast<std::int32_t>(readLittleEndian32(text, next + 1));
      }
    }
  }
  return std::nullopt;
}

FileMetadata readFbxMetadata(const std::filesystem::path& file) {
  const std::string start = readModelFile(file, 1 << 20);
  FileMetadata metadata;
  const double centimetres = findFbxSetting(start, "UnitScaleFactor").value_or(0);
  const bool assimpWroteIt = start.find("Open Asset Import Library") != std::string::npos;
  if (assimpWroteIt && (centimetres == 1 || centimetres == 0)) {
    // assimp's exporter writes the constant 1 (centimetres) for any unit. Its coordinates mostly
    // come from formats in metres.
    metadata.problems.push_back(
        {"unit_assumed", 1,
         "written by assimp, which says centimetres for any unit: taken for "
         "metres; say --unit if that is wrong"});
  } else if (centimetres > 0) {
    metadata.metresPerUnit = centimetres / 100;
  } else {
    metadata.metresPerUnit = 0.01;
    metadata.problems.push_back({"no_unit", 1, "no UnitScaleFactor: taken for centimetres"});
  }
  const double up = findFbxSetting(start, "UpAxis").value_or(1);
  const bool isDown = findFbxSetting(start, "UpAxisSign").value_or(1) < 0;
  const UpAxis axis = up == 0 ? UpAxis::x : up == 2 ? UpAxis::z : UpAxis::y;
  metadata.up = isDown ? negate(axis) : axis;  // assimp does not convert the axes
  return metadata;
}

/// Returns whether a blank separates '>' from the first character of a number. assimp 5.2.5 cannot
/// read that.
bool isBlankBeforeNumber(std::string_view text, std::size_t i) {
  if (text[i] != '>') return false;
  const std::size_t next = text.find_first_not_of(" \t\r\n", i + 1);
  return next != std::string_view::npos && next > i + 1 &&
         std::strchr("+-.0123456789", text[next]) != nullptr;
}

}  // namespace

FileMetadata readFileMetadata(const std::filesystem::path& file, ModelFormat format,
                              std::size_t maxUnpacked) {
  FileMetadata metadata;
  switch (format) {
    case ModelFormat::gltf:
      rejectGlb(file);
      break;
    case ModelFormat::glb:
      requireWholeGlb(file);
      break;
    case ModelFormat::obj:
      metadata.problems.push_back({"no_unit", 1, "OBJ has no unit: taken for metres"});
      break;
    case ModelFormat::collada:
      return readColladaMetadata(file, maxUnpacked);
    case ModelFormat::fbx:
      return readFbxMetadata(file);
    case ModelFormat::ifc:
    case ModelFormat::ply:
    case ModelFormat::stl:
      break;
  }
  return metadata;
}

FileMetadata readIfcFileMetadata(const std::string& text) {
  FileMetadata metadata;
  metadata.up = metadata.assimpUp = UpAxis::z;
  bool siUnit = true;
  metadata.metresPerUnit = readIfcMetresPerUnit(StepFile(text), siUnit).value_or(1);
  // assimp knows SI prefixes and takes every other unit as a metre.
  metadata.assimpScale = siUnit ? metadata.metresPerUnit : 1;
  return metadata;
}

std::string repairCollada(const std::filesystem::path& file, FileMetadata& metadata) {
  const std::string text = readColladaText(file, std::string::npos);
  std::string repaired;
  std::size_t begin = 0, count = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!isBlankBeforeNumber(text, i)) continue;
    repaired.append(text, begin, i + 1 - begin);
    begin = text.find_first_not_of(" \t\r\n", i + 1);
    i = begin - 1;
    ++count;
  }
  if (count == 0) return {};
  repaired.append(text, begin);
  metadata.problems.push_back(
      {"mended_text", count, "removed blanks before the first number of an element"});
  return repaired;
}

}  // namespace enfilade::scene
