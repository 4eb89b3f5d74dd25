// Indexes the statements of a STEP file (ISO 10303-21), the format of IFC, by number. Independent
// of the schema; recovers as much as possible from a damaged file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::scene {

/// One statement such as `#12=IFCWALL('...',#5,$);`. Refers to the file's text.
struct StepStatement {
  std::uint32_t id = 0;
  std::string_view type;       ///< upper case
  std::string_view arguments;  ///< between the outer parentheses
};

/// The text of a STEP file and its statements.
class StepFile {
 public:
  /// Blanks out comments; skips and counts malformed statements.
  explicit StepFile(std::string text);
  StepFile(const StepFile&) = delete;
  StepFile& operator=(const StepFile&) = delete;

  const std::vector<StepStatement>& statements() const { return statements_; }  ///< in file order
  const StepStatement* find(std::uint32_t id) const;  ///< the first with this id, or nullptr
  /// As find(), but nullptr if the statement has another type.
  const StepStatement* findOfType(std::uint32_t id, std::string_view type) const;
  const std::string& text() const { return text_; }
  const std::string& schema() const { return schema_; }  ///< e.g. "IFC2X3"; empty: not stated
  bool hasEnd() const;                                   ///< END-ISO-10303-21
  std::size_t damagedCount() const { return damagedCount_; }

 private:
  void addStatement(std::string_view statement);
  std::string text_, schema_;
  std::vector<StepStatement> statements_;
  std::vector<std::uint32_t> byId_;  // indices into statements_, sorted by id
  std::size_t damagedCount_ = 0;
};

/// Splits at the commas of the outermost level and trims blanks.
std::vector<std::string_view> splitStepArguments(std::string_view arguments);

// Each parses one argument; nullopt or an empty result means another kind of argument.
std::optional<std::uint32_t> parseStepReference(std::string_view argument);  ///< #12
std::optional<double> parseStepNumber(std::string_view argument);  ///< 3.5E2, IFCLENGTHMEASURE(3.5)
std::optional<std::string> parseStepString(std::string_view argument);  ///< 'name', as UTF-8
std::string_view parseStepEnum(std::string_view argument);              ///< LEFT of .LEFT.
std::vector<std::uint32_t> parseStepReferences(
    std::string_view argument);                                   ///< of (#1,#2), or of #1
std::vector<double> parseStepNumbers(std::string_view argument);  ///< of (1.,2.)

}  // namespace enfilade::scene
