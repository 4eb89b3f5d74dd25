// The rules of the house, as functions on the text of the sources: which folder may include which,
// where third parties may be seen, how long a file may be.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace enfilade::architecture {

/// Path from the root of the repository (with '/'), and what is in the file.
using Sources = std::map<std::string, std::string>;

/// One line a fault: "file:line: what is wrong".
using Faults = std::vector<std::string>;

/// Every text file of the repository that people write, and, without their text, the pictures and
/// the licence that pages link to; build folders, out/ and .git left out.
Sources readSources(const std::filesystem::path& root);

/// Quoted includes go by path from the root, exist, and follow
/// collision <- scene <- render <- server, protocol <- server, scene <- assets.
Faults includeDirections(const Sources& sources);

/// A header that another folder can reach includes nothing but the standard library, Eigen,
/// generated messages and our own.
Faults thirdPartiesInPublicHeaders(const Sources& sources);

/// A third party is used only in the folders it was chosen for.
Faults thirdPartiesOutOfPlace(const Sources& sources);

Faults headersWithoutPragmaOnce(const Sources& sources);
/// A schema (.proto) may be twice as long: it is read as one document.
Faults longFiles(const Sources& sources, int maxLines);
Faults unfinishedWork(const Sources& sources);

/// Each kind of problem that scene/ tells stands in scene/model/diagnostic_catalog.cpp.
Faults problemsWithoutMeaning(const Sources& sources);

/// Tests run side by side: a file in the system's temporary folder under a name of its author's
/// choice is overwritten by the next test that chose it.
Faults sharedTemporaryFiles(const Sources& sources);

/// Links of the Markdown pages to files of the repository that are not there.
Faults brokenLinks(const Sources& sources);

}  // namespace enfilade::architecture
