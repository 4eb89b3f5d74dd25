// The text of a STEP file (ISO 10303-21), as IFC is: which statement has which number, and what its
// arguments are. It knows no schema and takes what it can from a damaged file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::scene {

/// `#12=IFCWALL('...',#5,$);` without what is around.
struct StepStatement {
  std::uint32_t id = 0;
  std::string_view type;       ///< upper case
  std::string_view arguments;  ///< between the outer parentheses
};

class StepFile {
 public:
  /// Comments are blanked out; statements that are none are left out and counted.
  explicit StepFile(std::string text);
  StepFile(const StepFile&) = delete;
  StepFile& operator=(const StepFile&) = delete;

  const std::vector<StepStatement>& statements() const { return statements_; }  ///< in file order
  const StepStatement* find(std::uint32_t id) const;  ///< the first with it, or nullptr
  /// The same, if it is of that type.
  const StepStatement* find(std::uint32_t id, std::string_view type) const;
  const std::string& text() const { return text_; }
  const std::string& schema() const { return schema_; }  ///< as "IFC2X3"; empty: not told
  bool hasHeader() const;                                ///< ISO-10303-21
  bool hasEnd() const;                                   ///< END-ISO-10303-21
  std::size_t damaged() const { return damaged_; }

 private:
  void addStatement(std::string_view statement);
  std::string text_, schema_;
  std::vector<StepStatement> statements_;
  std::vector<std::uint32_t> byId_;  // indices into statements_, sorted by id
  std::size_t damaged_ = 0;
};

/// Split at the commas of the outermost level, blanks around removed.
std::vector<std::string_view> stepArguments(std::string_view arguments);

// Each takes one argument, and nullopt or nothing means that it is something else.
std::optional<std::uint32_t> stepReference(std::string_view argument);  ///< #12
std::optional<double> stepNumber(std::string_view argument);     ///< 3.5E2, IFCLENGTHMEASURE(3.5)
std::optional<std::string> stepText(std::string_view argument);  ///< 'name', as UTF-8
std::string_view stepSymbol(std::string_view argument);          ///< LEFT of .LEFT.
std::vector<std::uint32_t> stepReferences(std::string_view argument);  ///< of (#1,#2), or of #1
std::vector<double> stepNumbers(std::string_view argument);            ///< of (1.,2.)

}  // namespace enfilade::scene
