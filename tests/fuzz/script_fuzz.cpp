// Fuzz target of the text of a walk script.
#include "protocol/script/script.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace enfilade::fuzz {

void tryBytes(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    const protocol::Script script = protocol::parseScript(text, "fuzz");
    std::uint32_t last = 0;
    for (const protocol::ScriptLine& line : script.lines) {
      require(line.number > last, "lines keep their order");
      last = line.number;
    }
  } catch (const protocol::ScriptError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
}

}  // namespace enfilade::fuzz
