// The rules of the architecture, as functions on the text of the sources: include directions,
// places of third parties, sizes of files and folders, words.
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

/// Every text file of the repository that people write. Also, without their text, the pictures and
/// the licence that pages link to. Build folders, out/ and .git are left out.
Sources readSources(const std::filesystem::path& root);

/// Quoted includes go by path from the root, exist, and follow
/// collision <- scene <- render <- server, protocol <- server, scene <- assets.
Faults findWrongIncludes(const Sources& sources);

/// Modules, each a .hpp file and the .cpp file of the same name, that include one another in a
/// ring. At most one ring is reported. Tests do not count.
Faults findIncludeRings(const Sources& sources);

/// A header that another folder can reach includes nothing but the standard library, Eigen,
/// generated messages and our own.
Faults findPublicThirdParties(const Sources& sources);

/// A third party is used only in the folders it was chosen for.
Faults findMisplacedThirdParties(const Sources& sources);

/// Rooms that ARCHITECTURE.md names neither in a heading nor as `room/`.
Faults findUndescribedRooms(const Sources& sources);

Faults findHeadersWithoutPragmaOnce(const Sources& sources);
/// A header of the product begins with a comment.
Faults findHeadersWithoutComment(const Sources& sources);
/// Code of the product has at most `maxOfProduct` lines; tests and documents have `maxOfOthers`. A
/// schema (.proto) may be twice as long as these: it is read as one document.
Faults findLongFiles(const Sources& sources, int maxOfProduct, int maxOfOthers);
Faults findUnfinishedWork(const Sources& sources);

/// A .cpp file in a room has a .hpp file of the same name. Mains, modules and the options of
/// sanitizers have none.
Faults findSourcesWithoutHeader(const Sources& sources);

/// A header of collision/ that no program of the product reaches. Neither another folder includes
/// it, nor a header that one reaches, nor the source of such a header. Tests do not count.
Faults findUnreachedHeaders(const Sources& sources);

/// A folder of the product holds at most `maxFiles` sources directly.
Faults findCrowdedFolders(const Sources& sources, int maxFiles);

/// Archaic, colloquial and roundabout words, which do not belong in technical English, one fault a
/// place. Comments, messages and pages count; identifiers that merely contain such a word do not.
/// Constants are named kMax.. and kMin.., not kMost.., kLeast.. and kLargest...
Faults findOddWords(const Sources& sources);

/// Sentences of the Markdown pages, and of comments in C++ and in the schema, with more than
/// `maxWords` words. A list item ends a sentence, too. Headings, tables, code and formulas do not
/// count.
Faults findLongSentences(const Sources& sources, int maxWords);

/// Functions of the product, and of all scripts for browsers and Node.js, that are named by a noun,
/// as `areaOf()`. The convention is verb + noun: `getArea()`, `findArea()`, `computeArea()`.
/// Comments count.
Faults findNounFunctions(const Sources& sources);

/// Each row of the table of body kinds is in the schema, in SIDECAR.md and among the page's
/// commands. No compiler compares them with the table.
Faults findBodyKindsLeftOut(const Sources& sources);

/// Each kind of diagnostic that scene/ reports is in scene/model/diagnostic_catalog.cpp.
Faults findUnexplainedDiagnostics(const Sources& sources);

/// Tests run side by side. A file in the system's temporary folder under a name of its author's
/// choice is overwritten by the next test that chose it.
Faults findSharedTemporaryFiles(const Sources& sources);

/// Links of the Markdown pages to files of the repository that are not there.
Faults findBrokenLinks(const Sources& sources);

}  // namespace enfilade::architecture
