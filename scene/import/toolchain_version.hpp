// Who makes a Model of a file, to tell whether an earlier one would be made again today.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "scene/import/worker/content_hash.hpp"

namespace enfilade::scene {

/// What tells a file from others: of a program or a library, which may be large, the build id that
/// its linker wrote; of another its content. nullopt where there is none that can be read.
std::optional<ContentHash> versionOf(const std::filesystem::path& file);

/// This program and its modules that read models, as they were linked: whoever changes a line of
/// the importer has others. The libraries behind the modules are told by Model::filesBeside.
const std::string& readerVersions();

}  // namespace enfilade::scene
