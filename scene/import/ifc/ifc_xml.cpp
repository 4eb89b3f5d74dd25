#include "scene/import/ifc/ifc_xml.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "scene/import/ifc/ifc_readers.hpp"
#include "scene/import/ifc/web_ifc.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr std::array<std::string_view, 3> kXmlProblems{"xml_not_read", "xml_value_ignored",
                                                       "xml_reference_missing"};
constexpr const char* kXmlRemedy = "export it as .ifc, the STEP form";

/// The script and the Node.js that runs it. Throws ImportError if a part is missing.
WebIfcLocation findConverter(const std::string& file) {
  WebIfcLocation location = findWebIfc();
  const std::filesystem::path folder = std::filesystem::path(location.script).parent_path();
  location.script = (folder / "convert_ifcxml.js").string();
  std::error_code error;
  if (location.missing.empty() &&
      !std::filesystem::is_directory(folder / "node_modules/saxes", error))
    location.missing = "saxes is not in " + folder.string() + " (run npm ci there, or ./dev)";
  if (!location.missing.empty())
    throw ImportError(file + ": IFC in XML is not read: " + location.missing + "; or " +
                      kXmlRemedy);
  return location;
}

/// Receives the messages of the script: convert_ifcxml.js documents them.
class StepReceiver {
 public:
  StepReceiver(const std::string& file, std::size_t maxBytes, const ImportProgress& progress,
               std::vector<Diagnostic>& diagnostics)
      : file_(file), maxBytes_(maxBytes), progress_(progress), diagnostics_(diagnostics) {}

  bool handle(ImportMessage kind, std::span<const std::byte> body) {
    const std::string_view content(reinterpret_cast<const char*>(body.data()), body.size());
    double fraction = 0;
    switch (kind) {
      case ImportMessage::progress:
        if (!readProgress(body, stage, fraction)) return false;
        if (progress_) progress_(stage, fraction);
        return true;
      case ImportMessage::error:
        throw ImportError(file_ + ":" + std::string(content));
      case ImportMessage::stepText:
        return append(content);
      case ImportMessage::problem:
        return reportDiagnostic(content);
      case ImportMessage::done:
        return done = true;
      default:
        return false;
    }
  }

  std::string text, stage = "start";
  bool done = false;

 private:
  bool append(std::string_view block) {
    if (text.size() + block.size() > maxBytes_)
      throw ImportError(file_ + ": its content is larger than the " +
                        std::to_string(maxBytes_ >> 20) +
                        " MiB allowed; split it or raise the memory limit");
    text += block;
    return true;
  }

  bool reportDiagnostic(std::string_view content) {
    std::uint32_t count = 0;
    const std::size_t end = content.find('\n', sizeof count);
    if (end == std::string_view::npos) return false;
    std::memcpy(&count, content.data(), sizeof count);
    const std::string_view kind = content.substr(sizeof count, end - sizeof count);
    if (std::ranges::find(kXmlProblems, kind) == kXmlProblems.end()) return false;
    addDiagnostic(diagnostics_, std::string(kind), std::string(content.substr(end + 1)), count);
    return true;
  }

  const std::string& file_;
  const std::size_t maxBytes_;
  const ImportProgress& progress_;
  std::vector<Diagnostic>& diagnostics_;
};

}  // namespace

bool isXml(std::string_view text) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) return true;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '<';
}

std::string convertIfcXml(const ImportRequest& request, const std::string& xml,
                          const IfcXmlLimits& limits, const ImportProgress& progress,
                          std::vector<Diagnostic>& diagnostics) {
  const WebIfcLocation location = findConverter(request.file);
  IfcInput input(request, 1);
  input.fill(xml, {}, {});
  ImportRequest conversion = input.makeRequest(ImportTask::ifcXml, limits.timeLimit);
  conversion.program = location.node;
  conversion.script = location.script;
  StepReceiver receiver(request.file, limits.maxBytes, progress, diagnostics);
  const ImportExit end = runImportProcess(
      conversion,
      [&](ImportMessage kind, std::span<const std::byte> body) {
        return receiver.handle(kind, body);
      },
      [] { return std::numeric_limits<double>::infinity(); });
  if (!receiver.done)
    throw ImportError(request.file + ": the process that converts its XML " + end.describe() +
                      " during '" + receiver.stage + "'; " + kXmlRemedy +
                      ", or raise the memory limit");
  return std::move(receiver.text);
}

}  // namespace enfilade::scene
